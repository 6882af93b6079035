// A spot lamp's cone from Python's arguments.
#pragma once

#include "python/vectors.h"
#include "scene/spot_cone.h"

namespace beamspread {

// Throws InvalidArgument.
inline SpotCone to_spot_cone(const Numbers& frame, double spot_size, double blend, const std::string& falloff)
{
    const auto kind =
        named<SpotFalloff>("falloff", falloff, {{"scaled", SpotFalloff::scaled}, {"legacy", SpotFalloff::legacy}});
    return {to_axes("frame", frame), spot_size, blend, kind};
}

}  // namespace beamspread
