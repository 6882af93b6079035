// A few light terms in place of a beam per texel, for light whose direction changes from texel to texel.
#pragma once

#include <cstddef>
#include <vector>

#include "base/view.h"
#include "solve/kernel_spectra.h"
#include "solve/problem.h"

namespace beamspread {

// Light of one source on the plane.
struct LightField {
    View2D<const float> irradiance;
    Directions directions;
};

// What decides a kernel, besides the direction.
struct KernelMedium {
    const LdfSource* library = nullptr;
    double albedo = 0.0;
    double mean_free_path = 1.0;

    bool operator==(const KernelMedium&) const = default;
};

// The harmonic m of a kernel as sum over i of u_i(theta) e_i(r): u_i are tables over tan(theta / 2), which needs no
// trigonometry and is smooth everywhere; e_i is the harmonic m of a profile per medium.
struct LowRankBasis {
    struct AngleFunction {
        std::size_t m;
        std::size_t rank;
        std::vector<float> values;
    };
    double first = 0.0;  // tan(theta / 2) of the first and last entries of the tables
    double last = 0.0;
    std::vector<AngleFunction> functions;              // ascending m, then rank
    std::vector<std::vector<ScaledProfile>> profiles;  // [medium][rank]
};

// The least costly basis whose kernels are off by at most `tolerance`: relative L1 error (bounded by the chi-square
// distance to the mean kernel), root mean square over the media, the light, the lit texels and the angles present. The
// media share the functions of the angle. `texel` is the side of a texel in metres: detail inside the one where a beam
// enters does not count. Empty where nothing is lit.
LowRankBasis low_rank_basis(const std::vector<LightField>& lights, const std::vector<KernelMedium>& media, double texel,
                            double tolerance);

}  // namespace beamspread
