#include "solve/surface/uneven_sample.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/constants.h"

namespace beamspread {

namespace {

// Sectors of the azimuth, in whose middles the end of the surface is looked for. More: surer at open edges, more time.
constexpr std::size_t sectors = 16;

// Width of the window in which disks are compared with the surface, in sides of a texel. Wider: more of the kernel; beyond
// `near_sides` nothing is known.
constexpr float window_width = 0.7f;

// Least cosine of the normals of samples that count as one surface.
constexpr float least_facing = -0.2f;

float window(float radius)
{
    const float half_square = 0.5f * radius * radius;
    return (1.0f + half_square) * std::exp(-half_square);
}

// Largest coordinate of a direction, over sides of a parallelogram, that counts as along one of its sides.
constexpr float least_step = 1e-6f;

// The area of a sample in the tangent plane of the uneven one, which is the origin.
class Parallelogram {
public:
    Parallelogram(const Vec2f& middle, const Vec2f& across, const Vec2f& along)
        : m_middle(middle), m_radius(glm::length(across) + glm::length(along))
    {
        const float area = across.x * along.y - across.y * along.x;
        if (area == 0.0f)
            return;
        m_coordinates = {Vec2f(along.y, -along.x) / area, Vec2f(-across.y, across.x) / area};
    }

    // Distance from the origin along a unit vector to where it leaves; 0 if it misses.
    float exit(const Vec2f& way) const
    {
        const float beside = way.x * m_middle.y - way.y * m_middle.x;
        if (std::abs(beside) > m_radius || glm::dot(way, m_middle) < -m_radius)
            return 0.0f;
        float enters = 0.0f;
        float leaves = std::numeric_limits<float>::max();
        for (const Vec2f& coordinate : m_coordinates) {
            const float at = -glm::dot(coordinate, m_middle);
            const float step = m_radius * glm::dot(coordinate, way);
            const float per_step = m_radius / (std::abs(step) > least_step ? step : least_step);
            const float a = (-0.5f - at) * per_step;
            const float b = (0.5f - at) * per_step;
            enters = std::max(enters, std::min(a, b));
            leaves = std::min(leaves, std::max(a, b));
        }
        return leaves > enters ? leaves : 0.0f;
    }

private:
    Vec2f m_middle;
    float m_radius;  // within which it lies
    std::array<Vec2f, 2> m_coordinates{};  // over its sides, -1/2 to 1/2 inside; 0 without an area
};

// A near sample as the uneven one sees it: on its tangent plane, at its chord.
struct Seen {
    Vec2f way;  // unit vector
    float chord;
    float disk;
    float count;  // the sample's area over that of the disk
};

struct TangentFrame {
    explicit TangentFrame(const UnevenSample& sample)
        : normal(sample.normal), tangent(sample.tangent), binormal(glm::cross(sample.normal, sample.tangent))
    {
    }

    Vec2f operator()(const Vec3f& vector) const { return {glm::dot(vector, tangent), glm::dot(vector, binormal)}; }

    // A vector of a plane with this normal after the turn to the frame's own plane.
    Vec2f turned(const Vec3f& vector, const Vec3f& from) const
    {
        const Vec3f sum = from + normal;
        return (*this)(vector - sum * (glm::dot(normal, vector) / (1.0f + glm::dot(normal, from))));
    }

    Vec3f normal, tangent, binormal;
};

// Integrals over an arc on both sides of a direction, times a weight. `cosine`: of half of the arc.
void add_arc(RingIntegrals& sums, const Vec2f& way, float cosine, float weight)
{
    const float half = std::acos(cosine);
    const float sine = std::sqrt(std::max(0.0f, 1.0f - cosine * cosine));
    const float twice = sine * cosine;
    static_assert(uneven_harmonics == 3);
    sums[0] += weight * 2.0f * half;
    sums[2] += weight * 2.0f * sine * way.x;
    sums[3] += weight * 2.0f * sine * way.y;
    sums[4] += weight * 2.0f * twice * (way.x * way.x - way.y * way.y);
    sums[5] += weight * 2.0f * twice * (2.0f * way.x * way.y);
}

// A part of the azimuth.
struct Sector {
    Vec2f way;  // its middle
    RingIntegrals whole;  // of light that comes from there
};

const std::array<Sector, sectors>& all_sectors()
{
    static const std::array<Sector, sectors> all = [] {
        std::array<Sector, sectors> made{};
        const double width = 2.0 * pi / static_cast<double>(sectors);
        for (std::size_t i = 0; i < sectors; ++i) {
            const double turn = width * (static_cast<double>(i) + 0.5);
            made[i].way = {static_cast<float>(std::cos(turn)), static_cast<float>(std::sin(turn))};
            add_arc(made[i].whole, -made[i].way, static_cast<float>(std::cos(0.5 * width)), 1.0f);
        }
        return made;
    }();
    return all;
}

class Rings {
public:
    // From a chord step to another one.
    Rings(std::uint32_t first, std::uint32_t last) : m_first(first)
    {
        if (last > first)
            m_left.resize((last - first) / steps_per_ring);
    }

    // Adds the surface of a sector, from the middle to an end.
    void add(const Sector& sector, float end)
    {
        const std::size_t last = ring_of(end);
        for (std::size_t ring = 0; ring < last; ++ring)
            add(ring, sector.whole, 1.0f);
        if (last < m_left.size())
            add(last, sector.whole, std::clamp((end - inner(last)) / (inner(last + 1) - inner(last)), 0.0f, 1.0f));
    }

    void subtract(const Seen& disk)
    {
        const float chord = disk.chord;
        const std::size_t last = ring_of(chord + disk.disk);
        for (std::size_t ring = ring_of(chord - disk.disk); ring <= last && ring < m_left.size(); ++ring) {
            const float radius = 0.5f * (inner(ring) + inner(ring + 1));
            const float cosine = (radius * radius + chord * chord - disk.disk * disk.disk) / (2.0f * radius * chord);
            if (cosine < 1.0f)
                add_arc(m_left[ring], disk.way, std::max(cosine, -1.0f), -disk.count);
        }
    }

    UnevenRings times_window(float width) &&
    {
        for (std::size_t ring = 0; ring < m_left.size(); ++ring) {
            const float share = window(0.5f * (inner(ring) + inner(ring + 1)) / width);
            for (float& value : m_left[ring])
                value *= share;
        }
        return {m_first, std::move(m_left)};
    }

private:
    float inner(std::size_t ring) const
    {
        return chord_of(m_first + steps_per_ring * static_cast<std::uint32_t>(ring));
    }

    std::size_t ring_of(float radius) const
    {
        const std::uint32_t step = chord_step(radius);
        return step < m_first ? 0 : std::min<std::size_t>((step - m_first) / steps_per_ring, m_left.size());
    }

    void add(std::size_t ring, const RingIntegrals& values, float part)
    {
        for (std::size_t i = 0; i < values.size(); ++i)
            m_left[ring][i] += part * values[i];
    }

    std::uint32_t m_first;
    std::vector<RingIntegrals> m_left;
};

}  // namespace

UnevenRings rings_around(const UnevenSample& own, std::uint32_t least_step, const std::vector<NearSample>& near)
{
    const float side = own.side;
    const TangentFrame frame(own);
    std::vector<Parallelogram> areas = {{Vec2f(0.0f), frame(own.step_x), frame(own.step_y)}};
    std::vector<Seen> disks;
    float nearest = near_sides * side;
    for (const NearSample& other : near) {
        if (glm::dot(other.normal, own.normal) < least_facing)
            continue;
        const Vec3f to = other.position - own.position;
        const Vec2f flat = frame(to);
        const float length = glm::length(flat);
        if (!(length > 0.0f))
            continue;
        const float distance = glm::length(to);
        const Vec2f way = flat / length;
        areas.emplace_back(distance * way, frame.turned(other.step_x, other.normal),
                           frame.turned(other.step_y, other.normal));
        const float chord = std::max(distance, disk_begin_radii * other.disk);
        // Light comes from there.
        disks.push_back({-way, chord, other.disk, other.area / (static_cast<float>(pi) * other.disk * other.disk)});
        nearest = std::min(nearest, chord - other.disk);
    }
    const std::array<Sector, sectors>& all = all_sectors();
    std::array<float, sectors> ends{};
    for (std::size_t i = 0; i < sectors; ++i) {
        for (const Parallelogram& area : areas)
            ends[i] = std::max(ends[i], area.exit(all[i].way));
        nearest = std::min(nearest, ends[i]);
    }
    Rings rings(std::max(least_step, chord_step(nearest)), chord_step(near_sides * side));
    for (std::size_t i = 0; i < sectors; ++i)
        rings.add(all[i], ends[i]);
    for (const Seen& disk : disks)
        rings.subtract(disk);
    return std::move(rings).times_window(window_width * side);
}

}  // namespace beamspread
