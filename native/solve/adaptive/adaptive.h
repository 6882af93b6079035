// The adaptive solver: beams of different widths (Manabe et al. 2012, Sec. 3.3, Fig. 5).
#pragma once

#include <cstddef>
#include <vector>

#include "base/progress.h"
#include "ldf/radial/radial_profile.h"
#include "solve/adaptive/multilevel_sum.h"
#include "solve/problem/problem.h"
#include "solve/separable/light_terms.h"

namespace beamspread {

// Texels y .. y + size - 1, x .. x + size - 1, lit by one beam of that width.
struct Square {
    std::size_t y = 0;
    std::size_t x = 0;
    std::size_t size = 1;
    double irradiance = 0.0;  // mean of its texels, W/m^2
};

// The largest squares of 2^k texels that are fully lit and even: each texel's irradiance is within `tolerance` times
// itself of the square's mean, and directions differ by at most 1/20 of the tolerance, with which kernels of up to
// eight azimuthal harmonics differ by less than the tolerance. The paper has binary masks; evenness extends them to
// varying light. Lit texels in no larger square are squares of size one. The outside of the plane counts as dark.
std::vector<Square> even_squares(const Plane& plane, const PlaneLight& light, double tolerance);

// Moves the light of squares out of `light` and returns it as steps at their corners. A square is the sum of four
// steps; each lights everything above and to the right of a corner. Steps of adjacent squares of the same light cancel.
Grid take_steps(Grid& light, const std::vector<Square>& squares);

// Kernel of a step: the sums of a kernel over all offsets below and to the left, for offsets from the corner
// (summed-area table: Crow 1984, doi:10.1145/800031.808600).
KernelTable step_kernel(const Grid& kernel);

class KernelIntegrals;

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
double tried_radius(const LightTerms& terms, std::vector<KernelIntegrals>& integrals, const PlaneLight& light,
                    const std::vector<Square>& squares, const std::vector<Square>& wide, double pitch_y, double pitch_x,
                    double bound, double allowed, Progress& progress);

// Squares that `solve_adaptive` lights by one beam each, within their fraction of the tolerance.
std::vector<Square> beam_squares(const Plane& plane, const PlaneLight& light, double tolerance);

// Exitance of one medium under a light of colour 1, W/m^2, row by row. Advances the progress by 1.
std::vector<double> solve_adaptive(const Plane& plane, const PlaneLight& light, const ChannelMedium& medium,
                                   double tolerance, Progress& progress);

}  // namespace beamspread
