#include "solve/problem/problem.h"

#include <algorithm>
#include <cmath>

#include "base/constants.h"
#include "simd/loops.h"

namespace beamspread {

namespace {

// Largest relative difference of proportional channels: six roundings of 2^-24, which hardly ever add up to more. If
// they do, the channels count as different, which costs transforms and no accuracy.
constexpr float same_light = 3e-7f;

bool differ_by(float factor, const View2D<const float>& a, const View2D<const float>& b)
{
    for (std::size_t y = 0; y < a.height; ++y)
        for (std::size_t x = 0; x < a.width; ++x)
            if (!(std::abs(a(y, x) - factor * b(y, x)) <= same_light * a(y, x)))  // true for NaN too
                return false;
    return true;
}

}  // namespace

Texel brightest(const View2D<const float>& irradiance)
{
    Texel maximum{0, 0};
    for (std::size_t y = 0; y < irradiance.height; ++y)
        for (std::size_t x = 0; x < irradiance.width; ++x)
            if (irradiance(y, x) > irradiance(maximum.y, maximum.x))
                maximum = {y, x};
    return maximum;
}

std::vector<PlaneLight> lights_of_channels(const std::vector<View2D<const float>>& irradiance,
                                           const Directions& directions)
{
    const std::size_t channels = irradiance.size();
    if (channels == 1)
        return {{irradiance.front(), directions, {1.0}}};
    std::vector<float> largest;
    for (const View2D<const float>& channel : irradiance) {
        const Texel at = brightest(channel);
        largest.push_back(channel.height * channel.width > 0 ? channel(at.y, at.x) : 0.0f);
    }
    const auto reference = static_cast<std::size_t>(std::max_element(largest.begin(), largest.end()) - largest.begin());
    PlaneLight shared{irradiance[reference], directions, std::vector<double>(channels, 1.0)};
    bool same = true;
    for (std::size_t c = 0; c < channels && largest[reference] > 0.0f; ++c) {
        const float factor = largest[c] / largest[reference];
        shared.color[c] = static_cast<double>(factor);
        same &= differ_by(factor, irradiance[c], irradiance[reference]);
    }
    if (same)
        return {shared};
    std::vector<PlaneLight> lights;
    for (std::size_t c = 0; c < channels; ++c) {
        lights.push_back({irradiance[c], directions, std::vector<double>(channels, 0.0)});
        lights.back().color[c] = 1.0;
    }
    return lights;
}

bool BeamRow::read(const Plane& plane, const PlaneLight& light, const RowSpan& span)
{
    const std::size_t count = span.width;
    irradiance.resize(count);
    copy_row(light.irradiance, span.y, span.x, count, irradiance.data());
    if (std::all_of(irradiance.begin(), irradiance.end(), [](float value) { return value == 0.0f; }))
        return false;
    for (auto* values : {&cos_beta, &sin_beta, &half_tangent})
        values->resize(count);
    if (const auto* parallel = std::get_if<OneDirection>(&light.directions)) {
        std::fill(cos_beta.begin(), cos_beta.end(), static_cast<float>(std::cos(azimuth(parallel->travel))));
        std::fill(sin_beta.begin(), sin_beta.end(), static_cast<float>(std::sin(azimuth(parallel->travel))));
        const double tangent = std::tan(0.5 * incidence_deg(parallel->travel) * radians_per_degree);
        std::fill(half_tangent.begin(), half_tangent.end(), static_cast<float>(tangent));
        return true;
    }
    const float* directions = nullptr;
    if (const auto* field = std::get_if<PerTexel>(&light.directions)) {
        directions = field->travel + 3 * (span.y * plane.width + span.x);
    } else {
        travel.resize(3 * count);
        const Vec3 first = travel_at(plane, light.directions, span.y, span.x);
        for (std::size_t x = 0; x < count; ++x) {
            travel[3 * x] = static_cast<float>(first.x + static_cast<double>(x) * plane.pitch_x);
            travel[3 * x + 1] = static_cast<float>(first.y);
            travel[3 * x + 2] = static_cast<float>(first.z);
        }
        directions = travel.data();
    }
    find_angles(directions, irradiance.data(), cos_beta.data(), sin_beta.data(), half_tangent.data(), count);
    return true;
}

Vec3 travel_at(const Plane& plane, const Directions& directions, std::size_t y, std::size_t x)
{
    if (const auto* parallel = std::get_if<OneDirection>(&directions))
        return parallel->travel;
    if (const auto* point = std::get_if<FromPoint>(&directions))
        return Vec3((static_cast<double>(x) + 0.5) * plane.pitch_x, (static_cast<double>(y) + 0.5) * plane.pitch_y,
                    0.0) -
               point->position;
    const float* d = std::get<PerTexel>(directions).travel + 3 * (y * plane.width + x);
    return Vec3(d[0], d[1], d[2]);
}

double incidence_deg(const Vec3& travel)
{
    return std::atan2(std::hypot(travel.x, travel.y), -travel.z) / radians_per_degree;
}

double azimuth(const Vec3& travel)
{
    return std::atan2(travel.y, travel.x);
}

double angle_deg(double half_tangent)
{
    return 2.0 * std::atan(half_tangent) / radians_per_degree;
}

}  // namespace beamspread
