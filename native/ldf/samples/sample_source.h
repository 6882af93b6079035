// LDFs for solvers from samples instead of a library.
#pragma once

#include <map>
#include <mutex>
#include <utility>
#include <vector>

#include "ldf/radial/ldf_source.h"
#include "ldf/samples/interpolate.h"

namespace beamspread {

// The image as radial functions around O, one per azimuthal harmonic, integrated over rings with constant texels. Keeps
// the power. Drops the part odd in v, and at normal incidence all harmonics m > 0: an LDF has neither.
RadialProfile sample_profile(const LdfSample& sample);

// LDFs interpolated from samples of one medium at nodes at most 5 degrees apart, and linearly between the nodes.
class SampleSource final : public LdfSource {
public:
    // Takes samples as `interpolate` does, all of the same g. Throws InvalidArgument.
    SampleSource(std::vector<LdfSample> samples, Interpolation method);

    RadialProfile profile(double angle_deg, double albedo, Side side) const override;
    std::vector<RadialProfile> node_profiles(double albedo, Side side) const override;
    AngleWeights angle_weights(double angle_deg, Side side) const override;
    void check_angle(double angle_deg) const override;

    // Throws InvalidArgument for the far side: samples are of light that leaves where it enters.
    void check_side(Side side) const override;

private:
    RadialProfile at_node(double angle_deg, double albedo) const;

    std::vector<LdfSample> m_samples;
    std::vector<const LdfSample*> m_pointers;  // to m_samples
    Interpolation m_method;
    std::vector<double> m_angles;  // ascending

    // Cache of profiles by angle and albedo: channels of the same albedo and the steps of a solver repeat requests.
    mutable std::mutex m_mutex;
    mutable std::map<std::pair<double, double>, RadialProfile> m_cache;
};

}  // namespace beamspread
