// Radius around a beam within which it is evaluated at full resolution: an upper bound, and a smaller one found by
// trial.
#pragma once

#include <vector>

#include "base/progress.h"
#include "ldf/radial/radial_profile.h"
#include "solve/adaptive/even_squares.h"
#include "solve/separable/light_terms.h"

namespace beamspread {

// Beams of about the same angle.
struct AngleLight {
    RadialProfile profile;
    double power = 0.0;
};

// Upper bound of the near radius, in points of a level's grid: the absolute errors of a multilevel sum, over all beams
// and texels, add up to at most the fraction `allowed` of the light that returns within a distance. Lengths are in mean
// free paths.
double near_radius(const std::vector<AngleLight>& lights, double pitch, double distance, double allowed,
                   Progress& progress);

// A near radius of at most `bound`, by trial. The bound adds up errors as if they had one sign, but they mostly cancel.
// Smaller radii are tried on the light at some blocks of texels; the result is the smallest radius with which each
// block's radiance differs from that of a larger radius by at most `allowed`, in the mean and relative to the radiance.
// Errors at other texels may be larger (docs/tuning.md, "`trial_radii`").
//
// `squares` are those of the light, without the `wide` ones. Lengths are in mean free paths.
double tried_radius(const LightTerms& terms, const PlaneLight& light, const std::vector<Square>& squares,
                    const std::vector<Square>& wide, double pitch_y, double pitch_x, double bound, double allowed,
                    Progress& progress);

}  // namespace beamspread
