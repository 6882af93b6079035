#include "solve/adaptive/adaptive.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "simd/loops.h"
#include "solve/adaptive/multilevel_sum.h"
#include "solve/adaptive/near_radius.h"
#include "solve/adaptive/term_sums.h"
#include "solve/adaptive/wide_beams.h"
#include "solve/separable/term_row.h"

namespace beamspread {

namespace {

// Share of the tolerance that each kind of approximation may use up: light that is not quite even within a square,
// terms left out where directions differ, and twice that distance. Measured over three lamps and
// three suns on 192 x 192 texels at a tolerance of 1e-3, errors sum to at most 1.3e-4 of the light and the worst texel is
// off by 2.8e-4 of the brightest; with half the share by 1.5e-5 and 5e-5 in 1.24 times the time, with twice the share, by
// another radius that is tried, 5e-5 and 2.1e-4 in .55 to 1.4 times.
constexpr double tolerance_share = 0.25;

// Each beam's kernel is a sum over terms, of a factor that depends on the beam times a kernel that does not.
LightTerms choose_terms(const Plane& plane, PlaneLight light, const ChannelMedium& medium, double tolerance)
{
    // Half a share: what is left out is a root mean square, and a single texel may be farther off.
    const double allowed = 0.5 * tolerance_share * tolerance;
    light.color = {1.0};
    return light_terms(Problem{plane, {medium}, {std::move(light)}}, 1e-3 * allowed,
                       [&](const KernelDecomposition& kernels, const Incidence&, const LightTerms&) {
                           return kernels.within(allowed);
                       });
}

// All light by its angle of incidence; that of about the same angle as if all were the most grazing of it, whose kernels
// are the narrowest.
std::vector<AngleLight> by_angle(const Plane& plane, const PlaneLight& light, const ChannelMedium& medium)
{
    // Rounded up to 90 degrees exactly, an angle would be no angle of incidence.
    constexpr float largest = 1.0f - 1e-6f;
    // Even in tan(theta / 2): 4 to 7 degrees each. Half and twice as many find the same radius for a lamp and a sun; one bin
    // takes up to 1.24 times as long.
    struct Bin {
        double power = 0.0;
        float most_grazing = 0.0f;
    };
    std::array<Bin, 16> bins{};
    BeamRow row;
    for (std::size_t y = 0; y < plane.height; ++y)
        for (std::size_t x = 0, end = row.read(plane, light, {y, 0, plane.width}) ? plane.width : 0; x < end; ++x) {
            if (row.irradiance[x] == 0.0f)
                continue;
            const float angle = std::min(row.half_tangent[x], largest);
            Bin& bin = bins[static_cast<std::size_t>(angle * static_cast<float>(bins.size()))];
            bin.power += static_cast<double>(row.irradiance[x]);
            bin.most_grazing = std::max(bin.most_grazing, angle);
        }
    std::vector<AngleLight> lights;
    for (const auto& [power, most_grazing] : bins)
        if (power > 0.0)
            lights.push_back({medium.ldf->profile(angle_deg(most_grazing), medium.albedo, Side::reflected), power});
    return lights;
}

}  // namespace

std::vector<Square> beam_squares(const Plane& plane, const PlaneLight& light, double tolerance)
{
    return even_squares(plane, light, tolerance_share * tolerance);
}

std::vector<double> solve_adaptive(const Plane& plane, const PlaneLight& light, const ChannelMedium& medium,
                                   double tolerance, Progress& progress)
{
    const auto [width, height, metres_x, metres_y] = plane;
    const double pitch_y = metres_y / medium.mean_free_path;
    const double pitch_x = metres_x / medium.mean_free_path;
    std::vector<double> exitance(height * width);
    const std::vector<Square> squares = beam_squares(plane, light, tolerance);
    if (squares.empty()) {
        progress.advance(1.0);
        return exitance;
    }
    const LightTerms terms = choose_terms(plane, light, medium, tolerance);
    const std::size_t count = terms.terms.size();
    // The squares that cost less as beams of their width, four steps seen by all texels, than texel by texel. A texel is
    // added to some 2000 others; for half and twice as many, time and errors are the same within 6 %.
    std::vector<Square> wide = squares;
    std::erase_if(wide, [&](const Square& square) { return square.size * square.size < height * width / 500; });

    const double distance = std::hypot(static_cast<double>(height) * pitch_y, static_cast<double>(width) * pitch_x);
    const double near = near_radius(by_angle(plane, light, medium), std::max(pitch_y, pitch_x), distance,
                                    2.0 * tolerance_share * tolerance, progress);
    const double tried =
        tried_radius(terms, light, squares, wide, pitch_y, pitch_x, near, tolerance_share * tolerance, progress);
    TermSums texel_sums(terms, grid_levels(height, width, pitch_y, pitch_x, tried));
    // The kernel of wide beams is the light that one texel spreads to all offsets, seen as coarsely.
    TermSums kernel_sums(terms, grid_levels(2 * height - 1, 2 * width - 1, pitch_y, pitch_x, near));

    Grid sum(height, width);
    for (std::size_t t = 0; t < count; ++t) {
        const double work = 1.0 / static_cast<double>(count);
        Grid beams = term_light(terms, t);
        if (!wide.empty()) {
            Grid texel(2 * height - 1, 2 * width - 1);
            texel.row(height - 1)[width - 1] = 1.0;
            const Grid steps = take_steps(beams, wide);
            add_pairs(sum, steps, step_kernel(kernel_sums.sum(t, std::move(texel), progress, 0.0)), progress,
                      0.5 * work);
        }
        const Grid part = texel_sums.sum(t, std::move(beams), progress, wide.empty() ? work : 0.5 * work);
        add_scaled(sum.values.data(), part.values.data(), 1.0, sum.values.size());
    }
    for (std::size_t y = 0; y < height; ++y)
        std::copy_n(sum.row(y), width, exitance.data() + y * width);
    return exitance;
}

}  // namespace beamspread
