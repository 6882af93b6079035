#include "ldf/samples/ldf_sample.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/error.h"
#include "ldf/radial/texel_integral.h"
#include "medium/medium.h"

namespace beamspread {

namespace {

// Largest undershoot over the brightest texel. Sharpening filters undershoot steps by 9 % (Gibbs).
constexpr double max_undershoot = 0.1;

void check_image(const LdfSample& sample)
{
    if (sample.width < 1 || sample.height < 1 || sample.width > max_sample_side || sample.height > max_sample_side)
        reject("image", "of " + std::to_string(sample.height) + " x " + std::to_string(sample.width) + " texels",
               "sides of 1 to " + std::to_string(max_sample_side) + " texels");
    double darkest = 0.0;
    double brightest = 0.0;
    for (const float texel : sample.image) {
        const auto value = static_cast<double>(texel);
        if (!std::isfinite(value))
            reject("image", "with a texel of " + std::to_string(value), "finite exitance");
        darkest = std::min(darkest, value);
        brightest = std::max(brightest, value);
    }
    if (darkest < -max_undershoot * brightest)
        reject("image", "with a texel of " + std::to_string(darkest),
               "exitance >= 0, or undershoots of up to 10 % of the brightest texel");
}

struct Neighbours {
    std::size_t lower;
    std::size_t upper;
    double weight;  // of the upper one
};

Neighbours neighbours(double x, double pitch, std::size_t count)
{
    const auto last = static_cast<double>(count - 1);
    const double position = std::clamp(x / pitch + 0.5 * last, 0.0, last);
    const auto lower = static_cast<std::size_t>(position);
    return {lower, std::min(lower + 1, count - 1), position - std::floor(position)};
}

}  // namespace

double LdfSample::power() const
{
    return std::accumulate(image.begin(), image.end(), 0.0) * pitch * pitch;
}

double exitance_at(const LdfSample& sample, const Vec2& point)
{
    const Neighbours x = neighbours(point.x, sample.pitch, sample.width);
    const Neighbours y = neighbours(point.y, sample.pitch, sample.height);
    const auto along_u = [&](std::size_t row) {
        return (1.0 - x.weight) * static_cast<double>(sample.at(row, x.lower)) +
               x.weight * static_cast<double>(sample.at(row, x.upper));
    };
    return (1.0 - y.weight) * along_u(y.lower) + y.weight * along_u(y.upper);
}

void validate(const LdfSample& sample)
{
    check_image(sample);
    check_pitch(sample.pitch);
    if (!(sample.angle_deg >= 0.0 && sample.angle_deg < 90.0))
        reject("angle", sample.angle_deg, "0 <= angle < 90 degrees");
    check_albedo(sample.albedo);
    if (!(sample.beam_diameter >= 0.0 && std::isfinite(sample.beam_diameter)))
        reject("beam_diameter", sample.beam_diameter, "beam_diameter >= 0 mean free paths");
    if (sample.g && !(std::abs(*sample.g) < 1.0))
        reject("g", *sample.g, "-1 < g < 1");
}

}  // namespace beamspread
