// Light that surfaces reflect to receivers: radiance at coarse nodes, by direction.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "base/progress.h"
#include "scene/bent_nodes.h"
#include "scene/light_choice.h"
#include "scene/occluders.h"
#include "scene/path_wave.h"

namespace beamspread {

// A rectangle above a receiver, evenly divided into the surroundings of nodes; or nodes of a mesh that bends, row by row,
// the last one repeated to fill the last row. Directions at these are in their `FieldFrame`.
struct NodeGrid {
    Vec3 corner{};  // world, metres
    Vec3 x_axis{};  // unit vectors at right angles
    Vec3 y_axis{};
    Vec3 normal{};
    Vec2 size{0.0};  // metres
    std::size_t columns = 0;
    std::size_t rows = 0;
    const BentNodes* bent = nullptr;  // null: the rectangle

    // The nodes of a mesh, which must outlive the grid.
    static NodeGrid of(const BentNodes& bent);

    std::size_t nodes() const { return columns * rows; }

    // Nodes without repeated ones.
    std::size_t different() const { return bent ? bent->size() : nodes(); }

    // Throws InvalidArgument.
    void check() const;
};

// A part of the hemisphere: begin and extent of the squared sine and of the azimuth over 2 pi, in which directions drawn
// by the cosine are even.
struct Stratum {
    double begin = 0.0;
    double extent = 1.0;
    double turn = 0.0;
    double part = 1.0;

    // Its fraction of the irradiance of even light.
    double weight() const { return extent * part; }
};

struct BouncedSettings {
    // Mean irradiance of direct light, W/m^2, and allowed noise relative to direct and bounced irradiance.
    double direct = 0.0;
    double tolerance = 0.01;
    // Radius, metres, over which the medium averages light: noise counts as its mean over that distance.
    double spread = 0.0;
    BounceLimits limits;
    int max_samples = 128;   // paths for each stratum of a node
    double max_rays = std::numeric_limits<double>::infinity();  // along all paths, without shadow rays
    std::uint32_t seed = 0;
    int threads = 0;  // 0: all
};

struct BouncedLight {
    // [stratum][row][column] of each grid: mean radiance weighted by the cosine, W/(m^2 sr).
    std::vector<std::vector<Vec3f>> radiance;
    double irradiance = 0.0;  // mean over nodes and channels, W/m^2
    double noise = 0.0;       // root mean square error of averaged irradiance, relative to direct and bounced
    std::size_t paths = 0;
};

// Traces light from all lights by way of reflecting surfaces to the grids. Two independent estimates give the noise; there
// are more paths until it is within tolerance. The result is the same, bit for bit, for any number of threads. Throws
// InvalidArgument, Cancelled.
BouncedLight trace_bounced_light(std::span<const NodeGrid> grids, std::span<const Stratum> strata,
                                 std::span<const SceneLight> lights, const Occluders* surfaces,
                                 const BouncedSettings& settings, Progress& progress);

}  // namespace beamspread
