// Angles of incidence that occur in the light of a plane.
#pragma once

#include <array>
#include <cstddef>

#include "solve/separable/angle_counts.h"

namespace beamspread {

// Angles as tan(theta / 2), as they are counted.
struct PresentAngles {
    static constexpr std::size_t count = 64;
    double first = 1.0;  // beyond `last`: nothing is lit
    double last = 0.0;
    // At `count` angles evenly from first to last, sum 1: mean of those of light, of lit texels and of angles. Each angle
    // that occurs counts at the four around it, so that a basis for these holds what is between them.
    std::array<double, count> share{};

    explicit PresentAngles(const AngleCounts& counts);

    bool none() const { return first > last; }
};

double angle_deg(double half_tangent);

}  // namespace beamspread
