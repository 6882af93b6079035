// What Python hands to the solvers, as a problem of theirs.
#pragma once

#include <memory>
#include <vector>

#include "python/casters.h"
#include "solve/problem/problem.h"

namespace beamspread {

// A light and the arrays that it looks at.
struct HeldLight {
    PlaneLight light;
    std::vector<py::object> arrays;
};

using Lights = std::vector<const HeldLight*>;
using Sources = std::vector<std::shared_ptr<LdfSource>>;

// On no plane yet; looks at the lights and the sources. Throws InvalidArgument where they don't fit together.
Problem problem_of(const Lights& lights, const Sources& ldf, const std::vector<double>& albedo,
                   const std::vector<double>& mean_free_path, double tolerance);

}  // namespace beamspread
