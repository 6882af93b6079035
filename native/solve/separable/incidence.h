// Distribution of the angles of incidence of a plane's light.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "solve/problem/problem.h"

namespace beamspread {

// Angles are tan(theta / 2), in which LDFs are smooth everywhere.
struct Incidence {
    // Texels where a light is brightest, steepest and most grazing.
    struct Extremes {
        Texel brightest{};
        Texel steepest{};
        Texel most_grazing{};
        double irradiance = 0.0;  // of the brightest texel, over all channels; 0: all texels are dark
        float min_angle = 1.0f;
        float max_angle = 0.0f;
    };

    // Number of angles at which kernels are compared. More: more memory and time, hardly other terms.
    static constexpr std::size_t count = 64;
    double first = 1.0;  // larger than `last` if no texel is lit
    double last = 0.0;
    // Share of `count` even angles from first to last, with the sum 1: the mean of the shares of light, of lit beams
    // and of angles. Each present angle counts at the four around it, hence a basis for these serves the angles between
    // them.
    std::array<double, count> share{};
    std::vector<Extremes> extremes;  // [light], without coming light

    Incidence(const Plane& plane, const std::vector<PlaneLight>& lights, const ComingLight& coming = {});

    bool none() const { return first > last; }

private:
    // Extends the range to the extremes of some lights, and by a margin.
    void extend(const std::vector<Extremes>& lights, double margin);
};

double angle_deg(double half_tangent);

}  // namespace beamspread
