#include "transport/tally/tally.h"

#include <cmath>

namespace beamspread {

namespace {

// Smooth minimum of two lengths, for splines over the angle of incidence.
double smooth_minimum(double a, double b, double sharpness)
{
    return std::pow(std::pow(a, -sharpness) + std::pow(b, -sharpness), -1.0 / sharpness);
}

// Path to the far side's first pole. The distribution there peaks at the beam's exit if the slab is thinner than two
// mean free paths and two transport mean free paths; in thicker slabs it is broad and its centre stays behind.
double first_path_across(const Medium& medium, double across)
{
    return smooth_minimum(across, 2.0 + 2.0 / (1.0 - medium.g), 4.0);
}

// Path to a mirror image. Light that leaves farther along the beam has lost the beam's direction.
double path_to_image(const Medium& medium, double path)
{
    return smooth_minimum(path, 6.0 + 2.0 / (1.0 - medium.g), 8.0);
}

}  // namespace

PolePositions pole_positions(const Medium& medium, double theta_inside)
{
    if (medium.is_half_space())
        return {};
    const double across = medium.thickness / std::cos(theta_inside);
    const double u = std::sin(theta_inside);  // per path
    PolePositions places{};
    places[1][0] = u * first_path_across(medium, across);
    for (std::size_t pole = 1; pole < pole_count; ++pole)
        for (std::size_t side = 0; side < side_count; ++side)
            places[side][pole] = u * path_to_image(medium, static_cast<double>(2 * pole + side) * across);
    return places;
}

std::uint32_t mirrored_orders(const Medium& medium)
{
    // Thickness in mean free paths up to which mirror images get poles. Larger: smaller errors, larger files, more
    // time.
    constexpr double max_thickness = 4.0;
    return medium.ior > 1.0 && medium.thickness <= max_thickness ? sharp_orders : 0;
}

}  // namespace beamspread
