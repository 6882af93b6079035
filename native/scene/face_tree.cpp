#include "scene/face_tree.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace beamspread {

namespace {

// Squared distance over squared radius above which faces of a node are drawn by power alone. Larger: slower, and hardly less
// noise.
constexpr double squared_radii_to_far = 3.0 * 3.0;

// Largest part of a number that is left.
constexpr double below_one = 1.0 - 1e-12;

}  // namespace

FaceTree::FaceTree(std::span<const FaceBox> faces) : m_faces(faces.size()), m_cumulated{0.0}
{
    if (faces.empty())
        return;
    std::iota(m_faces.begin(), m_faces.end(), 0u);
    m_nodes.reserve(2 * faces.size() - 1);
    add(faces, 0, static_cast<std::uint32_t>(faces.size()));
    for (const std::uint32_t face : m_faces)
        m_cumulated.push_back(m_cumulated.back() + faces[face].power);
}

std::uint32_t FaceTree::add(std::span<const FaceBox> faces, std::uint32_t begin, std::uint32_t end)
{
    const std::span own = std::span(m_faces).subspan(begin, end - begin);
    const auto middle_of = [&](std::uint32_t face) { return 0.5 * (faces[face].low + faces[face].high); };
    Vec3 low = faces[own[0]].low;
    Vec3 high = faces[own[0]].high;
    Vec3 first = middle_of(own[0]);
    Vec3 last = first;
    for (const std::uint32_t face : own) {
        low = glm::min(low, faces[face].low);
        high = glm::max(high, faces[face].high);
        first = glm::min(first, middle_of(face));
        last = glm::max(last, middle_of(face));
    }
    const auto index = static_cast<std::uint32_t>(m_nodes.size());
    const Vec3 half = 0.5 * (high - low);
    m_nodes.push_back({.centre = 0.5 * (low + high),
                       .half = half,
                       .squared_radius = glm::dot(half, half),
                       .begin = begin,
                       .end = end,
                       .second = 0});
    if (own.size() == 1)
        return index;
    const Vec3 size = last - first;
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const std::uint32_t middle = begin + (end - begin) / 2;
    std::ranges::nth_element(own, own.begin() + (middle - begin), {},
                             [&](std::uint32_t face) { return std::pair(middle_of(face)[axis], face); });
    add(faces, begin, middle);
    const std::uint32_t second = add(faces, middle, end);
    m_nodes[index].second = second;
    return index;
}

double FaceTree::importance(const Node& node, const Vec3& point, const Vec3& normal) const
{
    const Vec3 way = node.centre - point;
    if (!(glm::dot(normal, way) + glm::dot(glm::abs(normal), node.half) > 0.0))
        return 0.0;
    // Within the sphere around the box any of its faces may be nearest.
    return (m_cumulated[node.end] - m_cumulated[node.begin]) / std::max(glm::dot(way, way), node.squared_radius);
}

FaceTree::Choice FaceTree::choose(const Vec3& point, const Vec3& normal, double number) const
{
    double probability = 1.0;
    std::uint32_t index = 0;
    const auto is_near = [&](const Node& node) {
        const Vec3 way = node.centre - point;
        return glm::dot(way, way) < squared_radii_to_far * node.squared_radius;
    };
    while (m_nodes[index].second != 0 && is_near(m_nodes[index])) {
        const std::uint32_t first = index + 1;
        const std::uint32_t second = m_nodes[index].second;
        const double before = importance(m_nodes[first], point, normal);
        const double after = importance(m_nodes[second], point, normal);
        if (!(before + after > 0.0))
            return {};
        const double part = before / (before + after);
        const bool is_first = number < part;
        const double chance = is_first ? part : 1.0 - part;
        number = std::clamp((is_first ? number : number - part) / chance, 0.0, below_one);
        probability *= chance;
        index = is_first ? first : second;
    }
    const auto [begin, end] = std::pair(m_nodes[index].begin, m_nodes[index].end);
    const double power = m_cumulated[end] - m_cumulated[begin];
    const double wanted = m_cumulated[begin] + number * power;
    const auto above = std::upper_bound(m_cumulated.begin() + begin + 1, m_cumulated.begin() + end, wanted);
    const auto place = static_cast<std::size_t>(above - m_cumulated.begin()) - 1;
    const double own = m_cumulated[place + 1] - m_cumulated[place];
    return {.face = m_faces[place],
            .probability = probability * own / power,
            .rest = std::clamp((wanted - m_cumulated[place]) / own, 0.0, 1.0)};
}

}  // namespace beamspread
