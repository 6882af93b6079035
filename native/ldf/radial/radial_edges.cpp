#include "ldf/radial/radial_profile.h"

#include <array>
#include <cmath>

namespace beamspread {

namespace {

const std::array<double, edge_count>& edges()
{
    static const auto table = [] {
        std::array<double, edge_count> radii{};
        for (std::size_t i = 0; i < edge_count; ++i) {
            if (i < first_fine_edge)
                radii[i] = radius_bin_edge(i);
            else if (i < first_fine_edge + fine_edge_count) {
                constexpr std::size_t per_octave = 1 << fine_bits;
                const std::size_t step = i - first_fine_edge + 1;
                radii[i] = std::ldexp(1.0 + static_cast<double>(step % per_octave) / per_octave,
                                      min_fine_exponent + static_cast<int>(step / per_octave));
            } else
                radii[i] = radius_bin_edge(i - fine_edge_count + replaced_edge_count);
        }
        return radii;
    }();
    return table;
}

}  // namespace

double radial_edge(std::size_t edge)
{
    return edges()[edge];
}

std::vector<double> profile_radii(RadialDetail detail)
{
    std::vector<double> radii;
    double inner = 0.0;
    for (std::size_t k = 0; k < edge_count; ++k) {
        if (detail == RadialDetail::bins && !is_bin_edge(k))
            continue;
        const double outer = radial_edge(k);
        const bool divided = detail == RadialDetail::bins && inner >= divided_begin && outer <= divided_end;
        for (int step = divided ? 1 : bin_steps; step <= bin_steps; ++step)
            radii.push_back(std::lerp(inner, outer, step / double{bin_steps}));
        inner = outer;
    }
    return radii;
}

bool is_bin_edge(std::size_t edge)
{
    constexpr std::size_t per_bin = fine_edge_count / replaced_edge_count;
    return edge < first_fine_edge || edge >= first_fine_edge + fine_edge_count ||
           (edge - first_fine_edge + 1) % per_bin == 0;
}

}  // namespace beamspread
