#include "base/circle.h"

#include <array>
#include <cmath>

#include "base/constants.h"

namespace beamspread {

namespace {

// Nodes around the circle. The angle d to the nearest one is at most pi / nodes = .006, so that the first left-out term of the
// cosine, d^4 / 24, is 6e-11. More nodes take more of the processor's cache.
constexpr std::size_t nodes = 512;

std::array<Vec2, nodes> make_nodes() noexcept
{
    std::array<Vec2, nodes> circle;
    for (std::size_t i = 0; i < circle.size(); ++i) {
        const double angle = 2.0 * pi * (static_cast<double>(i) + 0.5) / static_cast<double>(nodes);
        circle[i] = {std::cos(angle), std::sin(angle)};
    }
    return circle;
}

const std::array<Vec2, nodes> circle = make_nodes();

}  // namespace

Vec2 on_circle(double turn)
{
    const double at = turn * static_cast<double>(nodes);
    const auto node = static_cast<std::size_t>(at);
    const double rest = (at - static_cast<double>(node) - 0.5) * (2.0 * pi / static_cast<double>(nodes));
    const double squared = rest * rest;
    const double cosine = 1.0 - 0.5 * squared;
    const double sine = rest * (1.0 - squared / 6.0);
    const Vec2& from = circle[node % nodes];
    return {from.x * cosine - from.y * sine, from.y * cosine + from.x * sine};
}

}  // namespace beamspread
