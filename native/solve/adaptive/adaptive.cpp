#include "solve/adaptive/adaptive.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "simd/loops.h"
#include "solve/adaptive/multilevel_sum.h"
#include "solve/separable/light_terms.h"

namespace beamspread {

namespace {

// Bounds of irradiance and direction in a square, and the sum of its irradiance.
struct Extent {
    float min = 0.0f;
    float max = 0.0f;
    double sum = 0.0;
    Vec3f min_direction{0.0f};
    Vec3f max_direction{0.0f};
};

Extent merge(const Extent& a, const Extent& b)
{
    return {std::min(a.min, b.min), std::max(a.max, b.max), a.sum + b.sum, glm::min(a.min_direction, b.min_direction),
            glm::max(a.max_direction, b.max_direction)};
}

class Search {
public:
    Search(const Plane& plane, const PlaneLight& light, double tolerance, std::vector<Square>& squares)
        : m_plane(plane), m_light(light), m_tolerance(tolerance), m_squares(squares)
    {
    }

    // Returns the extent of a square, and adds its even parts: the square itself if it is even, else those of its
    // quarters.
    Extent visit(std::size_t y, std::size_t x, std::size_t size)
    {
        if (y >= m_plane.height || x >= m_plane.width)
            return {};
        const std::size_t before = m_squares.size();
        Extent extent;
        if (size == 1) {
            extent = texel(y, x);
        } else {
            const std::size_t half = size / 2;
            const std::array quarters = {visit(y, x, half), visit(y, x + half, half), visit(y + half, x, half),
                                         visit(y + half, x + half, half)};
            extent = merge(merge(quarters[0], quarters[1]), merge(quarters[2], quarters[3]));
        }
        const double mean = extent.sum / static_cast<double>(size * size);
        if (extent.max > 0.0f && (size == 1 || is_even(extent, mean))) {
            m_squares.resize(before);
            m_squares.push_back({y, x, size, mean});
        }
        return extent;
    }

private:
    Extent texel(std::size_t y, std::size_t x) const
    {
        const float value = m_light.irradiance(y, x);
        const Vec3f direction(value > 0.0f ? glm::normalize(travel_at(m_plane, m_light.directions, y, x)) : Vec3(0.0));
        return {value, value, static_cast<double>(value), direction, direction};
    }

    bool is_even(const Extent& extent, double mean) const
    {
        const double allowed = m_tolerance * static_cast<double>(extent.min);
        return extent.min > 0.0f && static_cast<double>(extent.max) - mean <= allowed &&
               mean - static_cast<double>(extent.min) <= allowed &&
               static_cast<double>(glm::length(extent.max_direction - extent.min_direction)) <= m_tolerance / 20.0;
    }

    const Plane& m_plane;
    const PlaneLight& m_light;
    double m_tolerance;
    std::vector<Square>& m_squares;
};

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
            lights.push_back({medium.ldf->profile(angle_deg(most_grazing), medium.albedo, medium.side), power});
    return lights;
}

}  // namespace

std::vector<Square> even_squares(const Plane& plane, const PlaneLight& light, double tolerance)
{
    std::vector<Square> squares;
    Search(plane, light, tolerance, squares).visit(0, 0, std::bit_ceil(std::max(plane.height, plane.width)));
    return squares;
}

Grid take_steps(Grid& light, const std::vector<Square>& squares)
{
    Grid steps(light.height + 1, light.width + 1);
    for (const Square& square : squares) {
        // Sum differences from the first texel: the mean of even light is then exact.
        const double first = light.row(square.y)[square.x];
        double sum = 0.0;
        for (std::size_t y = square.y; y < square.y + square.size; ++y) {
            for (std::size_t x = square.x; x < square.x + square.size; ++x)
                sum += light.row(y)[x] - first;
            std::fill_n(light.row(y) + square.x, square.size, 0.0);
        }
        const double mean = first + sum / static_cast<double>(square.size * square.size);
        steps.row(square.y)[square.x] += mean;
        steps.row(square.y)[square.x + square.size] -= mean;
        steps.row(square.y + square.size)[square.x] -= mean;
        steps.row(square.y + square.size)[square.x + square.size] += mean;
    }
    return steps;
}

KernelTable step_kernel(const Grid& kernel)
{
    KernelTable sums((kernel.height + 1) / 2, (kernel.width + 1) / 2);
    for (std::size_t y = 0; y < kernel.height; ++y) {
        const std::ptrdiff_t dy = static_cast<std::ptrdiff_t>(y) + 1 - sums.reach_y();
        const double* below = sums.row(dy - 1) + 1 - sums.reach_x();
        double* row = sums.row(dy) + 1 - sums.reach_x();
        double row_sum = 0.0;
        for (std::size_t x = 0; x < kernel.width; ++x) {
            row_sum += kernel.row(y)[x];
            row[x] = row_sum + below[x];
        }
    }
    return sums;
}

std::vector<Square> beam_squares(const Plane& plane, const PlaneLight& light, double tolerance)
{
    return even_squares(plane, light, tolerance_share * tolerance);
}

std::vector<double> solve_adaptive(const Plane& plane, const PlaneLight& light, const ChannelMedium& medium,
                                   double tolerance, Progress& progress)
{
    const std::size_t width = plane.width;
    const std::size_t height = plane.height;
    const double pitch_y = plane.pitch_y / medium.mean_free_path;
    const double pitch_x = plane.pitch_x / medium.mean_free_path;
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
    std::vector<KernelIntegrals> integrals = kernel_integrals(terms);
    const double tried = tried_radius(terms, integrals, light, squares, wide, pitch_y, pitch_x, near,
                                      tolerance_share * tolerance, progress);
    TermSums texel_sums(terms, integrals, grid_levels(height, width, pitch_y, pitch_x, tried));
    // The kernel of wide beams is the light that one texel spreads to all offsets, on the same levels.
    TermSums kernel_sums(terms, integrals, grid_levels(2 * height - 1, 2 * width - 1, pitch_y, pitch_x, near),
                         LitTexels::middle);

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
