// The first pass of few rays from each texel, which decides how the others are traced.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "scene/light_guide.h"
#include "scene/light_search.h"
#include "scene/texel_search.h"

namespace beamspread {

// Rays of a texel. Nothing blocks those up to `open`.
enum class RayMethod : std::uint8_t {
    none,    // the light can't reach it
    open,    // as many as in the first pass, which nothing blocks
    even,    // all rays, or fewer where obstacles block little of the light
    guided,  // guided rays: all, or fewer where little light arrives
    single   // one, where no ray has found light: few texels find the light that all of them lack
};

// Obstacles and light that the rays of a texel met.
enum Met : std::uint8_t { nothing = 0, light = 1, obstacle = 2, both = light | obstacle };

// The rays of the first pass don't count: where they miss light, other rays of the texel would be left out for the same
// reason, and light would be lost.
class FirstPass {
public:
    // Rows of a tile follow each other, and are noted by one thread.
    static constexpr std::size_t tile_side = LightSearch::tile_side;

    // `first_rays`, `rays`: number of rays of a texel in the first pass, and the largest one later.
    FirstPass(std::size_t width, std::size_t height, std::size_t first_rays, std::size_t rays, std::uint32_t seed);

    // Notes texels of one tile, side by side from (x, y) on: what their rays met, these rays, and the hits of those that
    // get through.
    void note(std::size_t x, std::size_t y, std::span<const std::uint8_t> met, std::span<const FirstRays> rays,
              std::span<const LightHit> hits);

    // Searches for rare light once all rays are noted.
    void search(const ProbeLight& probe, Progress& progress);

    // Methods of a row of texels, and the guides of its tiles, for one thread.
    class Row {
    public:
        void find(const FirstPass& pass, std::size_t y);
        RayMethod method(std::size_t x) const { return m_methods[x]; }
        // Number of rays of a texel.
        std::size_t rays(std::size_t x) const { return m_rays[x]; }
        const LightGuide& guide(std::size_t x);

    private:
        const FirstPass* m_pass = nullptr;
        std::size_t m_y = 0;
        std::vector<RayMethod> m_methods;
        std::vector<std::size_t> m_rays;
        std::vector<LightGuide> m_guides;  // [tile] of a row of tiles; empty until one is asked for
        LightGuide m_texel_guide;          // of the texel last asked for
    };

private:
    // First rays of a texel.
    struct Texel {
        std::uint8_t met = Met::nothing;
        float visible = 0.0f;  // part of the light that arrives
    };

    // Obstacles and light of a texel and its neighbors, and the parts of the light that may arrive and be blocked.
    struct Around {
        std::uint8_t met = Met::nothing;
        double visible = 0.0;
        double blocked = 0.0;
    };

    Around around(std::size_t x, std::size_t y) const;
    RayMethod method_of(std::uint8_t met_around, std::size_t x, std::size_t y) const;
    std::size_t even_rays(double blocked) const;
    std::size_t guided_rays(double visible, std::size_t x, std::size_t y) const;

    std::size_t m_width, m_height, m_first_rays, m_max_rays;
    std::vector<Texel> m_texels;
    LightSearch m_search;
    TexelSearch m_texel_search;
};

}  // namespace beamspread
