// What a solver is asked: beams on a regular grid, and the medium that they enter.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "base/progress.h"
#include "base/vec.h"
#include "base/view.h"
#include "ldf/radial/ldf_source.h"

namespace beamspread {

struct Channel {
    View2D<const float> irradiance;        // W/m^2
    const LdfSource* library = nullptr;
    double albedo = 0.0;
    double mean_free_path = 1.0;           // metres
};

// Directions of travel in the plane frame, unit vectors with z < 0: one for all beams, or one per texel.
struct Directions {
    Vec3 uniform{0.0, 0.0, -1.0};
    const float* field = nullptr;  // (height, width, 3) row by row; null: uniform
};

struct Problem {
    std::size_t width = 0;
    std::size_t height = 0;
    double pitch_x = 1.0;  // metres
    double pitch_y = 1.0;
    Directions directions;
    std::vector<Channel> channels;
    double tolerance = 1e-3;  // relative error of the luminance that an approximating solver may make
    int threads = 0;
    std::size_t memory = std::size_t{5} << 26;  // bytes that spectra may take at once; beyond, in tiles
    std::size_t coarsening = 0;  // of the grid that light spreads far on, texels; 1: none, 0: what costs least
};

// Luminance in W/(m^2 sr), one plane (height, width) per channel.
using Luminance = std::vector<std::vector<float>>;

// Throws InvalidArgument for irradiance, directions or pitches that no solver covers.
void validate(const Problem& problem);

// Every texel is one beam, every pair of texels is visited: the truth for the other solvers.
Luminance solve_direct(const Problem& problem, Progress& progress);

// Evenly lit squares as one beam each, and small beams seen from afar on coarser grids.
Luminance solve_adaptive(const Problem& problem, Progress& progress);

// The same sums by Fourier transforms, padded so that light that leaves the plane does not come back; the sum of
// several lights, which differ in irradiance and directions only. Writes (height, width, channels).
void solve_fft(const std::vector<Problem>& lights, Progress& progress, float* luminance);

// What all solvers leave out, as it has no place in a smooth kernel: light that a slab with an ior above 1 returns
// unscattered from its far boundary. Adds to (height, width, channels).
void add_unscattered(const std::vector<Problem>& lights, float* luminance);

}  // namespace beamspread
