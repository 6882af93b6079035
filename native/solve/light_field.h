// Luminance of light that comes bit by bit, in memory that does not grow with it.
#pragma once

#include <vector>

#include "base/progress.h"
#include "solve/spectral/spectral.h"
#include "solve/unscattered.h"

namespace beamspread {

// By the fft solver. What is added is gone once it is: what the medium needs to know of it are a few moments.
class LightField {
public:
    // `problem.lights` of one direction are kept as they are. Other ones, and a survey of the light to come, only tell
    // how exactly what will be added is to be kept; with a survey alone, any light of its angles. Throws
    // InvalidArgument, Cancelled.
    LightField(const Problem& problem, Progress& progress);

    void add(const PlaneLight& light);

    // Of rows that no other thread adds to.
    void add(const RayBeams& rays, const std::vector<double>& color, bool is_colored);

    // Writes (height, width, channels), radiance in W/(m^2 sr).
    void solve(Progress& progress, float* luminance);

    // Forgets what was added; terms and kernels stay for the light that comes next.
    void clear();

    const Problem& problem() const { return m_problem; }
    std::size_t terms() const { return m_field.terms(); }

private:
    Problem m_problem;
    SpectralField m_field;
    std::vector<float> m_unscattered;  // of lights that are not kept; empty: none of any
    UnscatteredRays m_unscattered_rays;
};

}  // namespace beamspread
