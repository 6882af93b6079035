// Angles of incidence that occur in the light of a plane.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "base/view.h"
#include "solve/problem.h"

namespace beamspread {

// Light of one source on the plane.
struct LightField {
    View2D<const float> irradiance;
    Directions directions;
};

// Angles as tan(theta / 2), which needs no trigonometry and in which LDFs are smooth everywhere.
struct PresentAngles {
    static constexpr std::size_t bins = 64;
    double first = 1.0;  // beyond `last`: nothing is lit
    double last = 0.0;
    std::array<double, bins> share{};  // in even bins between them, sum 1: mean of those
                                       // of light, of lit texels and of angles

    explicit PresentAngles(const std::vector<LightField>& lights);

    bool none() const { return first > last; }
};

double angle_deg(double half_tangent);

}  // namespace beamspread
