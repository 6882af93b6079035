#include "solve/solve.h"

#include <algorithm>
#include <vector>

#include "base/threads.h"
#include "solve/adaptive/adaptive.h"
#include "solve/direct/direct.h"
#include "solve/problem/channel_sets.h"
#include "solve/spectral/spectral.h"
#include "solve/unscattered.h"

namespace beamspread {

namespace {

// Light after light and medium after medium, for the solvers that share no work among them.
template <class SolveLight>
void solve_apart(const Problem& problem, Progress& progress, float* luminance, const SolveLight& solve_light)
{
    const std::size_t channels = problem.channels.size();
    const std::vector<ChannelMedium> media = ChannelSets(problem).media;
    std::fill_n(luminance, problem.plane.texels() * channels, 0.0f);
    progress.set_total(static_cast<double>(problem.lights.size() * media.size()));
    for (const PlaneLight& light : problem.lights)
        for (const ChannelMedium& medium : media) {
            const std::vector<float> radiance = solve_light(light, medium);
            for (std::size_t c = 0; c < channels; ++c)
                for (std::size_t i = 0; i < radiance.size() && problem.channels[c] == medium; ++i)
                    luminance[i * channels + c] += static_cast<float>(light.color[c]) * radiance[i];
        }
}

}  // namespace

void solve(const Problem& problem, Progress& progress, float* luminance)
{
    with_threads(problem.threads, [&] {
        validate(problem);
        switch (problem.solver) {
            case Solver::fft:
                solve_spectral(problem, progress, luminance);
                break;
            case Solver::direct:
                solve_apart(problem, progress, luminance, [&](const PlaneLight& light, const ChannelMedium& medium) {
                    return solve_direct(problem.plane, light, medium, progress);
                });
                break;
            case Solver::adaptive:
                solve_apart(problem, progress, luminance, [&](const PlaneLight& light, const ChannelMedium& medium) {
                    return solve_adaptive(problem.plane, light, medium, problem.tolerance, progress);
                });
                break;
        }
        add_unscattered(problem, luminance);
    });
    progress.finish();
}

}  // namespace beamspread
