// The first pass of few rays from each texel, which decides how the others are traced.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "scene/light_guide.h"
#include "scene/light_search.h"

namespace beamspread {

// Rays of a texel. Nothing blocks those up to `open`.
enum class RayMethod : std::uint8_t {
    none,        // the light can't reach it
    open,        // as many as in the first pass, which nothing blocks
    even,        // all rays
    guided,      // all rays, guided
    few_guided,  // as many as in the first pass, guided
    single       // one, where no ray has found light: few texels find the light that all of them lack
};

// The rays of the first pass don't count: where they miss light, other rays of the texel would be left out for the same
// reason, and light would be lost.
class FirstPass {
public:
    // Rows of a tile follow each other, and are noted by one thread.
    static constexpr std::size_t rows_of_tile = LightSearch::tile_side;

    // `rays`: the largest number of rays of a texel.
    FirstPass(std::size_t width, std::size_t height, std::size_t rays, std::uint32_t seed);

    // Notes a ray from texel (x, y) toward a place on the light, and the part of its light that arrives.
    void note(std::size_t x, std::size_t y, const LightHit& hit, const Vec3f& transmittance);

    // Searches for rare light once all rays are noted.
    void search(const ProbeLight& probe) { m_search.spread(probe); }

    // Methods of a row of texels, and the guides of its tiles, for one thread.
    class Row {
    public:
        void find(const FirstPass& pass, std::size_t y);
        RayMethod method(std::size_t x) const { return m_methods[x]; }
        const LightGuide& guide(std::size_t x);

    private:
        const FirstPass* m_pass = nullptr;
        std::size_t m_y = 0;
        std::vector<std::uint8_t> m_met_around;
        std::vector<RayMethod> m_methods;
        std::vector<LightGuide> m_guides;  // [tile] of a row of tiles; empty until one is asked for
    };

private:
    // Obstacles and light that the rays of a texel met.
    enum Met : std::uint8_t { nothing = 0, light = 1, obstacle = 2, both = light | obstacle };

    void find_met_around(std::size_t y, std::vector<std::uint8_t>& around) const;
    static RayMethod method_of(std::uint8_t met_around, bool is_rare, bool has_guide);

    std::size_t m_width, m_height;
    std::vector<std::uint8_t> m_met;  // [texel]
    LightSearch m_search;
};

}  // namespace beamspread
