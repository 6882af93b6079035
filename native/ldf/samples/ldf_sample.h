// One LDF as an image, from a library or from the file of another simulator.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <vector>

#include "base/vec.h"

namespace beamspread {

inline constexpr std::size_t max_sample_side = 16384;

// Lengths are in mean free paths. The beam travels toward +u; O, where its axis enters, is the centre of the image.
struct LdfSample {
    std::size_t width = 0;
    std::size_t height = 0;
    std::vector<float> image;  // mean exitance of each texel per unit incident power, 1/mfp^2; rows v upward, columns u
    double pitch = 1.0;  // side of a texel
    double angle_deg = 0.0;  // of incidence
    double albedo = 0.0;  // of single scattering
    double beam_diameter = 0.0;  // of the disk that the beam lights on the surface; 0: a pencil beam
    std::optional<double> g;  // anisotropy of the medium, if known

    float at(std::size_t y, std::size_t x) const { return image[y * width + x]; }

    // Coordinates of a texel's centre.
    double u(std::size_t x) const { return (static_cast<double>(x) + 0.5 - 0.5 * static_cast<double>(width)) * pitch; }
    double v(std::size_t y) const { return (static_cast<double>(y) + 0.5 - 0.5 * static_cast<double>(height)) * pitch; }

    // Power that leaves within the image, per unit power incident.
    double power() const;
};

// Exitance at a point (u, v): bilinear between the centres of texels, constant outside, as an LDF does not end with its
// image.
double exitance_at(const LdfSample& sample, const Vec2& point);

// Throws InvalidArgument unless the exitance is finite and not negative. Undershoots of up to 10 % of the brightest
// texel are allowed: truncated harmonics (`ldf_image`) and denoised simulations have them.
void validate(const LdfSample& sample);

// Write and read a one-part OpenEXR file; sample_file.cpp describes the layout. Throw IoError.
void save_sample(const LdfSample& sample, const std::filesystem::path& path);
LdfSample load_sample(const std::filesystem::path& path);

}  // namespace beamspread
