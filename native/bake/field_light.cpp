#include "bake/field_light.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "base/error.h"
#include "base/threads.h"
#include "scene/bent_nodes.h"
#include "simd/loops.h"

namespace beamspread {

namespace {

// Texels whose surroundings are lit by less than this fraction stay darker. Larger: darker beside things that stand on
// the plane.
constexpr float min_lit_fraction = 0.5f;

}  // namespace

// Part of a row of texels.
class FieldLight::Row {
public:
    void start(const NodeSpline& spline, const RowSpan& span, const std::vector<float>& is_lit)
    {
        m_spline = &spline;
        m_span = span;
        for (std::vector<float>* values : {&factor, &m_values[0], &m_values[1], &m_values[2]})
            values->resize(span.width);
        read(is_lit, factor);
        for (float& value : factor)
            value = 1.0f / std::max(value, min_lit_fraction);
    }

    const std::vector<float>& read(const std::vector<float>& coefficients)
    {
        read(coefficients, m_values[0]);
        return m_values[0];
    }

    // Reads the irradiance of three channels. Beyond the outermost nodes the spline may fall below 0.
    void read_irradiance(const std::vector<float>* coefficients)
    {
        for (std::size_t c = 0; c < 3; ++c)
            read(coefficients[c], m_values[c]);
        irradiance.resize(m_span.width);
        for (std::size_t x = 0; x < m_span.width; ++x)
            irradiance[x] = factor[x] * glm::max(Vec3f(m_values[0][x], m_values[1][x], m_values[2][x]), Vec3f(0.0f));
    }

    // Light of all surroundings over that of the part which any light reaches: nodes inside things that stand on the
    // plane don't count.
    std::vector<float> factor;
    std::vector<Vec3f> irradiance, travel;
    std::array<std::vector<float>, 3> received;

private:
    void read(const std::vector<float>& coefficients, std::vector<float>& values)
    {
        m_spline->row(m_span.y, m_span.x, m_span.x + m_span.width, coefficients.data(), m_scratch, values.data());
    }

    const NodeSpline* m_spline = nullptr;
    RowSpan m_span{};
    std::array<std::vector<float>, 3> m_values;
    std::vector<float> m_scratch;
};

FieldLight::FieldLight(const float* radiance, std::size_t rows, std::size_t columns, std::span<const Lobe> lobes)
    : m_rows(rows), m_columns(columns)
{
    const std::size_t size = 3 * rows * columns;
    std::vector<float> is_lit(rows * columns);
    std::vector<float> irradiance(size);
    for (std::size_t i = 0; i < lobes.size(); ++i) {
        const float* values = radiance + i * size;
        if (std::all_of(values, values + size, [](float value) { return value == 0.0f; }))
            continue;
        m_lobes.push_back(lobes[i]);
        scale(irradiance.data(), values, lobes[i].solid_angle, size);
        for (std::size_t c = 0; c < 3; ++c)
            m_irradiance.push_back(NodeSpline::coefficients(irradiance.data() + c, 3, rows, columns));
        for (std::size_t k = 0; k < size; ++k)
            if (values[k] != 0.0f)
                is_lit[k / 3] = 1.0f;
    }
    m_is_lit = NodeSpline::coefficients(is_lit.data(), 1, rows, columns);
}

FieldLight::FieldLight(const float* radiance, std::size_t rows, std::size_t columns, float solid_angle,
                       const Vec3& position)
    : FieldLight(radiance, rows, columns, std::array{Lobe{.solid_angle = solid_angle}})
{
    m_position = position;
}

FieldLight::FieldLight(const float* radiance, NodeCloud nodes, std::span<const Lobe> lobes)
    : m_lobes(lobes.begin(), lobes.end()),
      m_cloud(std::move(nodes)),
      m_cloud_irradiance(m_cloud->size() * lobes.size()),
      m_cloud_is_lit(m_cloud->size())
{
    for (std::size_t i = 0; i < m_cloud->size(); ++i)
        for (std::size_t k = 0; k < lobes.size(); ++k) {
            const float* value = radiance + 3 * (k * m_cloud->size() + i);
            const Vec3f light(value[0], value[1], value[2]);
            m_cloud_irradiance[i * lobes.size() + k] = light * lobes[k].solid_angle;
            m_cloud_is_lit[i] |= light != Vec3f(0.0f);
        }
}

Directions FieldLight::directions(std::size_t lobe) const
{
    if (m_position)
        return FromPoint{*m_position};
    return OneDirection{Vec3(m_lobes[lobe].travel)};
}

void FieldLight::gather(const ReceiverGrid& grid, int threads, bool all, RaySink& sink, Progress& progress) const
{
    if (grid.is_bent() != m_cloud.has_value())
        reject("light", m_cloud ? "at the nodes of a mesh" : "at nodes of a plane", "nodes like the surface");
    if (m_cloud) {
        gather_bent(grid, threads, sink, progress);
        return;
    }
    const NodeSpline nodes = spline(grid);
    const auto [top, bottom] = all ? std::pair(grid.height, grid.height) : nodes.inner_rows();
    const auto [left, right] = all ? std::pair(grid.width, grid.width) : nodes.inner_columns();
    PerThread<Row> rows;
    progress.set_total(static_cast<double>(grid.height));
    const auto gather_row = [&, top = top, bottom = bottom, left = left, right = right](std::size_t y) {
        if (y < top || y >= bottom) {
            gather_part(grid, nodes, {y, 0, grid.width}, rows.local(), sink);
        } else {
            gather_part(grid, nodes, {y, 0, left}, rows.local(), sink);
            gather_part(grid, nodes, {y, right, grid.width - right}, rows.local(), sink);
        }
        progress.advance(1.0);
    };
    with_threads(threads, [&] { parallel_for(grid.height, gather_row); });
    progress.finish();
}

// Light at a texel is the mean of the nodes around it.
void FieldLight::gather_bent(const ReceiverGrid& grid, int threads, RaySink& sink, Progress& progress) const
{
    struct Scratch {
        NodeCloud::Weights weights;
        std::vector<Vec3f> irradiance, travel;  // [lobe][texel]
    };
    PerThread<Scratch> scratches;
    const std::size_t count = m_lobes.size();
    const auto gather_texel = [&](std::size_t y, std::size_t x, Scratch& scratch) {
        const BentTexel& texel = grid.bent_texel(y * grid.width + x);
        if (!texel.is_inside())
            return;
        const Vec3 normal(texel.normal);
        m_cloud->find(texel.position, normal, node_reach * m_cloud->spacing(), scratch.weights);
        float lit = 0.0f;
        for (const auto& [node, weight] : scratch.weights) {
            lit += m_cloud_is_lit[node] ? weight : 0.0f;
            for (std::size_t k = 0; k < count; ++k)
                scratch.irradiance[k * grid.width + x] += weight * m_cloud_irradiance[node * count + k];
        }
        const float factor = 1.0f / std::max(lit, min_lit_fraction);
        const FieldFrame frame(normal);
        for (std::size_t k = 0; k < count; ++k) {
            scratch.irradiance[k * grid.width + x] *= factor;
            scratch.travel[k * grid.width + x] = Vec3f(texel.to_tangent(frame.to_world(Vec3(m_lobes[k].travel))));
        }
    };
    progress.set_total(static_cast<double>(grid.height));
    const auto gather_row = [&](std::size_t y) {
        Scratch& scratch = scratches.local();
        scratch.irradiance.assign(count * grid.width, Vec3f(0.0f));
        scratch.travel.assign(count * grid.width, Vec3f(0.0f, 0.0f, -1.0f));
        for (std::size_t x = 0; x < grid.width; ++x)
            gather_texel(y, x, scratch);
        for (std::size_t k = 0; k < count; ++k)
            sink.add({.sample = y * grid.width,
                      .count = grid.width,
                      .ray = k,
                      .travel = &scratch.travel[k * grid.width],
                      .irradiance = &scratch.irradiance[k * grid.width]});
        progress.advance(1.0);
    };
    with_threads(threads, [&] { parallel_for(grid.height, gather_row); });
    progress.finish();
}

void FieldLight::gather_part(const ReceiverGrid& grid, const NodeSpline& nodes, const RowSpan& span, Row& row,
                             RaySink& sink) const
{
    if (span.width == 0)
        return;
    const Plane plane{grid.width, grid.height, grid.pitch_x, grid.pitch_y};
    row.start(nodes, span, m_is_lit);
    row.travel.resize(span.width);
    for (std::size_t i = 0; i < m_lobes.size(); ++i) {
        row.read_irradiance(&irradiance(i, 0));
        for (std::size_t x = 0; x < span.width; ++x)
            row.travel[x] = m_position ? Vec3f(glm::normalize(travel_at(plane, directions(i), span.y, span.x + x)))
                                       : m_lobes[i].travel;
        sink.add({.sample = span.y * grid.width + span.x,
                  .count = span.width,
                  .ray = i,
                  .travel = row.travel.data(),
                  .irradiance = row.irradiance.data()});
    }
}

void FieldLight::add_inner_moments(const Surface& surface, const Texel& place, const std::vector<double>& color,
                                   int threads, LightField& field, Progress& progress) const
{
    const std::size_t width = surface.grid.width;
    const NodeSpline nodes = spline(surface.grid);
    std::vector<Vec3f> travel;
    for (const Lobe& lobe : m_lobes)
        travel.push_back(lobe.travel);
    const std::vector<float> factors = field.moment_factors(travel, color);
    std::vector<std::vector<float>> moments(field.terms());  // coefficients; empty: none
    const auto add_lobes = [&](std::size_t term) {
        for (std::size_t i = 0; i < m_lobes.size(); ++i) {
            const float factor = factors[term * m_lobes.size() + i];
            if (factor == 0.0f)
                continue;
            moments[term].resize(m_is_lit.size());
            add_scaled(moments[term].data(), irradiance(i, field.channel(term)).data(), factor, m_is_lit.size());
        }
    };
    const auto [top, bottom] = nodes.inner_rows();
    const auto [left, right] = nodes.inner_columns();
    const RowSpan inner{0, left, right - left};
    PerThread<Row> rows;
    const auto add_row = [&, top = top](std::size_t i) {
        Row& row = rows.local();
        RowSpan span = inner;
        span.y = top + i;
        const std::size_t first = span.y * width + span.x;
        row.start(nodes, span, m_is_lit);
        if (surface.coverage)
            multiply(row.factor.data(), row.factor.data(), surface.coverage + first, span.width);
        std::array<std::vector<float>, 3>& received = row.received;  // [channel]
        for (std::size_t c = 0; c < 3; ++c) {
            received[c] = row.factor;
            for (std::size_t x = 0; x < span.width && surface.color_in; ++x)
                received[c][x] *= surface.color_in[3 * (first + x) + c];
        }
        for (std::size_t term = 0; term < moments.size(); ++term)
            if (!moments[term].empty())
                field.add_moments(term, {place.y + span.y, place.x + span.x, span.width},
                                  received[field.channel(term)].data(), row.read(moments[term]).data());
        progress.advance(1.0);
    };
    progress.set_total(static_cast<double>(bottom - top));
    with_threads(threads, [&, top = top, bottom = bottom] {
        parallel_for(moments.size(), add_lobes);
        parallel_for(bottom - top, add_row);
    });
    progress.finish();
}

SmoothLight FieldLight::smooth_light(const std::vector<double>& color) const
{
    const NodeSpline at_nodes(m_rows, m_columns, m_rows, m_columns);
    const std::size_t nodes = m_rows * m_columns;
    const std::size_t count = m_lobes.size();
    std::vector<double> products(count * count);
    std::vector<float> scratch;
    std::vector<float> lit(nodes);
    const auto read = [&](const std::vector<float>& coefficients, float* values) {
        for (std::size_t y = 0; y < m_rows; ++y)
            at_nodes.row(y, 0, m_columns, coefficients.data(), scratch, values + y * m_columns);
    };
    read(m_is_lit, lit.data());
    std::vector<float> values(count * nodes);
    for (std::size_t c = 0; c < 3; ++c) {
        for (std::size_t i = 0; i < count; ++i) {
            read(irradiance(i, c), values.data() + i * nodes);
            for (std::size_t k = 0; k < nodes; ++k)
                values[i * nodes + k] /= std::max(lit[k], min_lit_fraction);
        }
        for (std::size_t i = 0; i < count; ++i)
            for (std::size_t j = 0; j <= i; ++j) {
                double sum = 0.0;
                for (std::size_t k = 0; k < nodes; ++k)
                    sum += static_cast<double>(values[i * nodes + k]) * static_cast<double>(values[j * nodes + k]);
                products[i * count + j] += color[c] * color[c] * sum / (3.0 * static_cast<double>(nodes));
                products[j * count + i] = products[i * count + j];
            }
    }
    std::vector<Vec3f> travel;
    for (const Lobe& lobe : m_lobes)
        travel.push_back(lobe.travel);
    return {travel, products};
}

}  // namespace beamspread
