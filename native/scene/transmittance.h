// What a surface lets through of the light that crosses it: one colour, or an image of colours.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/vec.h"

namespace beamspread {

// Where an image is looked up beyond its border, as in Blender's Image Texture node.
enum class Extension : std::uint8_t { repeat, extend, clip, mirror };

// An image's texels, row by row from v = 0, 1 or 3 channels of each.
struct TexelArray {
    std::span<const float> values;
    std::size_t width = 0;
    std::size_t height = 0;
    std::size_t channels = 1;
};

class Transmittance {
public:
    // 0 to 1 in each channel. Throws InvalidArgument.
    explicit Transmittance(const Vec3f& color);

    // Texels are kept in 16 bits. `is_smooth`: bilinear, else that of the nearest texel. `outside` is what a clipped
    // image lets through beyond its border. Throws InvalidArgument.
    Transmittance(const TexelArray& texels, Extension extension, bool is_smooth, const Vec3f& outside);

    bool is_opaque() const { return m_highest == 0.0f; }
    bool is_clear() const { return m_lowest == 1.0f; }
    bool is_colored() const { return m_is_colored; }

    Vec3f at(const Vec2f& uv) const;

private:
    void include(const Vec3f& color);
    Vec3f texel(std::int64_t x, std::int64_t y) const;

    std::vector<std::uint16_t> m_texels;
    std::size_t m_width = 0;
    std::size_t m_height = 0;
    std::size_t m_channels = 1;
    Extension m_extension = Extension::repeat;
    bool m_is_smooth = true;
    Vec3f m_color{};  // everywhere, or outside the image
    float m_lowest = 1.0f;
    float m_highest = 0.0f;
    bool m_is_colored = false;
};

}  // namespace beamspread
