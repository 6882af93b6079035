// Light on a plane and the luminance that it causes, by the solver `fft`, in memory that does not grow with the light.
#pragma once

#include <memory>
#include <optional>

#include "base/progress.h"
#include "solve/spectral/spectral.h"
#include "solve/unscattered.h"

namespace beamspread {

class LightField {
public:
    // Chooses terms and advances the progress by `choice_work`. The arrays of `problem.lights` must outlive the field. Throws
    // InvalidArgument, MemoryLimit, Cancelled.
    LightField(const Problem& problem, Progress& progress);

    // Adds rays of the coming light of the problem: they are reduced to moments at once and not stored. `color` and
    // `is_colored` as for `MomentSum`. Several threads may add rays of different rows at once.
    void add(const RayRow& rays, const std::vector<double>& color, bool is_colored);

    // Writes (height, width, channels), radiance in W/(m^2 sr): the sum over all lights and rays. Advances the progress by
    // `spread_work`. Throws Cancelled.
    void solve(Progress& progress, float* luminance);

    // Removes the rays that were added; terms and kernels stay.
    void clear();

    const Plane& plane() const { return m_problem.plane; }
    std::size_t channels() const { return m_problem.channels.size(); }
    std::size_t terms() const { return m_field->terms(); }

private:
    Problem m_problem;
    std::unique_ptr<SpectralField> m_field;
    std::optional<UnscatteredRays> m_unscattered;  // of rays; empty: none return unscattered
};

}  // namespace beamspread
