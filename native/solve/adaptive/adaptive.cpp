#include "solve/adaptive/adaptive.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "simd/loops.h"
#include "solve/adaptive/even_squares.h"
#include "solve/adaptive/multilevel_sum.h"
#include "solve/adaptive/near_radius.h"
#include "solve/separable/term_row.h"

namespace beamspread {

namespace {

// Fraction of the tolerance for each kind of error: uneven light within a square, dropped terms, and (twice) coarser
// grids for distant light. Larger: larger errors, less time.
constexpr double tolerance_share = 0.25;

// Terms of the light. A beam's kernel is the sum over terms of a factor, which depends on the beam, times the term's
// kernel.
LightTerms choose_terms(const Plane& plane, PlaneLight light, const ChannelMedium& medium, double tolerance)
{
    // The allowed error is a root mean square: take half a share, as single texels may have larger errors.
    const double allowed = 0.5 * tolerance_share * tolerance;
    light.color = {1.0};
    return light_terms(Problem{plane, {medium}, {std::move(light)}}, 1e-3 * allowed,
                       [&](const KernelDecomposition& kernels, const Incidence&, const LightTerms&) {
                           return kernels.within(allowed);
                       });
}

// All light in bins of the angle of incidence. Each bin counts as its most grazing light, which has the narrowest
// kernels.
std::vector<AngleLight> by_angle(const Plane& plane, const PlaneLight& light, const ChannelMedium& medium)
{
    // Largest tan(theta / 2): 90 degrees, after rounding, is no angle of incidence.
    constexpr float max_half_tangent = 1.0f - 1e-6f;
    struct Bin {
        double power = 0.0;
        float most_grazing = 0.0f;
    };
    constexpr std::size_t bin_count = 16;  // even in tan(theta / 2), 4 to 7 degrees each; more: smaller radii
    std::array<Bin, bin_count> bins{};
    BeamRow row;
    for (std::size_t y = 0; y < plane.height; ++y)
        for (std::size_t x = 0, end = row.read(plane, light, {y, 0, plane.width}) ? plane.width : 0; x < end; ++x) {
            if (row.irradiance[x] == 0.0f)
                continue;
            const float angle = std::min(row.half_tangent[x], max_half_tangent);
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
    // Select the squares that cost less as wide beams, four steps that all texels see, than texel by texel.
    constexpr std::size_t max_wide_squares = 500;  // squares of the smallest wide size on the plane
    std::vector<Square> wide = squares;
    std::erase_if(wide,
                  [&](const Square& square) { return square.size * square.size < height * width / max_wide_squares; });

    const double distance = std::hypot(static_cast<double>(height) * pitch_y, static_cast<double>(width) * pitch_x);
    const double near = near_radius(by_angle(plane, light, medium), std::max(pitch_y, pitch_x), distance,
                                    2.0 * tolerance_share * tolerance, progress);
    const double tried =
        tried_radius(terms, light, squares, wide, pitch_y, pitch_x, near, tolerance_share * tolerance, progress);
    TermSums texel_sums(terms, grid_levels(height, width, pitch_y, pitch_x, tried));
    // The kernel of wide beams is the light that one texel spreads to all offsets, on the same levels.
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
