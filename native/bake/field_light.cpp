#include "bake/field_light.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/threads.h"

namespace beamspread {

namespace {

// Texels whose surroundings are lit by less than this fraction stay darker. Larger: darker beside things that stand on
// the plane.
constexpr float min_lit_fraction = 0.5f;

// Weights of the nodes along one axis at the center of a texel.
struct NodeWeights {
    std::size_t first = 0;
    std::vector<float> weights;
};

// Weights of a uniform cubic B-spline with `nodes` coefficients evenly spread over `texels` texels. The spline averages
// noise. Beyond the first and last node it goes on in a straight line, so that linear functions stay linear.
std::vector<NodeWeights> spline_weights(std::size_t texels, std::size_t nodes)
{
    const auto last = static_cast<std::ptrdiff_t>(nodes) - 1;
    const std::ptrdiff_t neighbor = std::min<std::ptrdiff_t>(1, last);
    std::vector<NodeWeights> result(texels);
    for (std::size_t i = 0; i < texels; ++i) {
        const double position =
            (static_cast<double>(i) + 0.5) * static_cast<double>(nodes) / static_cast<double>(texels) - 0.5;
        const double below = std::floor(position);
        const double t = position - below;
        const std::array<double, 4> basis = {(1 - t) * (1 - t) * (1 - t) / 6, (3 * t * t * t - 6 * t * t + 4) / 6,
                                             (-3 * t * t * t + 3 * t * t + 3 * t + 1) / 6, t * t * t / 6};
        std::vector<double> weights(nodes);
        const auto add = [&](std::ptrdiff_t node, double weight) { weights[static_cast<std::size_t>(node)] += weight; };
        for (std::ptrdiff_t k = 0; k < 4; ++k) {
            const std::ptrdiff_t node = static_cast<std::ptrdiff_t>(below) - 1 + k;
            const double weight = basis[static_cast<std::size_t>(k)];
            if (node < 0) {
                const auto outside = static_cast<double>(-node);
                add(0, (1 + outside) * weight);
                add(neighbor, -outside * weight);
            } else if (node > last) {
                const auto outside = static_cast<double>(node - last);
                add(last, (1 + outside) * weight);
                add(last - neighbor, -outside * weight);
            } else {
                add(node, weight);
            }
        }
        const auto is_used = [](double weight) { return weight != 0.0; };
        const auto begin = std::ranges::find_if(weights, is_used);
        const auto end = std::find_if(weights.rbegin(), weights.rend(), is_used).base();
        result[i].first = static_cast<std::size_t>(begin - weights.begin());
        result[i].weights.assign(begin, std::max(begin, end));
    }
    return result;
}

}  // namespace

// One row of texels: nodes are interpolated along y first, then along x.
class FieldLight::Row {
public:
    // `values` is [row][column][channel] at nodes. Writes [texel][channel].
    void interpolate(const float* values, std::size_t columns, std::size_t channels, const NodeWeights& up,
                     const std::vector<NodeWeights>& across, std::vector<float>& at_texels)
    {
        m_nodes.assign(columns * channels, 0.0f);
        for (std::size_t k = 0; k < up.weights.size(); ++k)
            for (std::size_t i = 0; i < m_nodes.size(); ++i)
                m_nodes[i] += up.weights[k] * values[(up.first + k) * m_nodes.size() + i];
        at_texels.assign(across.size() * channels, 0.0f);
        for (std::size_t x = 0; x < across.size(); ++x)
            for (std::size_t k = 0; k < across[x].weights.size(); ++k)
                for (std::size_t c = 0; c < channels; ++c)
                    at_texels[x * channels + c] += across[x].weights[k] * m_nodes[(across[x].first + k) * channels + c];
    }

    std::vector<float> lit_fraction, radiance;
    std::vector<Vec3f> irradiance, travel;

private:
    std::vector<float> m_nodes;
};

FieldLight::FieldLight(const float* radiance, std::size_t rows, std::size_t columns, std::span<const Lobe> lobes)
    : m_rows(rows), m_columns(columns), m_is_lit(rows * columns)
{
    const std::size_t size = 3 * rows * columns;
    for (std::size_t i = 0; i < lobes.size(); ++i) {
        const float* values = radiance + i * size;
        if (std::all_of(values, values + size, [](float value) { return value == 0.0f; }))
            continue;
        m_lobes.push_back(lobes[i]);
        m_radiance.insert(m_radiance.end(), values, values + size);
        for (std::size_t k = 0; k < size; ++k)
            if (values[k] != 0.0f)
                m_is_lit[k / 3] = 1.0f;
    }
}

FieldLight::FieldLight(const float* radiance, std::size_t rows, std::size_t columns, float solid_angle,
                       const Vec3& position)
    : FieldLight(radiance, rows, columns, std::array{Lobe{.solid_angle = solid_angle}})
{
    m_position = position;
}

Directions FieldLight::directions(std::size_t lobe) const
{
    if (m_position)
        return FromPoint{*m_position};
    return OneDirection{Vec3(m_lobes[lobe].travel)};
}

void FieldLight::gather(const ReceiverGrid& grid, int threads, RaySink& sink, Progress& progress) const
{
    const Plane plane{grid.width, grid.height, grid.pitch_x, grid.pitch_y};
    const std::vector<NodeWeights> up = spline_weights(grid.height, m_rows);
    const std::vector<NodeWeights> across = spline_weights(grid.width, m_columns);
    PerThread<Row> rows;
    progress.set_total(static_cast<double>(grid.height));
    const auto gather_row = [&](std::size_t y) {
        Row& row = rows.local();
        // Fraction of the surroundings that any light reaches: nodes inside things that stand on the plane don't count.
        row.interpolate(m_is_lit.data(), m_columns, 1, up[y], across, row.lit_fraction);
        row.irradiance.resize(grid.width);
        row.travel.resize(grid.width);
        for (std::size_t i = 0; i < m_lobes.size(); ++i) {
            // Irradiance of the lobe.
            row.interpolate(m_radiance.data() + i * 3 * m_rows * m_columns, m_columns, 3, up[y], across, row.radiance);
            for (std::size_t x = 0; x < grid.width; ++x) {
                const Vec3f radiance(row.radiance[3 * x], row.radiance[3 * x + 1], row.radiance[3 * x + 2]);
                row.irradiance[x] = glm::max(radiance / std::max(row.lit_fraction[x], min_lit_fraction), Vec3f(0.0f)) *
                                    m_lobes[i].solid_angle;
                row.travel[x] =
                    m_position ? Vec3f(glm::normalize(travel_at(plane, directions(i), y, x))) : m_lobes[i].travel;
            }
            sink.add({.sample = y * grid.width,
                      .count = grid.width,
                      .ray = i,
                      .travel = row.travel.data(),
                      .irradiance = row.irradiance.data()});
        }
        progress.advance(1.0);
    };
    with_threads(threads, [&] { parallel_for(grid.height, gather_row); });
    progress.finish();
}

}  // namespace beamspread
