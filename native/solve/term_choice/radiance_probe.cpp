#include "solve/term_choice/radiance_probe.h"

#include <array>
#include <cmath>
#include <cstdlib>

#include "base/random.h"

namespace beamspread {

namespace {

// Cells of 3^this texels, and larger ones, look the same from everywhere on a site.
constexpr std::size_t far_size = 3;

// The light of a cell is that of one texel from each of so many parts along its sides: of near cells the one in the
// middle of the part, which makes those of 3 x 3 texels exact; of far ones any, as patterns may repeat from part to part.
constexpr std::size_t near_parts = 3;
constexpr std::size_t far_parts = 4;

struct Beam {
    float irradiance = 0.0f;  // of its share of the cell
    Vec2 toward{1.0, 0.0};    // azimuth of travel, a unit vector
    Vec2 to_texel{1.0, 0.0};  // of the way to the texel that is looked at
    float half_tangent = 0.0f;

    // Cosine and sine of the angle between the two.
    Vec2 between() const
    {
        return {toward.x * to_texel.x + toward.y * to_texel.y, toward.x * to_texel.y - toward.y * to_texel.x};
    }
};

Vec2 unit(const Vec2& v)
{
    const double length_squared = glm::dot(v, v);
    return length_squared > 0.0 ? v / std::sqrt(length_squared) : Vec2(1.0, 0.0);
}

}  // namespace

// A square of texels as the texel that is looked at sees it.
struct RadianceProbe::Cell {
    Cell(const Plane& plane, const Texel& texel, std::size_t of_size, std::ptrdiff_t dy, std::ptrdiff_t dx,
         Random& random)
        : size(of_size),
          cells_y(static_cast<std::size_t>(std::abs(dy))),
          cells_x(static_cast<std::size_t>(std::abs(dx))),
          above(dy > 0),
          right(dx > 0)
    {
        std::ptrdiff_t side = 1;
        for (std::size_t i = 0; i < size; ++i)
            side *= 3;
        const std::ptrdiff_t y0 = static_cast<std::ptrdiff_t>(texel.y) + dy * side - (side - 1) / 2;
        const std::ptrdiff_t x0 = static_cast<std::ptrdiff_t>(texel.x) + dx * side - (side - 1) / 2;
        const auto height = static_cast<std::ptrdiff_t>(plane.height);
        const auto width = static_cast<std::ptrdiff_t>(plane.width);
        if (y0 >= height || x0 >= width || y0 + side <= 0 || x0 + side <= 0)
            return;
        const std::size_t parts = size == 0 ? 1 : size < far_size ? near_parts : far_parts;
        weight = static_cast<float>(side * side) / static_cast<float>(parts * parts);
        for (std::size_t i = 0; i < parts * parts; ++i) {
            const auto within = [&](std::size_t part) {
                const double offset = size < far_size ? 0.5 : random.uniform();
                const double place = (static_cast<double>(part) + offset) / static_cast<double>(parts);
                return static_cast<std::ptrdiff_t>(place * static_cast<double>(side));
            };
            const std::ptrdiff_t y = y0 + within(i / parts);
            const std::ptrdiff_t x = x0 + within(i % parts);
            if (y < 0 || x < 0 || y >= height || x >= width)
                continue;
            ways[count] = {static_cast<double>(static_cast<std::ptrdiff_t>(texel.x) - x) * plane.pitch_x,
                           static_cast<double>(static_cast<std::ptrdiff_t>(texel.y) - y) * plane.pitch_y};
            texels[count++] = {static_cast<std::size_t>(y), static_cast<std::size_t>(x)};
        }
    }

    std::size_t size;
    std::size_t cells_y;
    std::size_t cells_x;
    bool above;  // of the texel, so that kernels are mirrored
    bool right;
    float weight = 0.0f;  // of each texel
    std::size_t count = 0;
    std::array<Texel, far_parts * far_parts> texels{};
    std::array<Vec2, far_parts * far_parts> ways{};  // from them
};

// Sums over the light of a cell, rows of a set: irradiance times u(theta), times cos(m beta), sin(m beta), or for light
// whose direction turns with the way to the texel cos(m (phi - beta)).
struct RadianceProbe::Moments {
    Moments(std::size_t sets, const ProbeTables& tables)
        : row(tables.row_size()), cos_m(tables.harmonics()), sin_m(tables.harmonics())
    {
        for (AlignedVector<float>& kernel : sums)
            kernel.resize(sets * row);
    }

    std::size_t row;
    std::array<AlignedVector<float>, ProbeTables::kernels> sums;
    std::array<bool, ProbeTables::kernels> is_lit{};
    AlignedVector<float> cos_m;  // of one beam
    AlignedVector<float> sin_m;
};

RadianceProbe::RadianceProbe(const LightTerms& light, std::vector<std::size_t> lights, const LowRankBasis& basis)
    : m_light(light), m_lights(std::move(lights)), m_tables(basis, light.plane)
{
}

std::vector<std::vector<float>> RadianceProbe::read(std::span<const Texel> site) const
{
    const std::size_t row = m_tables.row_size();
    const std::size_t results = m_light.sets.results.size();
    const std::size_t near = std::min(far_size, m_tables.sizes());
    Moments moments(m_light.sets.count(), m_tables);
    AlignedVector<float> far(results * row);
    add_cells(site[site.size() / 2], near, m_tables.sizes(), moments, far);
    std::vector<std::vector<float>> parts;
    for (const Texel& texel : site) {
        AlignedVector<float> sums = far;
        add_cells(texel, 0, near, moments, sums);
        parts.emplace_back();
        for (std::size_t r = 0; r < results; ++r)
            for (const std::size_t place : m_tables.places())
                parts.back().push_back(sums[r * row + place]);
    }
    return parts;
}

void RadianceProbe::add_cells(const Texel& texel, std::size_t first_size, std::size_t end_size, Moments& moments,
                              AlignedVector<float>& sums) const
{
    constexpr auto reach = static_cast<std::ptrdiff_t>(cell_reach);
    Random random(first_size, texel.y, texel.x);
    for (std::size_t size = first_size; size < end_size; ++size)
        for (std::ptrdiff_t dy = -reach; dy <= reach; ++dy)
            for (std::ptrdiff_t dx = -reach; dx <= reach; ++dx) {
                const auto cells_y = static_cast<std::size_t>(std::abs(dy));
                const auto cells_x = static_cast<std::size_t>(std::abs(dx));
                if ((size == 0 || std::max(cells_y, cells_x) > 1) && !m_tables.out_of_reach(size, cells_y, cells_x))
                    add_cell(Cell(m_light.plane, texel, size, dy, dx, random), moments, sums);
            }
}

void RadianceProbe::add_cell(const Cell& cell, Moments& moments, AlignedVector<float>& sums) const
{
    if (cell.count == 0)
        return;
    for (std::size_t k = 0; k < moments.sums.size(); ++k)
        if (std::exchange(moments.is_lit[k], false))
            std::fill(moments.sums[k].begin(), moments.sums[k].end(), 0.0f);
    for (const std::size_t light : m_lights)
        add_light(cell, light, moments);
    for (std::size_t r = 0; r < m_light.sets.results.size(); ++r) {
        const ChannelSets::Result& result = m_light.sets.results[r];
        for (std::size_t k = 0; k < moments.sums.size(); ++k)
            if (moments.is_lit[k])
                add_products(sums.data() + r * moments.row, moments.sums[k].data() + result.set * moments.row,
                             m_tables.kernel(cell.size, cell.cells_y, cell.cells_x, result.medium,
                                             static_cast<ProbeTables::Kernel>(k)),
                             moments.row);
    }
}

void RadianceProbe::add_light(const Cell& cell, std::size_t number, Moments& moments) const
{
    const PlaneLight& light = m_light.changing[number];
    std::array<Beam, far_parts * far_parts> beams;
    std::size_t lit = 0;
    Vec2 toward(0.0);  // sums over the beams, weighed by irradiance
    Vec2 between(0.0);
    for (std::size_t i = 0; i < cell.count; ++i) {
        const auto& [y, x] = cell.texels[i];
        const float irradiance = light.irradiance(y, x);
        if (irradiance == 0.0f)
            continue;
        const Vec3 travel = travel_at(m_light.plane, light.directions, y, x);
        const double across = std::sqrt(travel.x * travel.x + travel.y * travel.y);
        Beam& beam = beams[lit++];
        beam = {irradiance * cell.weight, unit(Vec2(travel)), unit(cell.ways[i]),
                static_cast<float>(across / (glm::length(travel) - travel.z))};
        toward += static_cast<double>(irradiance) * beam.toward;
        between += static_cast<double>(irradiance) * beam.between();
    }
    if (lit == 0)
        return;
    // Where all beams of a cell travel toward or away from the texel, as below a lamp, their harmonics add up however
    // much the direction turns.
    const bool turns_along = cell.size > 0 && glm::dot(between, between) > glm::dot(toward, toward);
    moments.is_lit[ProbeTables::cosine] |= !turns_along;
    moments.is_lit[ProbeTables::sine] |= !turns_along;
    moments.is_lit[ProbeTables::radial] |= turns_along;
    const std::vector<std::size_t>& columns = m_tables.columns();
    for (std::size_t i = 0; i < lit; ++i) {
        const Beam& beam = beams[i];
        const float* by_angle = m_tables.at_half_tangent(beam.half_tangent);
        // phi -> pi - phi where the texel lies to the left of the light, and phi -> -phi where below.
        const Vec2 mirrored(cell.right ? -beam.toward.x : beam.toward.x, cell.above ? -beam.toward.y : beam.toward.y);
        const Vec2 angle = turns_along ? beam.between() : mirrored;
        for (std::size_t set = 0; set < m_light.sets.count(); ++set) {
            multiple_angles(moments.cos_m.data(), moments.sin_m.data(), static_cast<float>(angle.x),
                            static_cast<float>(angle.y), beam.irradiance * m_light.colors[number][set],
                            moments.cos_m.size());
            const auto add = [&](ProbeTables::Kernel kernel, const AlignedVector<float>& multiples) {
                add_harmonics(moments.sums[kernel].data() + set * moments.row, by_angle, multiples.data(),
                              columns.data(), columns.size());
            };
            add(turns_along ? ProbeTables::radial : ProbeTables::cosine, moments.cos_m);
            if (!turns_along)
                add(ProbeTables::sine, moments.sin_m);
        }
    }
}

}  // namespace beamspread
