#include "scene/ggx.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/constants.h"

namespace beamspread {

namespace {

// Nodes of the table of albedos along cosine and roughness, and places per side that are averaged for each. More are
// more exact; the table takes milliseconds once.
constexpr std::size_t cosines = 32;
constexpr std::size_t roughnesses = 16;
constexpr int places = 16;

constexpr double min_cosine = 1e-4;

double roughness_at(double node)
{
    const double least = std::sqrt(min_alpha);
    return std::lerp(least, 1.0, node / static_cast<double>(roughnesses - 1));
}

LobeAlbedo averaged(double cosine, double alpha)
{
    const GgxLobe lobe(Vec3(std::sqrt(1.0 - cosine * cosine), 0.0, cosine), alpha);
    LobeAlbedo sum{0.0, 0.0};
    for (int y = 0; y < places; ++y) {
        for (int x = 0; x < places; ++x) {
            const Vec3 direction = lobe.sample(Vec2(x + 0.5, y + 0.5) / double{places});
            if (!(direction.z > 0.0))
                continue;
            const double weight = lobe.value(direction) * inv_pi * direction.z / lobe.density(direction);
            sum.even += weight;
            sum.edge += weight * schlick_weight(lobe.half_cosine(direction));
        }
    }
    return {sum.even / (places * places), sum.edge / (places * places)};
}

using Table = std::array<std::array<LobeAlbedo, cosines>, roughnesses>;

Table make_table()
{
    Table table;
    for (std::size_t j = 0; j < roughnesses; ++j) {
        const double roughness = roughness_at(static_cast<double>(j));
        for (std::size_t i = 0; i < cosines; ++i)
            table[j][i] = averaged(std::max(static_cast<double>(i) / (cosines - 1), min_cosine), roughness * roughness);
    }
    return table;
}

LobeAlbedo mix(const LobeAlbedo& a, const LobeAlbedo& b, double t)
{
    return {std::lerp(a.even, b.even, t), std::lerp(a.edge, b.edge, t)};
}

}  // namespace

GgxLobe::GgxLobe(const Vec3& view, double alpha) : m_view(view), m_alpha(alpha), m_lambda(lambda(view.z)) {}

double GgxLobe::lambda(double cosine) const
{
    const double tan_squared = std::max(1.0 / (cosine * cosine) - 1.0, 0.0);
    return 0.5 * (std::sqrt(1.0 + m_alpha * m_alpha * tan_squared) - 1.0);
}

double GgxLobe::distribution(double cosine) const
{
    const double squared = m_alpha * m_alpha;
    const double root = cosine * cosine * (squared - 1.0) + 1.0;
    return squared * inv_pi / (root * root);
}

double GgxLobe::value(const Vec3& direction) const
{
    const Vec3 half = glm::normalize(m_view + direction);
    const double masking = 1.0 / (1.0 + m_lambda + lambda(direction.z));
    return pi * distribution(half.z) * masking / (4.0 * m_view.z * direction.z);
}

double GgxLobe::density(const Vec3& direction) const
{
    const Vec3 half = glm::normalize(m_view + direction);
    return distribution(half.z) / ((1.0 + m_lambda) * 4.0 * m_view.z);
}

Vec3 GgxLobe::sample(const Vec2& place) const
{
    const Vec3 stretched = glm::normalize(Vec3(m_alpha * m_view.x, m_alpha * m_view.y, m_view.z));
    const double azimuth = 2.0 * pi * place.x;
    const double z = (1.0 - place.y) * (1.0 + stretched.z) - stretched.z;
    const double across = std::sqrt(std::max(1.0 - z * z, 0.0));
    const Vec3 cap = Vec3(across * std::cos(azimuth), across * std::sin(azimuth), z) + stretched;
    const Vec3 half = glm::normalize(Vec3(m_alpha * cap.x, m_alpha * cap.y, cap.z));
    return half * (2.0 * glm::dot(m_view, half)) - m_view;
}

double GgxLobe::half_cosine(const Vec3& direction) const
{
    return glm::dot(m_view, glm::normalize(m_view + direction));
}

double schlick_weight(double cosine)
{
    const double sine = std::clamp(1.0 - cosine, 0.0, 1.0);
    return sine * sine * sine * sine * sine;
}

LobeAlbedo lobe_albedo(double cosine, double alpha)
{
    static const Table table = make_table();
    const double least = std::sqrt(min_alpha);
    const double x = std::clamp(cosine, 0.0, 1.0) * (cosines - 1);
    const double y = std::clamp((std::sqrt(alpha) - least) / (1.0 - least), 0.0, 1.0) * (roughnesses - 1);
    const std::size_t i = std::min(static_cast<std::size_t>(x), cosines - 2);
    const std::size_t j = std::min(static_cast<std::size_t>(y), roughnesses - 2);
    const double part = x - static_cast<double>(i);
    return mix(mix(table[j][i], table[j][i + 1], part), mix(table[j + 1][i], table[j + 1][i + 1], part),
               y - static_cast<double>(j));
}

}  // namespace beamspread
