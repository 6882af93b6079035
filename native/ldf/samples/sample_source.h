// Samples in place of a library.
#pragma once

#include <map>
#include <mutex>
#include <utility>
#include <vector>

#include "ldf/radial/ldf_source.h"
#include "ldf/samples/interpolate.h"

namespace beamspread {

// The image as radial functions around O, one per azimuthal harmonic: rings of the image, its texels evenly bright. The
// power is that of the image. What is odd in v is left out, and at normal incidence what is not round: an LDF has
// neither.
RadialProfile sample_profile(const LdfSample& sample);

// LDFs interpolated from samples of one medium, between angles at most 5 degrees apart; in between linearly.
class SampleSource final : public LdfSource {
public:
    // Samples as for `interpolate`, of one g. Throws InvalidArgument.
    SampleSource(std::vector<LdfSample> samples, Interpolation method);

    // Samples have one side.
    RadialProfile profile(double angle_deg, double albedo, Side side) const override;
    std::vector<RadialProfile> node_profiles(double albedo, Side side) const override;
    AngleWeights angle_weights(double angle_deg) const override;
    void check_angle(double angle_deg) const override;

private:
    RadialProfile at_node(double angle_deg, double albedo) const;

    std::vector<LdfSample> m_samples;
    std::vector<const LdfSample*> m_pointers;  // to them
    Interpolation m_method;
    std::vector<double> m_angles;  // ascending

    // Channels of the same albedo and the steps of a solver ask for the same again.
    mutable std::mutex m_mutex;
    mutable std::map<std::pair<double, double>, RadialProfile> m_known;  // by angle and albedo
};

}  // namespace beamspread
