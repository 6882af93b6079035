// Meshes that block light, the instances of each, and the part of light that their triangles let through.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
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

// The part of crossing light that a surface lets through: one color, or an image of colors.
class Transmittance {
public:
    // `color` is 0 to 1 in each channel. Throws InvalidArgument.
    explicit Transmittance(const Vec3f& color);

    // Texels are stored in 16 bits. `is_smooth`: bilinear interpolation, otherwise the nearest texel. `outside` is the
    // color of a clipped image beyond its border. Throws InvalidArgument.
    Transmittance(const TexelArray& texels, Extension extension, bool is_smooth, const Vec3f& outside);

    bool is_opaque() const { return m_highest == 0.0f; }
    bool is_clear() const { return m_lowest == 1.0f; }
    bool is_colored() const { return m_is_colored; }

    Vec3f at(const Vec2f& uv) const;

    // The arguments that make the same transmittance. One color has no texels.
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

// Indices of three vertices.
using Triangle = std::array<std::uint32_t, 3>;

// Transform from a mesh to the world: linear x + translation.
struct Placement {
    Mat3 linear{1.0};
    Vec3 translation{};

    Vec3 operator()(const Vec3& point) const { return linear * point + translation; }
};

// A mesh as views of arrays, which must outlive the making of occluders; `transmittances` are shared.
struct OccluderMesh {
    std::span<const Vec3> vertices{};
    std::span<const Triangle> triangles{};
    std::vector<Placement> placements{Placement{}};

    // The transmittance of each material, and the material of each triangle. Without materials all triangles are opaque.
    std::vector<std::shared_ptr<const Transmittance>> transmittances{};
    std::span<const std::uint32_t> materials{};
    std::span<const std::array<Vec2f, 3>> uvs{};  // of each triangle's corners; empty: all are (0, 0)

    // The transmittance of a triangle; null if it is opaque.
    const Transmittance* transmittance(std::size_t triangle) const
    {
        if (materials.empty())
            return nullptr;
        const Transmittance* const transmittance = transmittances[materials[triangle]].get();
        return transmittance->is_opaque() ? nullptr : transmittance;
    }

    // Throws InvalidArgument.
    void check() const;
};

}  // namespace beamspread
