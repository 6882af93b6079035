#include "solve/solve.h"

#include <algorithm>
#include <vector>

#include "base/constants.h"
#include "base/threads.h"
#include "solve/adaptive/adaptive.h"
#include "solve/direct/direct.h"
#include "solve/problem/problem.h"
#include "solve/problem/unscattered.h"
#include "solve/spectral/light_field.h"

namespace beamspread {

namespace {

// Each light over each medium alone, by solvers that share no work among them.
void solve_apart(const Problem& problem, Progress& progress, float* luminance)
{
    const std::size_t channels = problem.channels.size();
    const std::vector<ChannelMedium> media = ChannelSets(problem).media;
    std::fill_n(luminance, problem.plane.texels() * channels, 0.0f);
    progress.set_total(static_cast<double>(problem.lights.size() * media.size()));
    for (const PlaneLight& light : problem.lights)
        for (const ChannelMedium& medium : media) {
            const std::vector<double> exitance =
                problem.solver == Solver::direct
                    ? solve_direct(problem.plane, light, medium, progress)
                    : solve_adaptive(problem.plane, light, medium, problem.tolerance, progress);
            for (std::size_t c = 0; c < channels; ++c)
                for (std::size_t i = 0; i < exitance.size() && problem.channels[c] == medium; ++i)
                    luminance[i * channels + c] +=
                        static_cast<float>(light.color[c]) * static_cast<float>(inv_pi * exitance[i]);
        }
}

}  // namespace

void solve(const Problem& problem, Progress& progress, float* luminance)
{
    if (problem.solver == Solver::fft) {
        progress.set_total(choice_work + spread_work);
        LightField(problem, progress).solve(progress, luminance);
    } else {
        with_threads(problem.threads, [&] {
            validate(problem);
            solve_apart(problem, progress, luminance);
            add_unscattered(problem, luminance);
        });
    }
    clip_negative(luminance, problem.plane.texels() * problem.channels.size());
    progress.finish();
}

}  // namespace beamspread
