// Coarse nodes of a mesh that bends: groups of its texels, from whose middles paths of bounced light start.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "scene/node_cloud.h"
#include "scene/receiver.h"

namespace beamspread {

class BentNodes {
public:
    // Groups texels of like place and normal into about `count` nodes. Paths start above the faces by a small part of a
    // node and of a texel. Throws InvalidArgument.
    BentNodes(const ReceiverGrid& grid, std::size_t count);

    const NodeCloud& cloud() const { return m_cloud; }
    std::size_t size() const { return m_cloud.size(); }

    // A place above one of the texels of a node, by area, and the frame there; `at` is from 0 to 1.
    struct Start {
        Vec3 origin;
        FieldFrame frame;
    };
    Start start(std::size_t node, double at) const;

    // Errors of nodes, averaged over their neighbors as results are, and over a distance.
    std::vector<double> smoothed(const std::vector<double>& values, double distance) const;

private:
    struct Member {
        Vec3 origin;  // world, above the middle of a texel
        Vec3 normal;
        double until;  // part of the node's area up to this texel and with it
    };

    NodeCloud m_cloud;
    std::vector<Member> m_members;
    std::vector<std::size_t> m_first;  // [node], and the number of all members
};

// Distance, in spacings, within which nodes count at a texel. Larger: less noise, and less detail.
inline constexpr double node_reach = 2.0;

}  // namespace beamspread
