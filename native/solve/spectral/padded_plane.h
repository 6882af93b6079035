// Grids on which light is transformed, the windows that divide kernels among them, and the choice of grids and tiles
// for a plane.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <vector>

#include "solve/problem/problem.h"
#include "solve/separable/low_rank.h"

namespace beamspread {

// Radius around which a window of standard deviation 1 falls like erfc, and its end. The window's error is erfc(4.75 /
// sqrt(2)) / 2 = 1.0e-6 at its pole and erfc(4.5 / sqrt(2)) / 2 = 3.4e-6 at its end. Larger: smaller errors, more time.
inline constexpr double window_radius = 4.75;
inline constexpr double window_end = 9.25;

// The ring between two windows, tapered at a cut. Lengths are in texels.
struct RadialWindow {
    double inner = 0.0;  // standard deviation of the inner window, which the ring excludes
    double outer = 0.0;  // standard deviation of the outer window, outside of which the ring ends; 0: none
    double cut = 0.0;    // radius at which the taper begins
    double taper = 0.0;  // length over which it falls to zero

    double end() const { return cut + taper; }

    double weight(double r) const
    {
        return (outside(r, inner) - (outer > 0.0 ? outside(r, outer) : 0.0)) * before_cut(r);
    }

private:
    static double outside(double r, double deviation)
    {
        return 0.5 * std::erfc((window_radius - r / deviation) / std::numbers::sqrt2);
    }

    double before_cut(double r) const
    {
        if (r <= cut)
            return 1.0;
        if (r >= cut + taper)
            return 0.0;
        const double t = 1.0 - (r - cut) / taper;
        return t * t * t * (10.0 + t * (6.0 * t - 15.0));
    }
};

// A plane of nodes, the tiles in which it is solved, and their padded size. A node is a texel, or a node of a coarser
// grid (solve/spectral/convolution.h).
struct PaddedPlane {
    std::size_t width = 0;
    std::size_t height = 0;
    double pitch_x = 1.0;  // metres
    double pitch_y = 1.0;
    std::size_t texels_x = 1;  // from node to node
    std::size_t texels_y = 1;
    std::size_t halo_x = 0;  // nodes beyond which no kernel spreads light along x
    std::size_t halo_y = 0;
    std::size_t tile_width = 0;
    std::size_t tile_height = 0;
    std::size_t padded_width = 0;  // even
    std::size_t padded_height = 0;

    // Unit of length of kernels, metres.
    double unit() const { return std::max(pitch_x, pitch_y); }

    // Size of a tile's light after the transform along x.
    std::size_t columns() const { return padded_width / 2 + 1; }
    std::size_t rows() const { return std::min(height, tile_height + 2 * halo_y); }
};

// Number of half-transformed tiles in memory.
struct SpectraAtOnce {
    std::size_t terms = 0;  // of the light
    std::size_t media = 0;  // results
};

// Divides a budget (bytes): results get at most half, unless the light needs less; the light gets the rest. Zeros if
// the budget is too small for one of each.
SpectraAtOnce spectra_at_once(const PaddedPlane& plane, std::size_t terms, std::size_t media, std::size_t budget);

// The texels at offsets up to (x, y) from the pole of a kernel, which are integrated exactly.
struct KernelCentre {
    std::size_t x = 0;
    std::size_t y = 0;
};

// One grid, and the part of the kernels that is convolved on it. Lengths are in units of the grid.
struct Level {
    PaddedPlane plane;
    std::optional<KernelCentre> centre;
    std::optional<RadialWindow> ring;  // has detail that the grid resolves
};

// The grids of a plane: the texels, for the kernels or their inner part, and possibly a coarser grid for the outer
// part, which has no finer detail and spreads farther than padding of tiles is worth.
struct Levels {
    Level texels;
    std::optional<Level> coarse;
    std::optional<RadialWindow> outside_centre;  // the part of the kernels outside their centre
};

// Parameters of the choice of levels, besides the plane.
struct LevelChoice {
    std::size_t budget = 0;      // bytes, for spectra
    std::size_t terms = 1;       // of the light
    std::size_t media = 1;       // results
    std::size_t coarsening = 0;  // texels between nodes of the coarse grid; 1: no such grid; 0: the cheapest choice
    bool one_tile = false;       // of texels, without a coarse grid
};

// Chooses the grids, the smallest padding that keeps light from wrapping around, and the cheapest tiles within the
// budget.
Levels choose_levels(const Plane& plane, const std::vector<ScaledProfile>& profiles, const LevelChoice& choice);

}  // namespace beamspread
