// Light that was computed elsewhere: radiance at coarse nodes of a plane or of a mesh that bends, by direction.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "bake/node_spline.h"
#include "bake/surface.h"
#include "base/progress.h"
#include "scene/node_cloud.h"
#include "scene/ray_gather.h"
#include "solve/problem/problem.h"
#include "solve/spectral/light_field.h"

namespace beamspread {

// One lobe stands for all directions within a part of the hemisphere.
struct Lobe {
    Vec3f travel{0.0f, 0.0f, -1.0f};  // unit vector in the plane's frame
    float solid_angle = 0.0f;         // irradiance over radiance: solid angle times mean cosine, sr
};

class FieldLight {
public:
    // Light of lobes whose directions are the same at all texels. `radiance` is [lobe][row][column][channel] at nodes
    // evenly spread over the plane, W/(m^2 sr), 0 or more; copied.
    FieldLight(const float* radiance, std::size_t rows, std::size_t columns, std::span<const Lobe> lobes);

    // One lobe whose light travels away from a point: metres from the outer corner of texel (0, 0), in the plane's
    // frame.
    FieldLight(const float* radiance, std::size_t rows, std::size_t columns, float solid_angle, const Vec3& position);

    // Light at the nodes of a mesh that bends, for grids that bend: `radiance` is [lobe][node][channel], and directions are
    // in the `FieldFrame` of each node.
    FieldLight(const float* radiance, NodeCloud nodes, std::span<const Lobe> lobes);

    std::size_t lobes() const { return m_lobes.size(); }

    // Directions of the light of a lobe.
    Directions directions(std::size_t lobe) const;

    // Hands one ray per lobe and texel to the sink; ray i belongs to lobe i. Throws InvalidArgument if the grid bends and
    // the light does not belong to a mesh, or the reverse. Not `all`: only texels that are no inner
    // ones. The result is the same for any number of threads. Throws Cancelled.
    void gather(const ReceiverGrid& grid, int threads, bool all, RaySink& sink, Progress& progress) const;

    // Adds the light that inner texels of a surface receive, times `color`, to the moments of a field that counts
    // moments alone. Inner texels lie between the outermost nodes. Light is linear in the nodes there, so that the sums
    // over lobes are made at the nodes. `place` is that of the surface's first texel in the field. Not for light from a
    // point. Throws Cancelled.
    void add_inner_moments(const Surface& surface, const Texel& place, const std::vector<double>& color, int threads,
                           LightField& field, Progress& progress) const;

    // The light times `color` as the choice of terms needs it. Not for light from a point.
    SmoothLight smooth_light(const std::vector<double>& color) const;

private:
    class Row;

    void gather_bent(const ReceiverGrid& grid, int threads, RaySink& sink, Progress& progress) const;
    void gather_part(const ReceiverGrid& grid, const NodeSpline& nodes, const RowSpan& span, Row& row,
                     RaySink& sink) const;
    NodeSpline spline(const ReceiverGrid& grid) const { return {grid.height, grid.width, m_rows, m_columns}; }
    const std::vector<float>& irradiance(std::size_t lobe, std::size_t channel) const
    {
        return m_irradiance[3 * lobe + channel];
    }

    std::size_t m_rows = 0;
    std::size_t m_columns = 0;
    std::vector<Lobe> m_lobes;
    std::optional<NodeCloud> m_cloud;           // of a mesh
    std::vector<Vec3f> m_cloud_irradiance;      // [node][lobe] W/m^2
    std::vector<std::uint8_t> m_cloud_is_lit;   // [node]
    std::optional<Vec3> m_position;
    std::vector<std::vector<float>> m_irradiance;  // [lobe and channel] coefficients, W/m^2; lobes with light alone
    std::vector<float> m_is_lit;  // coefficients; 1: light from any direction reaches the node
};

}  // namespace beamspread
