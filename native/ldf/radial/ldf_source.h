// Interface of the LDFs of one medium, for solvers.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

#include "ldf/radial/radial_profile.h"
#include "transport/exact/exact_totals.h"
#include "transport/tally/tally.h"

namespace beamspread {

class LdfSource {
public:
    virtual ~LdfSource() = default;

    // The scattered part of the LDF around the point of entry, of either side, per unit incident power. Throws
    // InvalidArgument.
    virtual RadialProfile profile(double angle_deg, double albedo, Side side) const = 0;

    // Profiles at the angles of all nodes, for solvers that need many angles at once. `profile` is their sum weighted
    // by `angle_weights`, cut to AngleWeights::harmonics.
    virtual std::vector<RadialProfile> node_profiles(double albedo, Side side) const = 0;

    // Curvatures, 1 / mean free path and ascending, of the surfaces whose profiles the source has; 0, a plane, is one of
    // them. 1 / radius on a ball, negative in a hollow.
    virtual std::vector<double> curvatures() const { return {0.0}; }

    // `node_profiles` on a surface of `curvatures()[curvature]`. The radius r is the chord, the straight distance of entry
    // and exit: the area within it is pi r^2 on a ball as on a plane. The azimuth is that of the chord in the tangent plane
    // of the entry. Includes unscattered light of slabs: solvers of curved surfaces know no other.
    virtual std::vector<RadialProfile> curved_node_profiles(double albedo, Side side, std::size_t /*curvature*/) const
    {
        return node_profiles(albedo, side);
    }

    struct AngleWeights {
        std::vector<double> even;  // [node], for the harmonics of even m
        std::vector<double> odd;
        std::array<std::size_t, 2> neighbours;  // nodes around the angle

        // Number of harmonics that a neighbour has. Splines ring: nodes farther away would add others.
        std::size_t harmonics(const std::vector<RadialProfile>& nodes) const
        {
            return std::max(nodes[neighbours[0]].harmonics(), nodes[neighbours[1]].harmonics());
        }
    };
    virtual AngleWeights angle_weights(double angle_deg, Side side) const = 0;

    // The unscattered light, per unit incident power; empty if the profiles include it.
    virtual std::vector<BallisticExit> ballistic(double /*angle_deg*/, Side /*side*/) const { return {}; }

    // Throws InvalidArgument for a side on which the source knows no light.
    virtual void check_side(Side /*side*/) const {}

    // Throws InvalidArgument for an angle outside the source's range.
    virtual void check_angle(double angle_deg) const = 0;

protected:
    LdfSource() = default;
    LdfSource(const LdfSource&) = default;
    LdfSource(LdfSource&&) = default;
    LdfSource& operator=(const LdfSource&) = default;
    LdfSource& operator=(LdfSource&&) = default;
};

}  // namespace beamspread
