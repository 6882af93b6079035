// Grids that light is transformed on, and how a plane is split into them.
#pragma once

#include <algorithm>
#include <cstddef>
#include <optional>
#include <vector>

#include "solve/problem/light.h"
#include "solve/separable/kernel_term.h"
#include "solve/spectral/radial_window.h"

namespace beamspread {

// A plane of nodes, the tiles that it is solved in, and the size that each is padded to. A node is a texel, or stands
// for several (solve/spectral/spline_axis.h).
struct PaddedPlane {
    std::size_t width = 0;
    std::size_t height = 0;
    double pitch_x = 1.0;  // metres
    double pitch_y = 1.0;
    std::size_t texels_x = 1;  // from node to node
    std::size_t texels_y = 1;
    std::size_t halo_x = 0;  // nodes that light may spread along x: no kernel holds anything beyond
    std::size_t halo_y = 0;
    std::size_t tile_width = 0;
    std::size_t tile_height = 0;
    std::size_t padded_width = 0;  // even
    std::size_t padded_height = 0;

    // The unit of length of its kernels, metres.
    double unit() const { return std::max(pitch_x, pitch_y); }

    // Of the half-transformed rows of a tile's light.
    std::size_t columns() const { return padded_width / 2 + 1; }
    std::size_t rows() const { return std::min(height, tile_height + 2 * halo_y); }
};

// Half-transformed tiles in memory at once.
struct SpectraAtOnce {
    std::size_t terms = 0;  // of the light
    std::size_t media = 0;  // results
};

// Results take no more than half of the budget, bytes, unless the light needs less, which has what is left; nothing if
// not one of each fits.
SpectraAtOnce spectra_at_once(const PaddedPlane& plane, std::size_t terms, std::size_t media, std::size_t budget);

// The texels around the pole of a kernel, at offsets up to (x, y), that are integrated exactly.
struct KernelCentre {
    std::size_t x = 0;
    std::size_t y = 0;
};

// One grid and what of the kernels is convolved there, lengths in units of the grid.
struct Level {
    PaddedPlane plane;
    std::optional<KernelCentre> centre;
    std::optional<RadialWindow> ring;  // of detail that the grid resolves
};

// The texels themselves, for all of the kernels or for what they hold within some distance, and then a coarser grid for
// the rest, which has no detail finer than that grid and is spread farther than a tile is worth padding.
struct Levels {
    Level texels;
    std::optional<Level> coarse;
    std::optional<RadialWindow> outside_centre;  // what of the kernels the texels of the centre don't hold
};

// What decides about the levels, besides the plane.
struct LevelChoice {
    // Width of the border of the kernels' centres, texels. The wider, the less detail beyond what texels resolve is
    // left outside, and the longer the sums.
    double centre_deviation = 3.0;
    std::size_t budget = 0;      // bytes, for spectra
    std::size_t terms = 1;       // of the light
    std::size_t media = 1;       // results
    std::size_t coarsening = 0;  // texels from node to node of the coarse grid; 1: no such grid; 0: what costs least
};

// The padding is the least where nothing that the kernels hold within reach comes back on the other side; tiles are what
// costs least within the budget, if any are.
Levels choose_levels(const Plane& plane, const std::vector<ScaledProfile>& profiles, const LevelChoice& choice);

}  // namespace beamspread
