// The fft solver: the direct solver's sums as products of spectra.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "base/progress.h"
#include "solve/problem/problem.h"
#include "solve/separable/term_row.h"

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
    ~SpectralField();
    SpectralField(const SpectralField&) = delete;
    SpectralField& operator=(const SpectralField&) = delete;

    // Adds light to that to come, see `MomentSum`. Rays of different rows may be added at the same time.
    void add(const PlaneLight& light);
    void add(const RayBeams& rays, const std::vector<double>& color, bool is_colored);

    // Writes (height, width, channels) in W/(m^2 sr).
    void solve(Progress& progress, float* luminance);

    // Forgets the light that was added, and keeps what does not depend on it.
    void clear();

    // How many there are; what is solved costs in proportion to them.
    std::size_t terms() const;

private:
    class Solver;
    std::unique_ptr<Solver> m_solver;
};

void solve_spectral(const Problem& problem, Progress& progress, float* luminance);

// How many terms `problem` has.
std::size_t count_terms(const Problem& problem, Progress& progress);

}  // namespace beamspread
