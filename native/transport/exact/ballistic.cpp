#include "transport/exact/exact_totals.h"

#include <cmath>

#include "medium/medium.h"

namespace beamspread {

namespace {

// One crossing of the slab: Beer-Lambert transmission along the slanted path and Fresnel reflectance at its end.
struct Pass {
    double transmission;  // fraction that reaches the end
    double reflectance;   // from inside, the same at both boundaries
};

Pass single_pass(const Medium& medium, double theta_inside)
{
    const double cos_theta = std::cos(theta_inside);
    return {std::exp(-medium.thickness / cos_theta), fresnel(cos_theta, 1.0 / medium.ior)};
}

}  // namespace

std::vector<BallisticExit> ballistic_exits(const Medium& medium, double theta_inside, Side side)
{
    std::vector<BallisticExit> exits;
    if (medium.is_half_space())
        return exits;
    const Pass pass = single_pass(medium, theta_inside);
    const double step = medium.thickness * std::tan(theta_inside);
    double inside = 1.0;
    for (int crossings = 1; inside > 1e-9; ++crossings) {
        inside *= pass.transmission;
        if ((crossings % 2 == 1) == (side == Side::transmitted) && inside * (1.0 - pass.reflectance) > 0.0)
            exits.push_back({crossings * step, inside * (1.0 - pass.reflectance)});
        inside *= pass.reflectance;
    }
    return exits;
}

double ballistic_total(const Medium& medium, double theta_inside, Side side)
{
    if (medium.is_half_space())
        return 0.0;
    const Pass pass = single_pass(medium, theta_inside);
    const double round_trip = pass.reflectance * pass.transmission;
    const double transmitted = pass.transmission * (1.0 - pass.reflectance) / (1.0 - round_trip * round_trip);
    return side == Side::transmitted ? transmitted : transmitted * round_trip;
}

}  // namespace beamspread
