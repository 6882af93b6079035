// Tree over the samples of a surface: light from far away comes from clusters of samples.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "base/vec.h"
#include "solve/surface/pair_sum.h"
#include "solve/surface/surface_basis.h"

namespace beamspread {

// Part of a surface. Its frame has x along the tangent, z along the normal, and y = cross(normal, tangent).
struct SurfaceSample {
    Vec3f position;  // metres, from an origin that all samples share
    Vec3f normal;    // unit vector
    Vec3f tangent;   // unit vector across the normal
    float area;      // m^2

    PairSource as_source(std::uint32_t disk, std::uint32_t moments) const
    {
        return {position, area, normal, disk, tangent, moments, glm::cross(normal, tangent)};
    }
};

class SurfaceTree {
public:
    // Views the samples, which must outlive the tree.
    explicit SurfaceTree(std::span<const SurfaceSample> samples);

    // Number of nodes, which need moments besides those of the samples.
    std::size_t nodes() const { return m_nodes.size(); }

    // Samples near to each other that are solved together: they share their sources.
    struct Group {
        std::span<const std::uint32_t> samples;  // at most `PairTargets::most`
        Vec3f middle;
        float radius = 0.0f;  // of the samples around their middle, metres
        float weight = 0.0f;  // of the light of the samples around; after `gather`
    };

    // Groups of some samples, each in one group; neighbors follow each other.
    struct Targets {
        std::vector<std::uint32_t> samples;
        std::vector<Group> groups;
    };

    // `is_wanted`: [sample] not 0 for those that the groups have; empty: all.
    Targets targets(std::span<const std::uint8_t> is_wanted) const;

    // Whether any light reaches a sample; after `gather`.
    bool is_lit(std::size_t sample) const { return m_weights[sample] > 0.0f; }

    // Factors from a set's light, irradiance times u(theta) of the first function, to the weights of clusters.
    const std::vector<float>& set_scales() const { return m_set_scales; }

    // Light that enters at a sample by the first function of a set; after `gather`.
    float light(const std::vector<float>& moments, std::size_t stride, std::size_t sample, std::size_t set) const
    {
        return std::abs(moments[sample * stride + m_first_places[set]]);
    }

    // Gathers the light of all samples in clusters. `moments`: [sample], then [node], as in `SurfaceBasis`; those of
    // nodes are written.
    void gather(const SurfaceBasis& basis, const PairTables& tables, std::vector<float>& moments);

    // Light that reaches a group.
    struct Sources : PairSources {
        std::size_t count() const;

        std::vector<const ClusterSource*> shared;  // clusters that are far from all groups side by side
        std::vector<std::uint32_t> candidates;     // nodes that may be sources of some of these
        std::vector<const PairSource*> near;       // lit samples around a place: see `find_near`
        std::vector<std::uint32_t> waiting;        // working memory
    };

    // Decides which clusters are far: those of which the light's squared size, of positions and normals, is small enough
    // at their distance.
    struct Opening {
        float size = 0.0f;         // root of the largest size over the distance; 0: `bound` decides
        std::uint32_t first = 0;   // step of the first chord of `bound`
        std::vector<float> bound;  // [chord]: 1 / (a far cluster's weight times fourth power of its size, m^2, over
                                   // its squared distance); empty: none is far
    };

    // Finds the nodes among which `find` looks for the sources of groups side by side; light from beyond `reach` (metres)
    // is left out.
    void find_candidates(std::span<const Group> groups, const Opening& opening, float reach, Sources& sources) const;

    // Finds the sources of one of these groups.
    void find(const Group& group, const Opening& opening, float reach, Sources& sources) const;

    // Finds the lit samples within a distance (metres) of a place; false if there are more than `most`.
    bool find_near(const Vec3f& place, float distance, std::size_t most, Sources& sources) const;

private:
    // One line of the cache.
    struct alignas(64) Node {
        // Variance of the normals.
        float variance() const { return 1.0f - glm::dot(normal, normal); }

        std::uint32_t begin = 0;  // its samples, in the tree's order
        std::uint32_t end = 0;
        std::uint32_t second = 0;  // its second child; the first one follows the node. 0: a leaf
        float radius = 0.0f;       // of the samples around their middle, metres
        Vec3f middle{0.0f};
        float light_radius = 0.0f;  // of the lit samples around the light's position, metres
        Vec3f light{0.0f};          // position of the cluster
        float weight = 0.0f;        // of its light; 0: dark
        float spread = 0.0f;        // mean squared distance of the light from its position, m^2
        Vec3f normal{0.0f};         // mean of the normals
    };
    static_assert(sizeof(Node) == 64);

    struct Box {
        Vec3f low{std::numeric_limits<float>::infinity()};
        Vec3f high{-std::numeric_limits<float>::infinity()};
    };

    // Light of a part of a cluster.
    struct Part {
        float weight;  // 0: dark
        Vec3f position;
        Vec3f normal;  // mean of unit vectors
    };

    static bool place(Node& node, ClusterSource& cluster, std::span<const Part> parts);
    Group group_of(std::span<const std::uint32_t> samples, const Node& node) const;
    // Sum of the normals of the samples of groups, over its length.
    Vec3f mean_normal(std::span<const Group> groups) const;
    // `normal`: mean of the targets.
    static bool is_far(const Node& node, float distance, const Vec3f& normal, const Opening& opening);
    void weigh(const SurfaceBasis& basis, const PairTables& tables, const std::vector<float>& moments);
    Box box_of(std::size_t begin, std::size_t end) const;
    Box build(std::size_t begin, std::size_t end);
    std::size_t part_by_place(std::size_t begin, std::size_t end, const Box& box);
    std::size_t part_by_code(std::size_t begin, std::size_t end) const;
    void list_lit();
    void gather_tip(const SurfaceBasis& basis, const std::vector<float>& moments, std::size_t number, float* sums);
    void gather_children(const SurfaceBasis& basis, const std::vector<float>& moments, std::size_t number, float* sums);
    std::span<const PairSource> lit_samples(const Node& node) const;

    std::span<const SurfaceSample> m_samples;
    std::vector<std::uint64_t> m_codes;  // of `m_order`
    std::vector<std::uint32_t> m_order;  // numbers of the samples
    std::vector<Node> m_nodes;  // parents come before their children
    std::vector<ClusterSource> m_clusters;  // [node]
    std::vector<PairSource> m_lit;          // lit samples in the tree's order
    std::vector<std::uint32_t> m_lit_before;  // [place in the tree's order] number of lit samples before
    std::vector<float> m_set_scales;
    std::vector<std::size_t> m_first_places;  // [set] of the first function among a sample's moments
    std::vector<float> m_weights;       // [sample] of its light; 0: dark
    std::vector<std::uint32_t> m_disks;  // [sample]
};

}  // namespace beamspread
