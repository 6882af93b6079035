#include "scene/color_texture.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "base/error.h"
#include "scene/checks.h"

namespace beamspread {

namespace {

// Largest value of a stored texel.
constexpr float levels = 65535.0f;

void check_color(const std::string& name, const Vec3f& color)
{
    for (int i = 0; i < 3; ++i) {
        if (!(color[i] >= 0.0f && color[i] <= 1.0f))
            reject(name, detail::to_text(color), "0 to 1 in each channel");
    }
}

// The texel that an image of `count` texels shows `i` texels from its border; -1 for none.
std::int64_t wrapped(std::int64_t i, std::int64_t count, Extension extension)
{
    const auto modulo = [](std::int64_t a, std::int64_t b) { return (a % b + b) % b; };
    switch (extension) {
        case Extension::repeat:
            return modulo(i, count);
        case Extension::mirror: {
            const std::int64_t position = modulo(i, 2 * count);
            return std::min(position, 2 * count - 1 - position);
        }
        case Extension::extend:
            return std::clamp<std::int64_t>(i, 0, count - 1);
        case Extension::clip:
            break;
    }
    return i >= 0 && i < count ? i : -1;
}

}  // namespace

ColorTexture::ColorTexture(const Vec3f& color) : m_color(color)
{
    check_color("color", color);
    include(color);
}

ColorTexture::ColorTexture(const TexelArray& texels, Extension extension, bool is_smooth, const Vec3f& outside)
    : m_width(texels.width),
      m_height(texels.height),
      m_channels(texels.channels),
      m_extension(extension),
      m_is_smooth(is_smooth),
      m_color(outside)
{
    if (texels.values.empty())
        reject("texels", "empty", "1 or more texels");
    check_color("outside", outside);
    m_texels.reserve(texels.values.size());
    for (const float value : texels.values) {
        if (!(value >= 0.0f && value <= 1.0f))
            reject("texels", static_cast<double>(value), "0 to 1 in each channel");
        m_texels.push_back(static_cast<std::uint16_t>(std::lround(value * levels)));
    }
    for (std::size_t i = 0; i < m_texels.size(); i += m_channels) {
        const auto level = [&](std::size_t channel) { return static_cast<float>(m_texels[i + channel]) / levels; };
        include(m_channels == 1 ? Vec3f(level(0)) : Vec3f(level(0), level(1), level(2)));
    }
    if (extension == Extension::clip)
        include(outside);
}

std::vector<float> ColorTexture::texels() const
{
    std::vector<float> values(m_texels.size());
    std::transform(m_texels.begin(), m_texels.end(), values.begin(),
                   [](std::uint16_t level) { return static_cast<float>(level) / levels; });
    return values;
}

void ColorTexture::include(const Vec3f& color)
{
    m_lowest = std::min({m_lowest, color.x, color.y, color.z});
    m_highest = std::max({m_highest, color.x, color.y, color.z});
    m_is_colored |= color.x != color.y || color.y != color.z;
}

Vec3f ColorTexture::at(const Vec2f& uv) const
{
    if (m_texels.empty())
        return m_color;
    const Vec2f position = uv * Vec2f(m_width, m_height) - (m_is_smooth ? 0.5f : 0.0f);
    const Vec2f cell = glm::floor(position);
    const auto x = static_cast<std::int64_t>(cell.x);
    const auto y = static_cast<std::int64_t>(cell.y);
    if (!m_is_smooth)
        return texel(x, y);
    const Vec2f part = position - cell;
    return glm::mix(glm::mix(texel(x, y), texel(x + 1, y), part.x),
                    glm::mix(texel(x, y + 1), texel(x + 1, y + 1), part.x), part.y);
}

Vec3f ColorTexture::texel(std::int64_t x, std::int64_t y) const
{
    x = wrapped(x, static_cast<std::int64_t>(m_width), m_extension);
    y = wrapped(y, static_cast<std::int64_t>(m_height), m_extension);
    if (x < 0 || y < 0)
        return m_color;
    const std::uint16_t* levels_here =
        &m_texels[(static_cast<std::size_t>(y) * m_width + static_cast<std::size_t>(x)) * m_channels];
    if (m_channels == 1)
        return Vec3f(static_cast<float>(levels_here[0]) / levels);
    return Vec3f(levels_here[0], levels_here[1], levels_here[2]) / levels;
}

}  // namespace beamspread
