// Low-rank basis of the kernels of all angles of incidence: few light terms instead of one beam per texel.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <vector>

#include "ldf/radial/radial_profile.h"
#include "simd/loops.h"
#include "solve/problem/problem.h"

namespace beamspread {

// Distribution of the angles of incidence of a plane's light. Angles are tan(theta / 2), in which LDFs are smooth
// everywhere.
struct Incidence {
    // Texels where a light is brightest, steepest and most grazing.
    struct Extremes {
        Texel brightest{};
        Texel steepest{};
        Texel most_grazing{};
        double irradiance = 0.0;  // of the brightest texel, over all channels; 0: all texels are dark
        float min_angle = 1.0f;
        float max_angle = 0.0f;
    };

    // Number of angles at which kernels are compared. More: more memory and time, hardly other terms.
    static constexpr std::size_t count = 64;
    double first = 1.0;  // larger than `last` if no texel is lit
    double last = 0.0;
    // Share of `count` even angles from first to last, with the sum 1: the mean of the shares of light, of lit beams
    // and of angles. Each present angle counts at the four around it, hence a basis for these serves the angles between
    // them.
    std::array<double, count> share{};
    std::vector<Extremes> extremes;  // [light], without coming light

    Incidence(const Plane& plane, const std::vector<PlaneLight>& lights, const ComingLight& coming = {});

    bool none() const { return first > last; }

private:
    // Extends the range to the extremes of some lights, and by a margin.
    void extend(const std::vector<Extremes>& lights, double margin);
};

enum class Phase { cosine, sine };

// Part of a kernel: `weight` times the harmonic m of a profile.
struct KernelTerm {
    std::size_t profile;
    std::size_t m;
    Phase phase;
    double weight;
};

// Harmonics [first, end).
struct HarmonicRange {
    std::size_t first = 0;
    std::size_t end = 0;
};

struct ScaledProfile {
    RadialProfile profile;
    double mean_free_path = 1.0;  // metres
    double reach = 0.0;           // metres; the profile counts as zero beyond
};

// The harmonic m of a kernel as the sum over i of u_i(theta) e_i(r). u_i is a table over tan(theta / 2), which is
// smooth everywhere and needs no trigonometry; e_i is the harmonic m of one profile per medium.
struct LowRankBasis {
    struct AngleFunction {
        std::size_t m;
        std::size_t rank;
    };
    double first = 0.0;  // tan(theta / 2) of the tables' first and last entries
    double last = 0.0;
    std::vector<AngleFunction> functions;              // ascending m, then rank
    // [step][function]: a beam reads all functions of its step, one after the other. Tables of one function each leave the
    // processor's cache, and a sky takes a third longer.
    std::vector<TableStep> table;
    std::size_t steps = 0;
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

    // Part of a kernel, relative to its power, that is lost without a term; of its sign, and linear between
    // `Incidence::count` angles.
    double function(std::size_t term, double half_tangent) const;

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
