// Helpers for the checks of arguments in this folder.
#pragma once

#include <cmath>
#include <string>

#include "base/vec.h"

namespace beamspread::detail {

inline bool is_finite(const Vec3& v)
{
    return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

inline std::string to_text(const Vec3& v)
{
    return "(" + std::to_string(v.x) + ", " + std::to_string(v.y) + ", " + std::to_string(v.z) + ")";
}

}  // namespace beamspread::detail
