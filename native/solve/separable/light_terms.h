// Terms of a plane's light: for each function of the direction, light that one kernel spreads; and their values row by
// row.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "base/platform.h"
#include "solve/problem/problem.h"
#include "solve/separable/low_rank.h"

namespace beamspread {

// Light that one kernel per result spreads: the weighted sum of some lights of one direction; or a moment of all lights
// of changing directions, the sum of irradiance times colour in a set times u(theta) times cos or sin(m beta).
struct LightTerm {
    struct Share {
        std::size_t light;
        float weight;
    };
    std::vector<Share> fixed;  // empty for a moment
    std::size_t function = 0;
    Phase phase = Phase::cosine;
    std::size_t set = 0;
    std::vector<std::vector<KernelTerm>> kernels;  // [result], sorted, see `KernelSpectra::parts`; empty: none
    std::size_t source = 0;  // of moments: the term whose added light this term's is a factor of

    bool is_moment() const { return fixed.empty(); }
};

// Light that is added to terms, [term][texel]. All planes share one block of memory, which all threads clear: one thread
// took a quarter of the time of a bake under a sky.
class MomentPlanes {
public:
    // No plane.
    MomentPlanes() = default;

    // Planes of zeros for the terms that are moments, which share those of their sources; the others have none. Calls
    // `advance` after each, from any thread.
    MomentPlanes(const std::vector<LightTerm>& terms, std::size_t texels, const std::function<void()>& advance);

    void clear(const std::function<void()>& advance = {});

    // Null if the term has no plane.
    float* plane(std::size_t term) { return m_planes.empty() ? nullptr : m_planes[term]; }
    const float* plane(std::size_t term) const { return m_planes.empty() ? nullptr : m_planes[term]; }

private:
    std::size_t m_texels = 0;
    HugePages<float> m_data;
    std::vector<float*> m_planes;    // [term]
    std::vector<std::size_t> m_own;  // terms that keep a plane
};

// All terms. Lights of few directions have one term per direction, with all harmonics. All other lights, of any number,
// add up to the moments of one basis: row by row from stored lights, or as they come.
struct LightTerms {
    Plane plane;
    ChannelSets sets;
    std::vector<PlaneLight> fixed;
    std::vector<PlaneLight> changing;
    std::vector<std::vector<float>> colors;  // [changing][set]
    LowRankBasis basis;                      // of `changing`
    std::vector<LightTerm> terms;
    std::vector<ScaledProfile> profiles;
    MomentPlanes moments;  // of added light
    const float* entering = nullptr;  // as of `Problem`
    std::size_t channels = 0;         // of these factors

    // Factor of a set's light that enters at a texel.
    float entering_factor(std::size_t set, std::size_t y, std::size_t x) const
    {
        return entering ? entering[(y * plane.width + x) * channels + sets.channel(set)] : 1.0f;
    }

    // True if sets differ in what enters. Terms are then in the order of the sets, as many for each: terms
    // set + i * sets.count() are those of a set.
    bool have_sets_apart() const { return entering && sets.count() > 1; }
};

// Chooses the terms of a decomposition that lights of changing directions need.
using TermChoice =
    std::function<std::vector<std::size_t>(const KernelDecomposition&, const Incidence&, const LightTerms&)>;

// Makes the terms of a problem. Kernels end at the radius outside of which they have the fraction `beyond` of their
// power, those of one direction at most a millionth. With coming light, lights of changing directions serve the choice
// of terms alone.
LightTerms light_terms(const Problem& problem, double beyond, const TermChoice& choose);

// Adds beams of changing directions to the moments of terms.
class BeamMoments {
public:
    // Returns the address of a term's value at the first beam.
    using Values = std::function<float*(std::size_t term)>;

    // Adds beams to terms [first, end). `colors` has their colour in each set, `irradiance` their irradiance,
    // [set][beam]; null: `beams.irradiance` in all sets.
    void add(const LightTerms& terms, const BeamRow& beams, const std::vector<float>& colors, std::size_t first,
             std::size_t end, const Values& values, const float* irradiance = nullptr);

private:
    std::vector<std::uint32_t> m_step;  // in the tables of the basis
    std::vector<float> m_part;
    std::vector<float> m_cosine;  // cos(m beta), sin(m beta), times irradiance if all sets share it
    std::vector<float> m_sine;
    std::vector<float> m_u;  // [function][beam]
    std::vector<float> m_product;
};

// Moments of light of some directions, irradiance 1 in all channels and a color in each, [term][direction].
std::vector<float> factors_of_directions(const LightTerms& terms, std::span<const Vec3f> travel,
                                         const std::vector<double>& color);

// The terms' light in one row of texels, from stored and added lights.
class TermRow {
public:
    // Computes the values of `count` terms from the first, `step` apart.
    void start(const LightTerms& terms, const RowSpan& span, std::size_t first, std::size_t count,
               std::size_t step = 1);

    // [term][texel], of the terms in their order.
    const float* values() const { return m_values.data(); }

private:
    void enter(const LightTerms& terms, const RowSpan& span, std::size_t first, std::size_t count, std::size_t step);

    std::vector<float> m_values;
    std::vector<float> m_light;
    std::vector<float> m_colors;
    std::vector<float> m_entering;
    BeamRow m_beams;  // of one light
    BeamMoments m_moments;
};

// Adds rays to the moments of terms. Each thread has its own object; threads must not add to the same row at once.
class MomentSum {
public:
    // Adds rays times `color`, a factor of each channel. `is_colored` is true if the rays' channels are not
    // proportional; otherwise the largest channel counts for all.
    void add(LightTerms& terms, const RayRow& rays, const std::vector<double>& color, bool is_colored);

private:
    void add_beams(LightTerms& terms, const RowSpan& span, const float* irradiance = nullptr);

    BeamRow m_beams;
    BeamMoments m_moments;
    std::vector<float> m_irradiance;  // [set][beam]
    std::vector<float> m_colors;
};

}  // namespace beamspread
