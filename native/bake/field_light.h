// Light that was computed elsewhere: radiance at coarse nodes of a plane, by direction.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "base/progress.h"
#include "base/view.h"
#include "scene/ray_gather.h"
#include "solve/problem/problem.h"

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

    std::size_t lobes() const { return m_lobes.size(); }

    // Directions of the light of a lobe.
    Directions directions(std::size_t lobe) const;

    // Hands one ray per lobe and texel to the sink; ray i belongs to lobe i. The result is the same for any number of
    // threads. Throws Cancelled.
    void gather(const ReceiverGrid& grid, int threads, RaySink& sink, Progress& progress) const;

private:
    class Row;

    std::size_t m_rows;
    std::size_t m_columns;
    std::vector<Lobe> m_lobes;
    std::optional<Vec3> m_position;
    std::vector<float> m_radiance;  // [lobe][row][column][channel], lobes with light alone
    std::vector<float> m_is_lit;    // [row][column] 1: light from any direction reaches the node
};

}  // namespace beamspread
