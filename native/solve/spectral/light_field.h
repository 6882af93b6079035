// Light on a plane and the luminance that it causes, by the solver `fft`: the sums of the direct solver as products of
// spectra (docs/method.md). Its memory does not grow with the light.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "base/progress.h"
#include "base/threads.h"
#include "solve/problem/problem.h"
#include "solve/problem/unscattered.h"
#include "solve/separable/light_terms.h"
#include "solve/spectral/convolution.h"
#include "solve/spectral/kernel_spectra.h"
#include "solve/spectral/padded_plane.h"

namespace beamspread {

// Units of progress that the choice of terms and the solution advance by. Both take about as long for a lamp on
// 512 x 512 texels.
inline constexpr double choice_work = 1.0;
inline constexpr double spread_work = 1.0;

// The plane is padded so that light that leaves it does not come back.
class LightField {
public:
    // Chooses terms and advances the progress by `choice_work`. The arrays of `problem.lights` and `problem.entering` must
    // outlive the field; those of `problem.coming` need not. Throws InvalidArgument, MemoryLimit, Cancelled.
    LightField(const Problem& problem, Progress& progress);

    // Adds rays of the coming light of the problem, before they enter: they are reduced to moments at once and not stored.
    // `color` and `is_colored` as for `MomentSum`. Several threads may add rays of different rows at once.
    void add(const RayRow& rays, const std::vector<double>& color, bool is_colored);

    // False if rays count beside their moments, in light that returns unscattered.
    bool counts_moments_alone() const { return !m_unscattered || m_unscattered->is_empty(); }

    // Factors from irradiance to the moments of light of some directions, [term][direction]. `color` is a factor of each
    // channel; the irradiance of `channel(term)` counts.
    std::vector<float> moment_factors(std::span<const Vec3f> travel, const std::vector<double>& color) const;

    // Adds values times factors to the moments of a term in part of a row. Several threads may add to different rows at
    // once.
    void add_moments(std::size_t term, const RowSpan& span, const float* factors, const float* values);

    std::size_t channel(std::size_t term) const { return m_terms.sets.channel(m_terms.terms[term].set); }

    // Writes (height, width, channels), radiance in W/(m^2 sr): the sum over all lights and rays. Advances the progress
    // by `spread_work`. Throws Cancelled.
    void solve(Progress& progress, float* luminance);

    // Removes the rays that were added; terms and kernels stay.
    void clear();

    const Plane& plane() const { return m_problem.plane; }
    std::size_t channels() const { return m_problem.channels.size(); }

    // Number of terms. The time to solve grows in proportion.
    std::size_t terms() const { return m_terms.terms.size(); }

private:
    // Terms that are spread together, and their results.
    struct TermGroup {
        std::vector<LightTerm> terms;  // with kernels for these results alone
        std::size_t first = 0;         // among all terms, `step` apart
        std::size_t step = 1;
        std::vector<std::size_t> results;
    };

    // Luminance beyond the reach of the texels' kernels, in the scale of the texels' sums before their factor.
    struct CoarseLuminance {
        CoarseGrid grid;
        std::vector<std::vector<float>> nodes;  // [result of the group]
    };

    std::vector<TermGroup> groups() const;
    MakeLightRow rows_of(const TermGroup& group) const;
    void spread(Progress& progress, float* luminance);
    void spread(const TermGroup& group, Progress& progress, double work, float* luminance);
    CoarseLuminance spread_coarsely(const TermGroup& group, const Level& level, Progress& progress, double work);
    void add_row(std::size_t result, const RowSpan& span, const float* values, double factor, float* luminance) const;

    Problem m_problem;  // without coming light
    LightTerms m_terms;
    Levels m_levels;
    std::optional<KernelSpectra> m_spectra;  // of the texels; empty until the first solution
    std::optional<KernelSpectra> m_coarse_spectra;
    std::optional<UnscatteredRays> m_unscattered;  // of rays
    PerThread<MomentSum> m_sums;
    PerThread<CoarseGrid::Scratch> m_scratch;
};

}  // namespace beamspread
