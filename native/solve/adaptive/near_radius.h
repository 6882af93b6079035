// How near to a beam it must be seen as finely as it is: a bound, and what is tried on the light itself.
#pragma once

#include <vector>

#include "base/progress.h"
#include "ldf/radial/radial_profile.h"
#include "solve/adaptive/even_squares.h"
#include "solve/separable/light_terms.h"

namespace beamspread {

// Beams of about one angle.
struct AngleLight {
    RadialProfile profile;
    double power = 0.0;
};

// The near radius in points of a level's grid by which the absolute errors of a multilevel sum, of all beams in all texels,
// add up to at most the fraction `allowed` of the light that comes back within a distance. Lengths in mean free paths.
double near_radius(const std::vector<AngleLight>& lights, double pitch, double distance, double allowed,
                   Progress& progress);

// A near radius of at most `bound`. A bound adds up all errors as if they had one sign, while they have either and mostly
// cancel. So smaller radii are tried on the light itself, at some blocks of texels: the least is taken by which the radiance
// of each block differs from what it is by a larger radius by at most `allowed`, in the mean and relative to its own.
//
// Measured, not bound: elsewhere errors may be larger. With a quarter of the tolerance allowed, all errors summed up to .08 of
// the tolerance at most, and the worst texel was off by .34 of it, beside the brightest: lamps at a 50th to a fifth of the
// width, suns at 70 and 85 degrees, whole, half, at random and in patterns, on 256 x 256 and 512 x 512 texels.
//
// `squares` are those of the light, of which `wide` are left out. Lengths in mean free paths.
double tried_radius(const LightTerms& terms, const PlaneLight& light, const std::vector<Square>& squares,
                    const std::vector<Square>& wide, double pitch_y, double pitch_x, double bound, double allowed,
                    Progress& progress);

}  // namespace beamspread
