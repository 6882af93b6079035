// Poles: the points that radius and azimuth of exits are measured around.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "medium/medium.h"
#include "transport/tally/bins.h"

namespace beamspread {

enum class Side : std::size_t { reflected = 0, transmitted = 1 };
inline constexpr std::size_t side_count = 2;

// Light that leaves after few scatterings peaks, as 1 / r and sharper, at the beam's entry and exit, and in a slab also
// around the beam's mirror images in the boundaries. Harmonics around one of these points do not resolve another, and
// interpolation between angles fails because the images move. Each side therefore has several poles along the beam: its
// entry (or first exit on the far side), and its next exits.

// Largest number of reflections that an exit distinguishes. Reflections count while they follow the beam's order: the
// far boundary first, then in turn.
inline constexpr std::uint32_t max_reflections = 2 * (pole_count - 1);

inline constexpr std::uint32_t reflections_after(std::uint32_t reflections, bool at_far_boundary)
{
    const bool as_the_beam = at_far_boundary == (reflections % 2 == 0);
    return as_the_beam && reflections < max_reflections ? reflections + 1 : reflections;
}

// Pole of light after these reflections: the beam's latest exit. Later exits have no sharp light of it.
inline constexpr std::size_t pole_of(std::uint32_t reflections, Side side)
{
    return (reflections + (side == Side::reflected ? 1 : 0)) / 2;
}

// u of each pole, [side][pole], mean free paths.
using PolePositions = std::array<std::array<double, pole_count>, side_count>;
PolePositions pole_positions(const Medium& medium, double theta_inside);

// Number of scattering orders, from 0, that are tallied around their own poles; higher orders are tallied around the
// first. 0: the medium shows no mirror images.
std::uint32_t mirrored_orders(const Medium& medium);

}  // namespace beamspread
