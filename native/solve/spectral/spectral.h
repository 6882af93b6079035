// The fft solver: the sums of the direct solver as products of spectra (docs/method.md).
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "base/progress.h"
#include "base/threads.h"
#include "solve/problem/problem.h"
#include "solve/separable/term_row.h"
#include "solve/spectral/coarse_grid.h"
#include "solve/spectral/kernel_spectra.h"
#include "solve/spectral/padded_plane.h"

namespace beamspread {

// Units of progress that the choice of terms and the solution advance by. Both take about as long for a lamp on
// 512 x 512 texels.
inline constexpr double choice_work = 1.0;
inline constexpr double spread_work = 1.0;

// Light on a plane and its luminance. The plane is padded so that light that leaves it does not come back.
class SpectralField {
public:
    // Chooses the terms. The arrays of `problem.lights` must outlive the field; those of `problem.coming` need not.
    SpectralField(const Problem& problem, Progress& progress);

    // Adds rays of coming light, see `MomentSum`. Several threads may add rays of different rows at once.
    void add(const RayRow& rays, const std::vector<double>& color, bool is_colored);

    // Writes (height, width, channels) in W/(m^2 sr).
    void solve(Progress& progress, float* luminance);

    // Removes the light that was added; terms and kernels stay.
    void clear();

    // Number of terms. The time to solve grows in proportion.
    std::size_t terms() const { return m_terms.terms.size(); }

private:
    // Luminance beyond the reach of the texels' kernels, in the scale of the texels' sums before their factor.
    struct CoarseLuminance {
        CoarseGrid grid;
        std::vector<std::vector<float>> nodes;  // [result]
    };

    CoarseLuminance solve_coarse(const Level& level, Progress& progress, double work);
    void store_row(std::size_t result, const RowSpan& span, const float* values, double factor, float* luminance) const;

    Problem m_problem;
    LightTerms m_terms;
    Levels m_levels;
    std::optional<KernelSpectra> m_spectra;  // of the texels; empty until the first solution
    std::optional<KernelSpectra> m_coarse_spectra;
    PerThread<MomentSum> m_sums;
    PerThread<CoarseGrid::Scratch> m_scratch;
};

// Number of terms of `problem`.
std::size_t count_terms(const Problem& problem, Progress& progress);

}  // namespace beamspread
