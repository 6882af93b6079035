// Colors on surfaces: the part of light that crosses them, or that they reflect.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/vec.h"

namespace beamspread {

// Extension of an image beyond its border, as in Blender's Image Texture node.
enum class Extension : std::uint8_t { repeat, extend, clip, mirror };

// Texels of an image, row by row from v = 0, with 1 or 3 channels each.
struct TexelArray {
    std::span<const float> values;
    std::size_t width = 0;
    std::size_t height = 0;
    std::size_t channels = 1;
};

// A color on a surface, 0 to 1 in each channel: one color, or an image of colors.
class ColorTexture {
public:
    // `color` is 0 to 1 in each channel. Throws InvalidArgument.
    explicit ColorTexture(const Vec3f& color);

    // Texels are stored in 16 bits. `is_smooth`: bilinear interpolation, otherwise the nearest texel. `outside` is the
    // color of a clipped image beyond its border. Throws InvalidArgument.
    ColorTexture(const TexelArray& texels, Extension extension, bool is_smooth, const Vec3f& outside);

    bool is_black() const { return m_highest == 0.0f; }
    bool is_white() const { return m_lowest == 1.0f; }
    bool is_image() const { return !m_texels.empty(); }
    bool is_colored() const { return m_is_colored; }

    Vec3f at(const Vec2f& uv) const;

    // The arguments that make the same texture. One color has no texels.
    std::vector<float> texels() const;
    std::size_t width() const { return m_width; }
    std::size_t height() const { return m_height; }
    std::size_t channels() const { return m_channels; }
    Extension extension() const { return m_extension; }
    bool is_smooth() const { return m_is_smooth; }
    const Vec3f& color() const { return m_color; }

private:
    void include(const Vec3f& color);
    Vec3f texel(std::int64_t x, std::int64_t y) const;

    std::vector<std::uint16_t> m_texels;
    std::size_t m_width = 0;
    std::size_t m_height = 0;
    std::size_t m_channels = 1;
    Extension m_extension = Extension::repeat;
    bool m_is_smooth = true;
    Vec3f m_color{};  // the one color, or the color outside the image
    float m_lowest = 1.0f;
    float m_highest = 0.0f;
    bool m_is_colored = false;
};

}  // namespace beamspread
