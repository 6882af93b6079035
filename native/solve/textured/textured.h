// Luminance of a plane whose albedo differs from texel to texel: the convention of renderers, corrected by shared paths.
//
// The convention spreads light in a medium of one albedo and multiplies it by factors of the texture where it enters and
// where it leaves; solvers compute it without noise. The same paths estimate the truth and the convention, and the ratio of
// both, which is smooth and has little noise, corrects the solver's result.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/progress.h"
#include "base/vec.h"
#include "base/view.h"
#include "medium/medium.h"

namespace beamspread {

// Light of about one direction.
struct TexturedLight {
    View2D<const float> irradiance;  // W/m^2; of any size, texels show the nearest value
    Vec3 travel{0.0, 0.0, -1.0};  // unit vector in the frame of the plane, z < 0
};

// One color channel.
struct TexturedProblem {
    Medium medium;
    std::array<double, 2> texels_per_path{1.0, 1.0};  // a mean free path in texels, along x and y
    View2D<const float> albedo;  // of each texel, in [0, 1)
    View2D<const float> factor;  // the convention's, of light that enters and of light that leaves; > 0
    double mean_albedo = 0.0;  // the convention's
    View2D<const float> convention;  // luminance by the convention
    std::vector<TexturedLight> lights;
    View2D<const float> coverage{};  // fraction of each texel that light enters; without data: 1
    bool is_through = false;  // light leaves through the far face of a slab
    double tolerance = 0.01;  // wanted error of texels, root mean square, over that of the luminance
    std::size_t max_walks = 4096;  // for each texel
    double max_more = 1.0;  // largest multiple of them where lights share walks: as many as take the time of one light
    double max_products = 6e9;  // scatterings of all texels; a core does a few 10^9 a second
    std::uint64_t seed = 0;
    int threads = 0;
};

struct TexturedError {
    double error = 0.0;  // estimated, as `tolerance`
    std::size_t walks = 0;
};

// Writes the luminance (height, width), with `stride` elements from one texel to the next; it may be the convention's.
// The result does not depend on the number of threads. Throws InvalidArgument, Cancelled.
TexturedError solve_textured(const TexturedProblem& problem, Progress& progress, float* luminance, std::size_t stride);

}  // namespace beamspread
