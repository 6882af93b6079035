#include "ldf/samples/sample_lookup.h"

#include <algorithm>
#include <cmath>

namespace beamspread {

namespace {

struct Neighbours {
    std::size_t lower;
    std::size_t upper;
    double weight;  // of the upper one
};

Neighbours neighbours(double x, double pitch, std::size_t count)
{
    const auto last = static_cast<double>(count - 1);
    const double place = std::clamp(x / pitch + 0.5 * last, 0.0, last);
    const auto lower = static_cast<std::size_t>(place);
    return {lower, std::min(lower + 1, count - 1), place - std::floor(place)};
}

}  // namespace

double exitance_at(const LdfSample& sample, const Vec2& place)
{
    const Neighbours x = neighbours(place.x, sample.pitch, sample.width);
    const Neighbours y = neighbours(place.y, sample.pitch, sample.height);
    const auto along_u = [&](std::size_t row) {
        return (1.0 - x.weight) * static_cast<double>(sample.at(row, x.lower)) +
               x.weight * static_cast<double>(sample.at(row, x.upper));
    };
    return (1.0 - y.weight) * along_u(y.lower) + y.weight * along_u(y.upper);
}

}  // namespace beamspread
