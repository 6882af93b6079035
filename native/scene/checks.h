// Checks of arguments in this folder.
#pragma once

#include <cmath>
#include <sstream>
#include <string>

#include "base/constants.h"
#include "base/error.h"
#include "base/vec.h"

namespace beamspread::detail {

// Largest angle, radians: hosts with angles in single precision round pi up.
inline constexpr double max_angle = static_cast<double>(static_cast<float>(pi));

inline bool is_finite(const Vec3& v)
{
    return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

inline std::string to_text(const Vec3& v)
{
    std::ostringstream text;
    text << "(" << v.x << ", " << v.y << ", " << v.z << ")";
    return text.str();
}

// All functions below throw InvalidArgument.
inline void check_finite(const char* name, const Vec3& v, const char* allowed = "finite coordinates in metres")
{
    if (!is_finite(v))
        reject(name, to_text(v), allowed);
}

inline void check_length(const char* name, double length, const char* allowed = "a finite length >= 0 in metres")
{
    if (!(length >= 0.0) || std::isinf(length))
        reject(name, length, allowed);
}

inline void check_index(const char* name, std::size_t index, const char* of, std::size_t count)
{
    if (index >= count)
        reject(name, std::to_string(index),
               std::string("indices below the number of ") + of + ", " + std::to_string(count));
}

inline Vec3 unit_vector(const char* name, const Vec3& direction)
{
    const Vec3 unit = glm::normalize(direction);
    if (!is_finite(unit))
        reject(name, to_text(direction), "a finite vector that is not 0");
    return unit;
}

}  // namespace beamspread::detail
