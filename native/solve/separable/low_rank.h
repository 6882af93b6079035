// Low-rank basis of kernels: few light terms instead of one beam per texel, for light of changing directions.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "simd/loops.h"
#include "solve/separable/incidence.h"
#include "solve/separable/kernel_term.h"

namespace beamspread {

// The harmonic m of a kernel as the sum over i of u_i(theta) e_i(r). u_i is a table over tan(theta / 2), which is
// smooth everywhere and needs no trigonometry; e_i is the harmonic m of one profile per medium.
struct LowRankBasis {
    struct AngleFunction {
        std::size_t m;
        std::size_t rank;
        std::vector<TableStep> values;
    };
    double first = 0.0;  // tan(theta / 2) of the tables' first and last entries
    double last = 0.0;
    std::vector<AngleFunction> functions;              // ascending m, then rank
    std::vector<std::vector<ScaledProfile>> profiles;  // [medium][rank]
};

// Decomposition of the kernels of all present angles: for each harmonic m the singular value decomposition of the
// matrix sqrt(share of the angle) c_m(theta, r) / sqrt(mean c_0(r)), of angles times (medium, radius). The theorem of
// Eckart and Young (1936, doi:10.1007/BF02288367) makes it the best approximation in the matrix's square norm. That
// norm is the chi-square distance to the kernels, which bounds their relative L1 error, as a mean over media, light and
// present angles. All media share the functions of the angle.
class KernelDecomposition {
public:
    // `texel` is the side of a texel in metres. Detail inside a beam's own texel does not count.
    KernelDecomposition(const Incidence& incidence, const std::vector<ChannelMedium>& media, double texel);
    ~KernelDecomposition();

    struct Term {
        std::size_t m;
        std::size_t rank;
        double gain;  // reduction of the square error
    };

    // All terms, by ascending m, then rank.
    const std::vector<Term>& terms() const { return m_terms; }

    // The cheapest terms with which kernels are off by at most `tolerance`.
    std::vector<std::size_t> within(double tolerance) const;

    // Basis of some of the terms, in their order. Kernels end at the radius outside of which they have the fraction
    // `beyond` of their power.
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
