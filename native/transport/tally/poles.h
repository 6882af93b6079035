// Around which places light that leaves is counted.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "medium/medium.h"
#include "transport/tally/bins.h"

namespace beamspread {

enum class Side : std::size_t { reflected = 0, transmitted = 1 };
inline constexpr std::size_t side_count = 2;

// Light that leaves after few scatterings peaks, as 1 / r and sharper, where the beam enters or leaves, and in a slab
// also around the beam's mirror images in the boundaries. Harmonics around one of these places don't resolve another,
// nor do distributions at two angles tell what is between them, as the images move. Hence the poles of each side, along
// the beam: where it enters, or leaves the far side first, and where it leaves next and after that.

// How far along the beam light has come, be it scattered or not: of the boundaries that the beam is reflected by, the
// far one first, how many have reflected it in their order. More than this many are not told apart.
inline constexpr std::uint32_t most_reflections = 2 * (pole_count - 1);

inline constexpr std::uint32_t reflections_after(std::uint32_t reflections, bool at_far_boundary)
{
    const bool as_the_beam = at_far_boundary == (reflections % 2 == 0);
    return as_the_beam && reflections < most_reflections ? reflections + 1 : reflections;
}

// The last exit of the beam that light after these reflections may be around. Before it there is nothing sharp.
inline constexpr std::size_t pole_of(std::uint32_t reflections, Side side)
{
    return (reflections + (side == Side::reflected ? 1 : 0)) / 2;
}

// u of the poles of both sides, [side][pole], mean free paths.
using PolePlaces = std::array<std::array<double, pole_count>, side_count>;
PolePlaces pole_places(const Medium& medium, double theta_inside);

// Light of this many orders, from 0 on, is counted around the pole that it belongs to; of more, around the first. 0:
// the medium shows no images.
std::uint32_t mirrored_orders(const Medium& medium);

}  // namespace beamspread
