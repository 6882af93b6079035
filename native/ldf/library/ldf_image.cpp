#include "ldf/library/ldf_library.h"

#include <algorithm>
#include <cmath>

#include "base/constants.h"
#include "base/error.h"
#include "ldf/radial/radial_function.h"

namespace beamspread {

namespace {

// Limits of images of disks, beyond which differences of large integrals lose .1 % of a texel to rounding.
constexpr double min_disk_pitch = 1e-4;         // mean free paths
constexpr double max_disk_diameter = 1e6;       // mean free paths
constexpr double max_disk_diameter_texels = 1e4;

// True if a disk is too small to spread a texel's light by more than rounding.
bool is_point(double beam_diameter, double pitch)
{
    return beam_diameter < 1e-5 * pitch;
}

// Adds a delta function at (u, 0). Texels share it if it lies on their border.
void add_delta(std::vector<double>& texels, std::size_t size, double pitch, const BallisticExit& delta)
{
    const double half = 0.5 * static_cast<double>(size);
    const double column = delta.u / pitch + half;
    const double nearest_border = std::round(column);
    const bool on_border = std::abs(column - nearest_border) < 1e-9 * half;
    const double left = on_border ? nearest_border - 1.0 : std::floor(column);
    const double right = on_border ? nearest_border : left;
    const std::size_t above = size / 2;
    const std::size_t below = size % 2 == 0 ? above - 1 : above;
    for (double c : {left, right}) {
        if (c < 0.0 || c >= static_cast<double>(size))
            continue;
        for (std::size_t row : {below, above})
            texels[row * size + static_cast<std::size_t>(c)] += 0.25 * delta.power;
    }
}

void check_grid(std::size_t size, double pitch, double beam_diameter)
{
    if (size < 1 || size > 16384)
        reject("size", static_cast<double>(size), "1 <= size <= 16384 texels");
    check_pitch(pitch);
    if (!(beam_diameter >= 0.0 && std::isfinite(beam_diameter)))
        reject("beam_diameter", beam_diameter, "beam_diameter >= 0 mean free paths");
    if (is_point(beam_diameter, pitch))
        return;
    if (pitch < min_disk_pitch)
        reject("pitch", pitch, "pitch >= 1e-4 mean free paths for a beam with a diameter");
    if (beam_diameter > std::min(max_disk_diameter, max_disk_diameter_texels * pitch))
        reject("beam_diameter", beam_diameter, "up to 1e6 mean free paths and 1e4 texels");
}

// Adds an even disk of light around (u, 0).
void add_disk(std::vector<double>& texels, std::size_t size, double pitch, const BallisticExit& centre, double radius)
{
    const double corner = -0.5 * static_cast<double>(size) * pitch;
    const double density = centre.power / (pi * radius * radius);
    for (std::size_t row = 0; row < size; ++row) {
        const double y = corner + static_cast<double>(row) * pitch;
        if (y > radius || y + pitch < -radius)
            continue;
        for (std::size_t column = 0; column < size; ++column) {
            const double x = corner + static_cast<double>(column) * pitch - centre.u;
            if (x <= radius && x + pitch >= -radius)
                texels[row * size + column] += density * disk_overlap(radius, x, x + pitch, y, y + pitch);
        }
    }
}

// Power of scattered light in each texel.
std::vector<double> texel_power(const std::vector<RadialProfile>& profiles, std::size_t size, double pitch,
                                double beam_diameter)
{
    const double corner = -0.5 * static_cast<double>(size) * pitch;
    const std::size_t count = size * size;
    std::vector<double> texels(count, 0.0);
    for (const RadialProfile& profile : profiles) {
        const TexelGrid grid{corner - profile.centre(), corner, pitch, pitch, size, size};
        const TexelIntegrals integrals = is_point(beam_diameter, pitch)
                                             ? integrate_texels(profile, grid)
                                             : integrate_texels(DiskProfile(profile, 0.5 * beam_diameter), grid);
        for (std::size_t m = 0; m < integrals.harmonics; ++m)
            for (std::size_t i = 0; i < count; ++i)
                texels[i] += integrals.cosine[m * count + i];
    }
    return texels;
}

}  // namespace

std::vector<float> ldf_image(const LdfLibrary& library, double angle_deg, double albedo, std::size_t size, double pitch,
                             Side side, double beam_diameter, double curvature)
{
    check_grid(size, pitch, beam_diameter);
    const auto profiles = curvature == 0.0 ? library.pole_profiles(angle_deg, albedo, side)
                                           : std::vector{library.curved_profile(angle_deg, albedo, side, curvature)};
    std::vector<double> texels = texel_power(profiles, size, pitch, beam_diameter);
    for (const BallisticExit& exit : library.ballistic(angle_deg, side)) {
        if (is_point(beam_diameter, pitch))
            add_delta(texels, size, pitch, exit);
        else
            add_disk(texels, size, pitch, exit, 0.5 * beam_diameter);
    }
    std::vector<float> image(texels.size());
    std::transform(texels.begin(), texels.end(), image.begin(),
                   [area = pitch * pitch](double x) { return static_cast<float>(x / area); });
    return image;
}

std::vector<float> ldf_image_standard_error(const LdfLibrary& library, double angle_deg, double albedo,
                                            std::size_t size, double pitch, Side side, double beam_diameter)
{
    check_grid(size, pitch, beam_diameter);
    // Compute mean and sum of squared differences in one pass over the groups (Welford 1962,
    // doi:10.1080/00401706.1962.10490022).
    std::vector<double> mean(size * size, 0.0);
    std::vector<double> squares(size * size, 0.0);
    for (std::size_t group = 0; group < group_count; ++group) {
        const auto texels =
            texel_power(library.pole_profiles(angle_deg, albedo, side, group), size, pitch, beam_diameter);
        for (std::size_t i = 0; i < texels.size(); ++i) {
            const double difference = texels[i] - mean[i];
            mean[i] += difference / static_cast<double>(group + 1);
            squares[i] += difference * (texels[i] - mean[i]);
        }
    }
    std::vector<float> errors(squares.size());
    const double scale = 1.0 / static_cast<double>(group_count * (group_count - 1));
    std::transform(squares.begin(), squares.end(), errors.begin(),
                   [&](double x) { return static_cast<float>(std::sqrt(x * scale) / (pitch * pitch)); });
    return errors;
}

}  // namespace beamspread
