// Random walks of photons through a medium.
#pragma once

#include <array>
#include <cstdint>

#include "base/random.h"
#include "medium/medium.h"
#include "transport/tally.h"

namespace beamspread {

using SideTallies = std::array<Tally, side_count>;

// Walks one photon that has entered at O, travelling at theta_inside (radians) from the inward normal
// toward +u, and adds its *expected* exits after at least one scattering to the tallies. Unscattered
// light is left out: it has a closed form (transport/ballistic.h).
void walk_photon(const Medium& medium, double theta_inside, Random& random, SideTallies& tallies);

}  // namespace beamspread
