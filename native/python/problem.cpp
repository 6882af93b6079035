#include "python/problem.h"

#include "base/error.h"

namespace beamspread {

Problem problem_of(const Lights& lights, const Sources& ldf, const std::vector<double>& albedo,
                   const std::vector<double>& mean_free_path, double tolerance)
{
    const std::size_t channels = albedo.size();
    if (ldf.size() != channels || mean_free_path.size() != channels)
        reject("ldf", "of another number of channels than albedo", "one per channel");
    Problem problem;
    problem.tolerance = tolerance;
    for (const HeldLight* held : lights)
        problem.lights.push_back(held->light);
    for (std::size_t c = 0; c < channels; ++c)
        problem.channels.push_back({ldf[c].get(), albedo[c], mean_free_path[c]});
    return problem;
}

}  // namespace beamspread
