// The fft solver: the direct solver's sums as products of spectra.
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

// What it takes of a progress to choose terms, and to solve: about the same for a lamp on 512 x 512 texels.
inline constexpr double choice_work = 1.0;
inline constexpr double spread_work = 1.0;

// Light on a plane, and what becomes of it. Padded so that light that leaves the plane does not come back.
class SpectralField {
public:
    // Chooses the terms. `problem.lights` are kept; with light to come only those of one direction are, see
    // `light_terms`. What they look at must outlive the field.
    SpectralField(const Problem& problem, Progress& progress);

    // Adds light to that to come, see `MomentSum`. Rays of different rows may be added at the same time.
    void add(const PlaneLight& light);
    void add(const RayBeams& rays, const std::vector<double>& color, bool is_colored);

    // Writes (height, width, channels) in W/(m^2 sr).
    void solve(Progress& progress, float* luminance);

    // Forgets the light that was added, and keeps what does not depend on it.
    void clear();

    // How many there are; what is solved costs in proportion to them.
    std::size_t terms() const { return m_terms.terms.size(); }

private:
    // What light does beyond the reach of the texels' kernels, in the scale of the texels' sums before their own
    // factor.
    struct CoarseLuminance {
        CoarseGrid grid;
        std::vector<std::vector<float>> nodes;  // [result]
    };

    CoarseLuminance solve_coarse(const Level& level, Progress& progress, double work);
    void store_row(std::size_t result, const RowSpan& span, const float* values, double factor, float* luminance) const;

    Problem m_problem;
    LightTerms m_terms;
    Levels m_levels;
    std::optional<KernelSpectra> m_spectra;  // of the texels, kept for the next time
    std::optional<KernelSpectra> m_coarse_spectra;
    PerThread<MomentSum> m_sums;
    PerThread<CoarseGrid::Scratch> m_scratch;
};

void solve_spectral(const Problem& problem, Progress& progress, float* luminance);

// How many terms `problem` has.
std::size_t count_terms(const Problem& problem, Progress& progress);

}  // namespace beamspread
