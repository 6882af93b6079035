#include "solve/surface/surface_tree.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>
#include <tuple>
#include <utility>

#include "base/constants.h"
#include "base/threads.h"
#include "solve/surface/sample_codes.h"

namespace beamspread {

namespace {

// Samples of a leaf, at most: as many as share their sources where all are targets.
constexpr std::size_t leaf_size = PairTargets::most;

// Samples of the smallest clusters, at most: leaves of more are parted once more. More: less memory, more pairs.
constexpr std::size_t tip_size = 4;

// Samples of a node, at most, which is parted at the middle of its longest side, to whole leaves, rather than by codes.
// More: fuller leaves, and clusters that look less like squares.
constexpr std::size_t parted_size = 128;

// Mean squared distance of the points of a sample, a disk, from its middle, over its area.
constexpr float sample_spread = 0.5f * static_cast<float>(inv_pi);

// Samples of one work item.
constexpr std::size_t at_once = 1024;

// A unit vector across another one.
Vec3f across(const Vec3f& unit)
{
    const Vec3f axis = std::abs(unit.z) < 0.7f ? Vec3f(0.0f, 0.0f, 1.0f) : Vec3f(1.0f, 0.0f, 0.0f);
    return glm::normalize(axis - unit * glm::dot(axis, unit));
}

// Cosine and sine of the angle from the x axis of one frame to that of another, which is turned into the former's plane
// along the shortest way.
std::array<float, 2> turn(const PairSource& to, const PairSource& from)
{
    const Vec3f z = glm::cross(to.tangent, to.binormal);
    const Vec3f from_z = glm::cross(from.tangent, from.binormal);
    // Turn v by the rotation that takes from_z to z: v - (v . z) (z + from_z) / (1 + z . from_z), for v across from_z.
    const Vec3f turned =
        from.tangent - (z + from_z) * (glm::dot(from.tangent, z) / std::max(1.0f + glm::dot(z, from_z), 1e-3f));
    const float x = glm::dot(turned, to.tangent);
    const float y = glm::dot(turned, to.binormal);
    const float length = std::sqrt(x * x + y * y);
    return length > 0.0f ? std::array{x / length, y / length} : std::array{1.0f, 0.0f};
}

// Adds moments times a factor, turned from one frame to another.
void add_turned(const SurfaceBasis& basis, const std::array<float, 2>& turned, float factor, const float* from,
                float* to)
{
    std::array<float, surface_harmonics> cosines;
    std::array<float, surface_harmonics> sines;
    float c = factor;
    float s = 0.0f;
    for (std::size_t m = 0; m < surface_harmonics; ++m) {
        cosines[m] = c;
        sines[m] = s;
        const float next = c * turned[0] - s * turned[1];
        s = s * turned[0] + c * turned[1];
        c = next;
    }
    for (std::size_t block = 0; block < basis.lanes.moments() / (2 * lanes_per_block); ++block) {
        const float* from_sine = from + lanes_per_block;
        float* to_sine = to + lanes_per_block;
        const std::int32_t* harmonic = basis.lanes.harmonic.data() + block % basis.lanes.blocks * lanes_per_block;
        for (std::size_t lane = 0; lane < lanes_per_block; ++lane) {
            const auto m = static_cast<std::size_t>(harmonic[lane]);
            to[lane] += cosines[m] * from[lane] - sines[m] * from_sine[lane];
            to_sine[lane] += cosines[m] * from_sine[lane] + sines[m] * from[lane];
        }
        from += 2 * lanes_per_block;
        to += 2 * lanes_per_block;
    }
}

// Adds the products of a vector's coordinates, xx, yy, zz, xy, yz and zx, times a factor.
void add_squares(const Vec3f& v, float factor, std::array<float, 6>& squares)
{
    const Vec3f by = factor * v;
    const std::array<float, 6> products = {by.x * v.x, by.y * v.y, by.z * v.z, by.x * v.y, by.y * v.z, by.z * v.x};
    for (std::size_t i = 0; i < products.size(); ++i)
        squares[i] += products[i];
}

// Sets the frame of a cluster, whose mean normal is 0 where those of its parts cancel.
void set_frame(const Vec3f& normal, PairSource& cluster)
{
    constexpr float least = 1e-6f;
    const float length = glm::length(normal);
    const Vec3f axis = length > least ? normal / length : Vec3f(0.0f, 0.0f, 1.0f);
    cluster.normal = normal;
    cluster.tangent = across(axis);
    cluster.binormal = glm::cross(axis, cluster.tangent);
}

}  // namespace

SurfaceTree::SurfaceTree(std::span<const SurfaceSample> samples)
    : m_samples(samples), m_order(samples.size()), m_weights(samples.size()), m_disks(samples.size())
{
    const std::vector<std::uint64_t> codes = codes_of(samples);
    std::vector<std::pair<std::uint64_t, std::uint32_t>> order;
    for (std::size_t i = 0; i < samples.size(); ++i)
        order.emplace_back(codes[i], static_cast<std::uint32_t>(i));
    std::sort(order.begin(), order.end());
    m_codes.resize(samples.size());
    for (std::size_t i = 0; i < samples.size(); ++i)
        std::tie(m_codes[i], m_order[i]) = order[i];
    build(0, samples.size());
    m_codes = {};
}

SurfaceTree::Box SurfaceTree::box_of(std::size_t begin, std::size_t end) const
{
    Box box;
    for (std::size_t i = begin; i < end; ++i) {
        box.low = glm::min(box.low, m_samples[m_order[i]].position);
        box.high = glm::max(box.high, m_samples[m_order[i]].position);
    }
    return box;
}

SurfaceTree::Box SurfaceTree::build(std::size_t begin, std::size_t end)
{
    const auto number = static_cast<std::uint32_t>(m_nodes.size());
    m_nodes.push_back({.begin = static_cast<std::uint32_t>(begin), .end = static_cast<std::uint32_t>(end)});
    const bool is_parted = end - begin <= parted_size;  // else the boxes of its parts tell its own
    Box box = is_parted ? box_of(begin, end) : Box{};
    if (end - begin > tip_size) {
        const std::size_t middle = is_parted ? part_by_place(begin, end, box) : part_by_code(begin, end);
        const Box first = build(begin, middle);
        m_nodes[number].second = static_cast<std::uint32_t>(m_nodes.size());
        const Box second = build(middle, end);
        if (!is_parted)
            box = {glm::min(first.low, second.low), glm::max(first.high, second.high)};
    }
    m_nodes[number].middle = 0.5f * (box.low + box.high);
    m_nodes[number].radius = 0.5f * glm::length(box.high - box.low);
    return box;
}

// Parts samples at the middle of the longest side of their box, to whole leaves. Returns the first of the second part.
std::size_t SurfaceTree::part_by_place(std::size_t begin, std::size_t end, const Box& box)
{
    const Vec3f size = box.high - box.low;
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const std::size_t part = end - begin <= leaf_size ? tip_size : leaf_size;
    const std::size_t middle = begin + (end - begin + part - 1) / part / 2 * part;
    const auto at = [&](std::size_t i) { return m_order.begin() + static_cast<std::ptrdiff_t>(i); };
    std::nth_element(at(begin), at(middle), at(end), [&](std::uint32_t a, std::uint32_t b) {
        const float first = m_samples[a].position[axis];
        const float second = m_samples[b].position[axis];
        return first != second ? first < second : a < b;
    });
    return middle;
}

// Parts samples where the first bit changes in which their codes differ; equal codes in the middle.
std::size_t SurfaceTree::part_by_code(std::size_t begin, std::size_t end) const
{
    const std::uint64_t differing = m_codes[begin] ^ m_codes[end - 1];
    if (differing == 0)
        return begin + (end - begin) / 2;
    const std::uint64_t bit = std::bit_floor(differing);
    const auto first = m_codes.begin() + static_cast<std::ptrdiff_t>(begin);
    const auto last = m_codes.begin() + static_cast<std::ptrdiff_t>(end);
    return static_cast<std::size_t>(
        std::partition_point(first, last, [bit](std::uint64_t code) { return (code & bit) == 0; }) - m_codes.begin());
}

void SurfaceTree::weigh(const SurfaceBasis& basis, const PairTables& tables, const std::vector<float>& moments)
{
    const std::size_t stride = basis.lanes.moments();
    m_set_scales.assign(basis.terms.sets.count(), 0.0f);
    m_first_places.resize(m_set_scales.size());
    for (std::size_t result = 0; result < basis.lanes.results; ++result)
        m_first_places[basis.terms.sets.results[result].set] = basis.lanes.place(result, 0);
    for (std::size_t set = 0; set < m_set_scales.size(); ++set) {
        float most = 0.0f;
        for (std::size_t i = 0; i < m_samples.size(); ++i)
            most = std::max(most, light(moments, stride, i, set));
        m_set_scales[set] = most > 0.0f ? 1.0f / most : 0.0f;
    }
    parallel_for(m_samples.size() / at_once + 1, [&](std::size_t item) {
        for (std::size_t i = item * at_once; i < std::min(m_samples.size(), (item + 1) * at_once); ++i) {
            const float* all = moments.data() + i * stride;
            const bool is_lit = std::any_of(all, all + stride, [](float value) { return value != 0.0f; });
            float sum = 0.0f;
            for (std::size_t set = 0; set < m_set_scales.size(); ++set)
                sum += m_set_scales[set] * light(moments, stride, i, set);
            m_weights[i] = is_lit ? std::max(sum * m_samples[i].area, std::numeric_limits<float>::min()) : 0.0f;
            m_disks[i] = static_cast<std::uint32_t>(tables.disk(m_samples[i].area));
        }
    });
}

void SurfaceTree::list_lit()
{
    m_lit.clear();
    m_lit_before.assign(1, 0);
    for (const std::uint32_t i : m_order) {
        if (m_weights[i] > 0.0f)
            m_lit.push_back(m_samples[i].as_source(m_disks[i], i));
        m_lit_before.push_back(static_cast<std::uint32_t>(m_lit.size()));
    }
}

std::span<const PairSource> SurfaceTree::lit_samples(const Node& node) const
{
    const std::size_t first = m_lit_before[node.begin];
    return std::span(m_lit).subspan(first, m_lit_before[node.end] - first);
}

void SurfaceTree::gather(const SurfaceBasis& basis, const PairTables& tables, std::vector<float>& moments)
{
    const std::size_t stride = basis.lanes.moments();
    const std::size_t count = m_samples.size();
    weigh(basis, tables, moments);
    list_lit();
    m_clusters.resize(m_nodes.size());
    const auto sums_of = [&](std::size_t node) { return moments.data() + (count + node) * stride; };
    std::fill(moments.begin() + static_cast<std::ptrdiff_t>(count * stride), moments.end(), 0.0f);
    parallel_for(m_nodes.size() / at_once + 1, [&](std::size_t item) {
        for (std::size_t i = item * at_once; i < std::min(m_nodes.size(), (item + 1) * at_once); ++i)
            if (m_nodes[i].second == 0)
                gather_tip(basis, moments, i, sums_of(i));
    });
    for (std::size_t node = m_nodes.size(); node-- > 0;)
        if (m_nodes[node].second != 0)
            gather_children(basis, moments, node, sums_of(node));
    for (std::size_t node = 0; node < m_nodes.size(); ++node) {
        const ClusterSource& cluster = m_clusters[node];
        m_clusters[node].moments = static_cast<std::uint32_t>(count + node);
        m_nodes[node].light = cluster.position;
        m_nodes[node].spread = 4.0f * cluster.spread;
        m_nodes[node].normal = cluster.normal;
    }
}

// Sets weight, place and frame of a node from the light of its parts; false if all are dark.
bool SurfaceTree::place(Node& node, ClusterSource& cluster, std::span<const Part> parts)
{
    Vec3f position(0.0f);
    Vec3f normal(0.0f);
    node.weight = 0.0f;
    for (const Part& part : parts) {
        node.weight += part.weight;
        position += part.weight * (part.position - node.middle);
        normal += part.weight * part.normal;
    }
    node.light_radius = 0.0f;
    if (node.weight == 0.0f)
        return false;
    cluster.area = 1.0f;
    cluster.position = node.middle + position / node.weight;
    set_frame(normal / node.weight, cluster);
    return true;
}

void SurfaceTree::gather_tip(const SurfaceBasis& basis, const std::vector<float>& moments, std::size_t number,
                             float* sums)
{
    Node& node = m_nodes[number];
    ClusterSource& cluster = m_clusters[number];
    const auto samples = std::span(m_order).subspan(node.begin, node.end - node.begin);
    std::array<Part, tip_size> parts;
    for (std::size_t k = 0; k < samples.size(); ++k)
        parts[k] = {m_weights[samples[k]], m_samples[samples[k]].position, m_samples[samples[k]].normal};
    if (!place(node, cluster, std::span(parts).first(samples.size())))
        return;
    float square = 0.0f;
    float bend = 0.0f;
    cluster.squares.fill(0.0f);
    for (const std::uint32_t i : samples) {
        if (m_weights[i] == 0.0f)
            continue;
        const SurfaceSample& sample = m_samples[i];
        const Vec3f offset = sample.position - cluster.position;
        square += m_weights[i] * (glm::dot(offset, offset) + sample.area * sample_spread);
        node.light_radius = std::max(node.light_radius, glm::length(offset));
        bend += m_weights[i] * glm::dot(offset, sample.normal);
        add_squares(offset, m_weights[i] / node.weight, cluster.squares);
        // A disk has as much along each line of its plane.
        const float of_disk = 0.5f * sample_spread * sample.area * m_weights[i] / node.weight;
        for (std::size_t axis = 0; axis < 3; ++axis)
            cluster.squares[axis] += of_disk;
        add_squares(sample.normal, -of_disk, cluster.squares);
        add_turned(basis, turn(cluster, sample.as_source(0, 0)), sample.area,
                   moments.data() + i * basis.lanes.moments(), sums);
    }
    cluster.spread = 0.25f * square / node.weight;
    cluster.bend = bend / node.weight;
}

void SurfaceTree::gather_children(const SurfaceBasis& basis, const std::vector<float>& moments, std::size_t number,
                                  float* sums)
{
    Node& node = m_nodes[number];
    ClusterSource& cluster = m_clusters[number];
    const std::array<std::size_t, 2> children = {number + 1, node.second};
    std::array<Part, 2> parts;
    for (std::size_t k = 0; k < 2; ++k)
        parts[k] = {m_nodes[children[k]].weight, m_clusters[children[k]].position, m_clusters[children[k]].normal};
    if (!place(node, cluster, parts))
        return;
    float spread = 0.0f;
    float bend = 0.0f;
    cluster.squares.fill(0.0f);
    for (const std::size_t number_of_child : children) {
        const Node& child = m_nodes[number_of_child];
        const ClusterSource& light = m_clusters[number_of_child];
        if (child.weight == 0.0f)
            continue;
        const Vec3f offset = light.position - cluster.position;
        spread += child.weight * (light.spread + 0.25f * glm::dot(offset, offset));
        node.light_radius = std::max(node.light_radius, glm::length(offset) + child.light_radius);
        bend += child.weight * (light.bend + glm::dot(offset, light.normal));
        const float part = child.weight / node.weight;
        add_squares(offset, part, cluster.squares);
        for (std::size_t k = 0; k < cluster.squares.size(); ++k)
            cluster.squares[k] += part * light.squares[k];
        add_turned(basis, turn(cluster, light), 1.0f,
                   moments.data() + (m_samples.size() + number_of_child) * basis.lanes.moments(), sums);
    }
    cluster.spread = spread / node.weight;
    cluster.bend = bend / node.weight;
}

}  // namespace beamspread
