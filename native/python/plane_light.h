// Light on a plane, as Python holds it.
#pragma once

#include <vector>

#include "python/casters.h"
#include "solve/problem/light.h"

namespace beamspread {

// A light and the arrays that it looks at.
struct HeldLight {
    PlaneLight light;
    std::vector<py::object> arrays;
};

}  // namespace beamspread
