// A homogeneous, plane-parallel, dimensionless medium: lengths are in mean free paths.
#pragma once

#include <limits>

namespace beamspread {

struct Medium {
    double g = 0.8;    // Henyey-Greenstein anisotropy, in [-0.99, 0.99]
    double ior = 1.0;  // refractive index inside over outside, in [1, 3]
    double thickness = std::numeric_limits<double>::infinity();  // in mean free paths; infinite: half-space

    bool is_half_space() const { return thickness == std::numeric_limits<double>::infinity(); }

    friend bool operator==(const Medium&, const Medium&) = default;
};

// Throws InvalidArgument for a medium that the simulation does not cover.
void validate(const Medium& medium);

// Throws InvalidArgument unless the single-scattering albedo is in [0, 1).
void check_albedo(double albedo);

}  // namespace beamspread
