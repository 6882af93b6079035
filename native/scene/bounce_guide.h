// Which lights reach which parts of a scene, and from where the sky does: learned from shadow rays.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/vec.h"

namespace beamspread {

// A shadow ray that was traced.
struct GuideRecord {
    std::uint32_t cell = 0;
    std::uint32_t light = 0;
    std::uint32_t bin = 0;  // of the direction
    float transmittance = 0.0f;
    float radiance = 0.0f;  // of a light in all directions, over the density of rays
};

// Cubes of space, each with the part of each light that its surfaces see, and a histogram over directions of the light of the
// sky: through a window it comes from few of them. After Mueller, Gross, Novak 2017 ("Practical path guiding for efficient
// light-transport simulation", doi:10.1111/cgf.13227), with fixed cubes and bins.
class BounceGuide {
public:
    BounceGuide() = default;

    // Cubes around most of the points, which need not be all that light is reflected at.
    BounceGuide(std::span<const Vec3> points, std::size_t lights);

    bool is_empty() const { return m_passed.empty(); }
    std::uint32_t cell(const Vec3& point) const;
    static std::uint32_t bin(const Vec3& direction);

    void add(std::span<const GuideRecord> records);
    // Makes all records known; until then rays are chosen as before.
    void update();

    // An estimate above 0 of the part of a light that reaches a cell.
    float visibility(std::uint32_t cell, std::uint32_t light) const { return m_visibility[cell * m_lights + light]; }
    // The mean over all rays to a light.
    float mean_visibility(std::uint32_t light) const;

    // True if light of the sky was found from a cell or its neighbors.
    bool knows(std::uint32_t cell) const { return m_cumulated[(cell + 1) * bins - 1] > 0.0f; }
    // Probability of a bin, and density, 1/sr, of the directions that `sample` draws.
    float probability(std::uint32_t cell, std::uint32_t bin) const;
    double density(std::uint32_t cell, std::uint32_t bin) const;
    Vec3 sample(std::uint32_t cell, const Vec2& place) const;

private:
    // Bins of even solid angle along z and around it. More resolve narrower windows and need more rays.
    static constexpr std::uint32_t rings = 16;
    static constexpr std::uint32_t sectors = 32;
    static constexpr std::uint32_t bins = rings * sectors;

    std::size_t cells() const { return std::size_t{m_counts[0]} * m_counts[1] * m_counts[2]; }

    Vec3 m_low{0.0};
    double m_edge = 1.0;  // metres
    std::array<std::uint32_t, 3> m_counts{};
    std::size_t m_lights = 0;
    std::vector<float> m_rays, m_passed;  // [cell * lights + light] number of rays, and their transmittance
    std::vector<float> m_visibility;        // [cell * lights + light]
    std::vector<float> m_found;          // [cell * bins + bin]
    std::vector<float> m_cumulated;      // [cell * bins + bin] of the neighborhood, 1 at the end of each cell
};

}  // namespace beamspread
