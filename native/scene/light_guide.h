// Guided rays: where on a light rays start, once some are known that get through the occluders.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "base/vec.h"

namespace beamspread {

// A ray that got through: its place in the unit square of the light, and where it starts on the plane, texels.
struct LightHit {
    Vec2f place{};
    Vec2f position{};
};

// Places around hits that are near each other: a histogram in their bounding box, and larger boxes around it. All of them
// move with the position: a window is seen from a slightly different angle beside it (Ruppert et al. 2020, "Robust fitting
// of parallax-aware mixtures for path guiding").
class HitCluster {
public:
    explicit HitCluster(std::span<const LightHit> hits);

    // The place at a position of a place of an even distribution. A whole number may have to be taken from it.
    Vec2 place_at(const Vec2& position, const Vec2& square) const;
    // Density of these places.
    double density(const Vec2& position, const Vec2& place) const;

private:
    // Cells along a side of the histogram. More: finer openings, and noise where hits are few.
    static constexpr std::size_t side = 12;

    // A box in which places are even.
    struct Box {
        Vec2 low{}, size{};
        double share = 0.0;

        Box grown(double factor) const
        {
            const Vec2 larger = glm::min(factor * size, Vec2(1.0));
            return {low - 0.5 * (larger - size), larger, share};
        }
    };

    Vec2 move_to(const Vec2& position) const;
    // How many times as large the larger boxes are at a position: far from the hits their moves are less known.
    double growth(const Vec2& position) const;
    void fit_steps(std::span<const LightHit> hits);
    void count(std::span<const Vec2> places);

    Vec2 m_center{};              // position, texels
    Vec2 m_step_x{}, m_step_y{};  // move of places by a step of a texel
    double m_known = 0.0;         // distance from the center up to which moves are known, texels; 0: none move
    Box m_histogram;              // of share 0 if hits are too few for it
    std::vector<Box> m_boxes;
    std::array<double, side * side> m_cells{};  // [column][row] density
    std::array<double, side> m_columns{};       // probability up to the end of each
    std::array<double, side * side> m_rows{};   // [column][row] probability up to its end in the column
};

// A distribution of places that is dense around hits and covers the whole square, so that rays divided by its density
// have the right mean (Mueller et al. 2017, "Practical path guiding for efficient light-transport simulation"; here in the
// space of random numbers, as Guo et al. 2018, "Primary sample space path guiding").
class LightGuide {
public:
    // Replaces the hits, whose order changes. Nothing is guided without any.
    void assign(std::span<LightHit> hits);

    bool empty() const { return m_clusters.empty(); }

    // Moves a place of an even distribution to one of the distribution at a position; returns the density there.
    double guide(const Vec2& position, Vec2& place) const;

private:
    void add_clusters(std::span<LightHit> hits);

    std::vector<HitCluster> m_clusters;
    std::vector<double> m_ends;   // [cluster] probability up to its end, among guided rays
    std::vector<Vec2f> m_cells;   // working memory
};

}  // namespace beamspread
