// What Python hands to the solvers, as a problem of theirs.
#pragma once

#include <memory>
#include <vector>

#include "python/plane_light.h"
#include "solve/problem/problem.h"

namespace beamspread {

using Lights = std::vector<const HeldLight*>;
using Sources = std::vector<std::shared_ptr<LdfSource>>;

// On no plane yet; looks at the lights and the sources. Throws InvalidArgument where they don't fit together.
Problem problem_of(const Lights& lights, const Sources& ldf, const std::vector<double>& albedo,
                   const std::vector<double>& mean_free_path, double tolerance);

}  // namespace beamspread
