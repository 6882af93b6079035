// Profiles around another pole.
#pragma once

#include "ldf/radial/radial_profile.h"

namespace beamspread {

// The same distribution around (centre, 0), as far as harmonics and finer edges there tell: a peak at the old pole is
// blurred as fading harmonics do.
RadialProfile recentred(const RadialProfile& profile, double centre);

}  // namespace beamspread
