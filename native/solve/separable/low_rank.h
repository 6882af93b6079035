// A few light terms in place of a beam per texel, for light whose direction changes from texel to texel.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "simd/loops.h"
#include "solve/separable/incidence.h"
#include "solve/separable/kernel_term.h"

namespace beamspread {

// The harmonic m of a kernel as sum over i of u_i(theta) e_i(r): u_i are tables over tan(theta / 2), which needs no
// trigonometry and is smooth everywhere; e_i is the harmonic m of a profile per medium.
struct LowRankBasis {
    struct AngleFunction {
        std::size_t m;
        std::size_t rank;
        std::vector<TableStep> values;
    };
    double first = 0.0;  // tan(theta / 2) of the first and last entries of the tables
    double last = 0.0;
    std::vector<AngleFunction> functions;              // ascending m, then rank
    std::vector<std::vector<ScaledProfile>> profiles;  // [medium][rank]
};

// Kernels of all angles present, taken apart: for each harmonic m the singular value decomposition of the matrix
// sqrt(share of the angle) c_m(theta, r) / sqrt(mean c_0(r)), of angles times (medium, radius). By the theorem of Eckart
// and Young (1936, doi:10.1007/BF02288367) no other functions leave less of its square norm out, which is the
// chi-square distance to the kernels, bounds their relative L1 error, and is a mean over the media, the light, the lit
// beams and the angles present. The media share the functions of the angle.
class KernelDecomposition {
public:
    // `texel` is the side of a texel in metres: detail inside the one where a beam enters does not count.
    KernelDecomposition(const Incidence& incidence, const std::vector<ChannelMedium>& media, double texel);
    ~KernelDecomposition();

    struct Term {
        std::size_t m;
        std::size_t rank;
        double gain;  // square error that it takes away
    };

    // Ascending m, then rank.
    const std::vector<Term>& terms() const { return m_terms; }

    // The cheapest terms by which the kernels are off by no more than `tolerance`.
    std::vector<std::size_t> within(double tolerance) const;

    // Of some of the terms, in their order, without what the kernels hold beyond the radius that all but the fraction
    // `beyond` of their power stays within.
    LowRankBasis basis(const std::vector<std::size_t>& chosen, double beyond) const;

private:
    struct Angular;

    std::vector<ChannelMedium> m_media;
    double m_first;
    double m_last;
    std::vector<Term> m_terms;
    std::unique_ptr<Angular> m_angular;
};

}  // namespace beamspread
