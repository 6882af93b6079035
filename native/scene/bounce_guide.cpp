#include "scene/bounce_guide.h"

#include <algorithm>
#include <cmath>

#include "base/constants.h"

namespace beamspread {

namespace {

// Number of cubes along the longest side. More resolve shadows of lights more finely, and each sees fewer rays.
constexpr double cubes_along = 12.0;

// Part of the points along each axis, at either end, that the cubes need not hold.
constexpr double outliers = 0.05;

// Smallest estimate of visibility: light that rays have missed is chosen so much less often than its irradiance asks for.
constexpr float min_visibility = 0.05f;

}  // namespace

BounceGuide::BounceGuide(std::span<const Vec3> points, std::size_t lights) : m_lights(lights)
{
    if (points.empty())
        return;
    Vec3 high;
    for (int i = 0; i < 3; ++i) {
        std::vector<double> along;
        for (const Vec3& point : points)
            along.push_back(point[i]);
        std::ranges::sort(along);
        const auto skipped = static_cast<std::size_t>(outliers * static_cast<double>(along.size()));
        m_low[i] = along[skipped];
        high[i] = along[along.size() - 1 - skipped];
    }
    const Vec3 size = high - m_low;
    const double longest = std::max({size.x, size.y, size.z});
    m_edge = longest > 0.0 ? longest / cubes_along : 1.0;
    for (std::size_t i = 0; i < 3; ++i)
        m_counts[i] = static_cast<std::uint32_t>(size[static_cast<int>(i)] / m_edge) + 1;
    m_rays.assign(cells() * lights, 0.0f);
    m_passed.assign(cells() * lights, 0.0f);
    m_visibility.assign(cells() * lights, 1.0f);
    m_found.assign(cells() * bins, 0.0f);
    m_cumulated.assign(cells() * bins, 0.0f);
}

std::uint32_t BounceGuide::cell(const Vec3& point) const
{
    std::array<std::uint32_t, 3> at;
    for (std::size_t i = 0; i < 3; ++i) {
        const double place = (point[static_cast<int>(i)] - m_low[static_cast<int>(i)]) / m_edge;
        at[i] = static_cast<std::uint32_t>(std::clamp(place, 0.0, static_cast<double>(m_counts[i] - 1)));
    }
    return (at[2] * m_counts[1] + at[1]) * m_counts[0] + at[0];
}

std::uint32_t BounceGuide::bin(const Vec3& direction)
{
    const double turn = std::atan2(direction.y, direction.x) * 0.5 * inv_pi + 0.5;
    const double height = 0.5 * direction.z + 0.5;
    const auto of = [](double place, std::uint32_t count) {
        return std::min(static_cast<std::uint32_t>(std::max(place, 0.0) * count), count - 1);
    };
    return of(height, rings) * sectors + of(turn, sectors);
}

void BounceGuide::add(std::span<const GuideRecord> records)
{
    for (const GuideRecord& record : records) {
        const std::size_t place = record.cell * m_lights + record.light;
        m_rays[place] += 1.0f;
        m_passed[place] += record.transmittance;
        m_found[record.cell * bins + record.bin] += record.transmittance * record.radiance;
    }
}

void BounceGuide::update()
{
    for (std::size_t i = 0; i < m_visibility.size(); ++i)
        m_visibility[i] = std::max((m_passed[i] + 0.5f) / (m_rays[i] + 1.0f), min_visibility);
    // The neighborhood of a cell and of a bin sees light, too, as windows look different from each point of a cell.
    constexpr float beside = 0.25f;
    std::vector<float> own(m_found.size());
    for (std::size_t cell = 0; cell < cells(); ++cell) {
        for (std::uint32_t ring = 0; ring < rings; ++ring) {
            for (std::uint32_t sector = 0; sector < sectors; ++sector) {
                const auto at = [&](std::uint32_t y, std::uint32_t x) {
                    return m_found[cell * bins + y * sectors + x % sectors];
                };
                float sum = at(ring, sector) + beside * (at(ring, sector + 1) + at(ring, sector + sectors - 1));
                if (ring > 0)
                    sum += beside * at(ring - 1, sector);
                if (ring + 1 < rings)
                    sum += beside * at(ring + 1, sector);
                own[cell * bins + ring * sectors + sector] = sum;
            }
        }
    }
    m_cumulated = own;
    std::size_t stride = 1;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        for (std::size_t cell = 0; cell < cells(); ++cell) {
            const std::size_t place = cell / stride % m_counts[axis];
            for (std::uint32_t bin = 0; bin < bins; ++bin) {
                float& sum = m_cumulated[cell * bins + bin];
                if (place > 0)
                    sum += beside * own[(cell - stride) * bins + bin];
                if (place + 1 < m_counts[axis])
                    sum += beside * own[(cell + stride) * bins + bin];
            }
        }
        stride *= m_counts[axis];
    }
    for (std::size_t cell = 0; cell < cells(); ++cell) {
        float* const values = &m_cumulated[cell * bins];
        for (std::uint32_t bin = 1; bin < bins; ++bin)
            values[bin] += values[bin - 1];
        if (const float sum = values[bins - 1]; sum > 0.0f)
            std::for_each(values, values + bins, [sum](float& value) { value /= sum; });
    }
}

float BounceGuide::mean_visibility(std::uint32_t light) const
{
    float rays = 0.0f;
    float passed = 0.0f;
    for (std::size_t place = light; place < m_rays.size(); place += m_lights) {
        rays += m_rays[place];
        passed += m_passed[place];
    }
    return rays > 0.0f ? passed / rays : 1.0f;
}

float BounceGuide::probability(std::uint32_t cell, std::uint32_t bin) const
{
    const float* const values = &m_cumulated[cell * bins];
    return values[bin] - (bin > 0 ? values[bin - 1] : 0.0f);
}

double BounceGuide::density(std::uint32_t cell, std::uint32_t bin) const
{
    return static_cast<double>(probability(cell, bin)) * bins * 0.25 * inv_pi;
}

Vec3 BounceGuide::sample(std::uint32_t cell, const Vec2& place) const
{
    const float* const values = &m_cumulated[cell * bins];
    const auto at = static_cast<float>(place.x);
    const auto bin = static_cast<std::uint32_t>(std::upper_bound(values, values + bins - 1, at) - values);
    const double below = bin > 0 ? static_cast<double>(values[bin - 1]) : 0.0;
    const double part =
        std::clamp((place.x - below) / std::max(static_cast<double>(values[bin]) - below, 1e-30), 0.0, 1.0 - 1e-9);
    const double z = 2.0 * (bin / sectors + place.y) / rings - 1.0;
    const double azimuth = 2.0 * pi * ((bin % sectors + part) / sectors - 0.5);
    const double across = std::sqrt(std::max(1.0 - z * z, 0.0));
    return {across * std::cos(azimuth), across * std::sin(azimuth), z};
}

}  // namespace beamspread
