// Targets of a surface's tree, and the sources of their light.
#include <algorithm>
#include <cmath>
#include <limits>

#include "solve/surface/chord_table.h"
#include "solve/surface/surface_tree.h"

namespace beamspread {

namespace {

// Weight of the variance of a cluster's normals beside the squared size over the distance. More: smaller errors where a
// surface bends, more pairs.
constexpr float normal_weight = 3.0f;

// Largest radius of a cluster over its distance. More: fewer pairs, larger errors near large clusters.
constexpr float max_radius = 0.7f;

// Weight of the fourth power of a cluster's size: `spread` corrects errors of the second. It only moves the bounds that
// `SurfaceField` tries.
constexpr float fourth_weight = 25.0f;

// Weight of the squared size, where a cluster faces another way than its targets, beside that of the fourth power. The
// curvature of pairs across an edge differs from point to point of a cluster, which `spread` does not correct. More:
// fewer clusters across edges, and larger errors that `SurfaceField` allows elsewhere. 0: blocks take 8 times as long.
constexpr float edge_weight = 16.0f;

// Difference of a cluster's normal from that of its targets, less the difference of a body that bends on as the cluster
// does: pairs of a ball have one curvature. 0 on planes and balls.
float turn_of_edge(const Vec3f& difference, float variance, float spread, float squared_distance)
{
    if (!(spread > 0.0f))
        return glm::length(difference);
    return std::sqrt(std::max(0.0f, glm::dot(difference, difference) - variance * squared_distance / spread));
}

}  // namespace

SurfaceTree::Targets SurfaceTree::targets(std::span<const std::uint8_t> is_wanted) const
{
    Targets targets;
    std::vector<std::uint32_t> before{0};  // [place in the tree's order] number of wanted samples before
    for (const std::uint32_t i : m_order) {
        if (is_wanted.empty() || is_wanted[i] != 0)
            targets.samples.push_back(i);
        before.push_back(static_cast<std::uint32_t>(targets.samples.size()));
    }
    const auto count_of = [&](const Node& node) { return before[node.end] - before[node.begin]; };
    std::vector<std::uint32_t> waiting{0};
    while (!waiting.empty()) {
        const std::uint32_t number = waiting.back();
        waiting.pop_back();
        const Node& node = m_nodes[number];
        const std::uint32_t count = count_of(node);
        if (count == 0)
            continue;
        const bool is_tip = node.second == 0;
        if (is_tip || (count <= PairTargets::most && count_of(m_nodes[number + 1]) % count != 0)) {
            targets.groups.push_back(group_of(std::span(targets.samples).subspan(before[node.begin], count), node));
        } else {
            waiting.push_back(node.second);
            waiting.push_back(number + 1);
        }
    }
    return targets;
}

SurfaceTree::Group SurfaceTree::group_of(std::span<const std::uint32_t> samples, const Node& node) const
{
    Box box;
    for (const std::uint32_t i : samples) {
        box.low = glm::min(box.low, m_samples[i].position);
        box.high = glm::max(box.high, m_samples[i].position);
    }
    return {samples, 0.5f * (box.low + box.high), 0.5f * glm::length(box.high - box.low), node.weight};
}

std::size_t SurfaceTree::Sources::count() const
{
    std::size_t sum = clusters.size();
    for (const std::span<const PairSource> part : samples)
        sum += part.size();
    return sum;
}

Vec3f SurfaceTree::mean_normal(std::span<const Group> groups) const
{
    Vec3f sum(0.0f);
    for (const Group& group : groups)
        for (const std::uint32_t i : group.samples)
            sum += m_samples[i].normal;
    const float length = glm::length(sum);
    return length > 0.0f ? sum / length : sum;
}

// A cluster that is far is so from farther away, too, but for steps of the bound.
bool SurfaceTree::is_far(const Node& node, float distance, const Vec3f& normal, const Opening& opening)
{
    if (distance <= 0.0f || node.light_radius > max_radius * distance)
        return false;
    const float square = distance * distance;
    const float variance = node.variance();
    const float size = node.spread + normal_weight * variance * square;
    if (opening.size > 0.0f)
        return size <= opening.size * opening.size * square;
    const std::uint32_t step = chord_step(distance - node.light_radius);
    if (opening.bound.empty() || step < opening.first)
        return false;
    const std::size_t row = std::min<std::size_t>(step - opening.first, opening.bound.size() - 1);
    const float of_size = fourth_weight * size / square;
    const auto is_small = [&](float error) { return error * size * node.weight * opening.bound[row] <= 1.0f; };
    // Most clusters that are too large are so without a turn, which takes longer to find.
    return is_small(of_size) &&
           is_small(of_size + edge_weight * turn_of_edge(node.normal - normal, variance, node.spread, square));
}

void SurfaceTree::find_candidates(std::span<const Group> groups, const Opening& opening, float reach,
                                  Sources& sources) const
{
    // A ball around all targets.
    Vec3f low(std::numeric_limits<float>::infinity());
    Vec3f high = -low;
    for (const Group& group : groups) {
        low = glm::min(low, group.middle - group.radius);
        high = glm::max(high, group.middle + group.radius);
    }
    const Vec3f middle = 0.5f * (low + high);
    const float radius = 0.5f * glm::length(high - low);
    const Vec3f normal = mean_normal(groups);
    sources.candidates.clear();
    sources.shared.clear();
    sources.waiting.assign(1, 0);
    while (!sources.waiting.empty()) {
        const std::uint32_t number = sources.waiting.back();
        sources.waiting.pop_back();
        const Node& node = m_nodes[number];
        const float distance = glm::length(node.light - middle);
        if (node.weight == 0.0f || distance - radius - node.light_radius > reach)
            continue;
        if (is_far(node, distance - radius, normal, opening)) {
            sources.shared.push_back(&m_clusters[number]);
            continue;
        }
        if (node.end - node.begin <= PairTargets::most || is_far(node, distance + radius, normal, opening)) {
            sources.candidates.push_back(number);
        } else {
            sources.waiting.push_back(node.second);
            sources.waiting.push_back(number + 1);
        }
    }
}

void SurfaceTree::find(const Group& group, const Opening& opening, float reach, Sources& sources) const
{
    sources.samples.clear();
    sources.clusters = sources.shared;
    const Vec3f normal = mean_normal(std::span(&group, 1));
    sources.waiting.assign(sources.candidates.rbegin(), sources.candidates.rend());
    while (!sources.waiting.empty()) {
        const std::uint32_t number = sources.waiting.back();
        sources.waiting.pop_back();
        const Node& node = m_nodes[number];
        if (node.weight == 0.0f)
            continue;
        const float distance = glm::length(node.light - group.middle) - group.radius;
        if (distance - node.light_radius > reach)
            continue;
        if (is_far(node, distance, normal, opening)) {
            sources.clusters.push_back(&m_clusters[number]);
        } else if (node.second == 0) {
            sources.samples.push_back(lit_samples(node));
        } else {
            sources.waiting.push_back(node.second);
            sources.waiting.push_back(number + 1);
        }
    }
}

bool SurfaceTree::find_near(const Vec3f& place, float distance, std::size_t most, Sources& sources) const
{
    sources.near.clear();
    sources.waiting.assign(1, 0);
    while (!sources.waiting.empty()) {
        const std::uint32_t number = sources.waiting.back();
        sources.waiting.pop_back();
        const Node& node = m_nodes[number];
        if (node.weight == 0.0f || glm::length(node.middle - place) > node.radius + distance)
            continue;
        if (node.second != 0) {
            sources.waiting.push_back(node.second);
            sources.waiting.push_back(number + 1);
            continue;
        }
        for (const PairSource& sample : lit_samples(node))
            if (glm::length(sample.position - place) < distance)
                sources.near.push_back(&sample);
        if (sources.near.size() > most)
            return false;
    }
    return true;
}

}  // namespace beamspread
