#include "scene/bent_nodes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "base/error.h"
#include "base/threads.h"

namespace beamspread {

namespace {

// Nodes that cubes of space and six ways to face make of a bent surface, for each square of the cubes' side. More: fewer
// nodes than wanted.
constexpr double nodes_per_square = 1.5;

// Height at which paths start, as fractions of a node's spacing and of a texel, and of the largest coordinate. Larger:
// things that lie on the mesh cast no shadow.
constexpr double lift_in_spacings = 1e-3;
constexpr double lift_in_texels = 0.01;
constexpr double lift_in_reach = 2e-6;

// The cube that a texel lies in, the axis that its normal is nearest to, and the texel.
struct Key {
    std::array<std::int64_t, 3> cube;
    int way;
    std::size_t texel;

    bool is_with(const Key& key) const { return cube == key.cube && way == key.way; }
    auto operator<=>(const Key&) const = default;
};

int way_of(const Vec3& normal)
{
    const Vec3 size = glm::abs(normal);
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    return 2 * axis + (normal[axis] < 0.0 ? 1 : 0);
}

}  // namespace

BentNodes::BentNodes(const ReceiverGrid& grid, std::size_t count)
{
    if (!grid.is_bent())
        reject("grid", "a plane", "a mesh that bends");
    if (count < 1)
        reject("count", std::to_string(count), "1 or more nodes");
    const BentShape& shape = *grid.shape;
    if (!(shape.area > 0.0))
        reject("grid", "without an area", "a mesh with texels");
    const double spacing = std::sqrt(nodes_per_square * shape.area / static_cast<double>(count));
    std::vector<Key> keys;
    for (std::size_t i = 0; i < shape.texels.size(); ++i) {
        const BentTexel& texel = shape.texels[i];
        if (!(texel.area > 0.0f))
            continue;
        const Vec3 cube = glm::floor((texel.position - shape.low) / spacing);
        keys.push_back(
            {{static_cast<std::int64_t>(cube.x), static_cast<std::int64_t>(cube.y), static_cast<std::int64_t>(cube.z)},
             way_of(Vec3(texel.normal)),
             i});
    }
    std::ranges::sort(keys);
    const double rounding = lift_in_reach * grid.reach(0.5 * (shape.low + shape.high)) +
                            8.0 * std::numeric_limits<double>::epsilon() * grid.reach(Vec3(0.0));
    std::vector<Vec3> positions, normals;
    for (std::size_t begin = 0, end = 0; begin < keys.size(); begin = end) {
        Vec3 position(0.0), normal(0.0);
        double area = 0.0;
        m_first.push_back(m_members.size());
        for (end = begin; end < keys.size() && keys[end].is_with(keys[begin]); ++end) {
            const BentTexel& texel = shape.texels[keys[end].texel];
            const auto part = static_cast<double>(texel.area);
            const double lift = lift_in_spacings * spacing + lift_in_texels * texel.pitch() + rounding;
            position += part * texel.position;
            normal += part * Vec3(texel.normal);
            area += part;
            m_members.push_back({texel.position + lift * Vec3(texel.face), Vec3(texel.normal), area});
        }
        for (std::size_t k = m_first.back(); k < m_members.size(); ++k)
            m_members[k].until /= area;
        positions.push_back(position / area);
        normals.push_back(glm::normalize(normal));
    }
    m_first.push_back(m_members.size());
    m_cloud = NodeCloud(std::move(positions), std::move(normals), spacing);
}

BentNodes::Start BentNodes::start(std::size_t node, double at) const
{
    const auto begin = m_members.begin() + static_cast<std::ptrdiff_t>(m_first[node]);
    const auto last = m_members.begin() + static_cast<std::ptrdiff_t>(m_first[node + 1] - 1);
    const Member& member = *std::ranges::upper_bound(begin, last, at, {}, &Member::until);
    return {member.origin, FieldFrame(member.normal)};
}

std::vector<double> BentNodes::smoothed(const std::vector<double>& values, double distance) const
{
    std::vector<double> result(size());
    const double reach = std::max(node_reach * m_cloud.spacing(), distance);
    PerThread<NodeCloud::Weights> scratch;
    parallel_for(size(), [&](std::size_t i) {
        NodeCloud::Weights& weights = scratch.local();
        m_cloud.find(m_cloud.positions()[i], m_cloud.normals()[i], reach, weights);
        for (const auto& [node, weight] : weights)
            result[i] += static_cast<double>(weight) * values[node];
    });
    return result;
}

}  // namespace beamspread
