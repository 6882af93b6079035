// Angles of incidence that occur in the light of a plane.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "solve/problem/problem.h"

namespace beamspread {

// All angles are tan(theta / 2), in which LDFs are smooth everywhere.
struct Incidence {
    // Where a light is brightest, steepest and most grazing: angles that few texels have are easily missed.
    struct Extremes {
        Texel brightest{};
        Texel steepest{};
        Texel most_grazing{};
        double irradiance = 0.0;  // of the brightest, over all channels; 0: all is dark
        float least = 1.0f;
        float greatest = 0.0f;
    };

    // Half as many ask for 3 % fewer to 10 % more terms, twice as many for 3 % fewer or more; errors are no larger with
    // either.
    static constexpr std::size_t count = 64;
    double first = 1.0;  // beyond `last`: nothing is lit
    double last = 0.0;
    // At `count` angles evenly from first to last, sum 1: the mean of the shares of light, of lit beams and of angles.
    // Each angle that occurs counts at the four around it, so that a basis for these holds what is between them.
    std::array<double, count> share{};
    std::vector<Extremes> extremes;  // [light], not of those to come

    Incidence(const Plane& plane, const std::vector<PlaneLight>& lights, const ComingLight& coming = {});

    bool none() const { return first > last; }

private:
    // Reaches over what was found and so much beyond.
    void extend(const std::vector<Extremes>& found, double margin);
};

double angle_deg(double half_tangent);

}  // namespace beamspread
