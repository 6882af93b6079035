// What solvers ask of the LDFs of one medium, wherever they come from.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

#include "ldf/radial/radial_profile.h"
#include "transport/exact/ballistic.h"
#include "transport/tally/tally.h"

namespace beamspread {

class LdfSource {
public:
    virtual ~LdfSource() = default;

    // The scattered part of the LDF, per unit power incident. Throws InvalidArgument.
    virtual RadialProfile profile(double angle_deg, double albedo, Side side) const = 0;

    // Angles at which profiles are known; `profile` is the sum of `node_profiles` with the weights that `angle_weights`
    // gives, of the harmonics that AngleWeights::harmonics leaves. For solvers that meet many angles at once.
    virtual std::vector<RadialProfile> node_profiles(double albedo, Side side) const = 0;

    struct AngleWeights {
        std::vector<double> even;  // per node, for the harmonics of even m
        std::vector<double> odd;
        std::array<std::size_t, 2> neighbours;  // nodes around the angle

        // A spline rings around what begins at the next node but one: what neither neighbour has is not there.
        std::size_t harmonics(const std::vector<RadialProfile>& nodes) const
        {
            return std::max(nodes[neighbours[0]].harmonics(), nodes[neighbours[1]].harmonics());
        }
    };
    virtual AngleWeights angle_weights(double angle_deg) const = 0;

    // The unscattered light, per unit power incident; none where it is part of the profiles.
    virtual std::vector<BallisticExit> ballistic(double /*angle_deg*/, Side /*side*/) const { return {}; }

    // Throws InvalidArgument for an angle that the source does not reach to.
    virtual void check_angle(double angle_deg) const = 0;

protected:
    LdfSource() = default;
    LdfSource(const LdfSource&) = default;
    LdfSource(LdfSource&&) = default;
    LdfSource& operator=(const LdfSource&) = default;
    LdfSource& operator=(LdfSource&&) = default;
};

}  // namespace beamspread
