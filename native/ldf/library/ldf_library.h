// The luminance distribution functions of one medium for every angle of incidence and every albedo.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "base/progress.h"
#include "ldf/radial/ldf_source.h"
#include "medium/medium.h"
#include "transport/simulation.h"

namespace beamspread {

// Cubic spline (not-a-knot) through nodes x >= 0 and their mirror images -x. A beam from the other side gives the
// mirrored distribution: harmonics of even m are even functions of the angle, those of odd m odd functions. The
// interpolant is linear in the values, hence totals agree with the distributions.
class AngleSpline {
public:
    enum class Parity { even, odd };

    AngleSpline() = default;

    // Nodes in radians, ascending.
    explicit AngleSpline(std::vector<double> nodes);

    // Weight of each node's value in the interpolated value at x.
    std::vector<double> weights(double x, Parity parity) const;

private:
    std::vector<double> m_nodes;
    std::vector<double> m_points;             // nodes and their mirror images, ascending
    std::vector<double> m_second_derivative;  // of the cardinal splines, [point][value]
};

// Angles of incidence with known values, and splines between them. The variable is the angle outside the medium, in
// which the refracted angle and the Fresnel factor of light from a slab's other boundary are smooth. As a function of
// the angle inside, that factor has an infinite slope at grazing.
class AngleNodes {
public:
    AngleNodes() = default;

    // Angles in degrees, ascending. Throws InvalidArgument.
    explicit AngleNodes(std::vector<double> angles_deg);

    const std::vector<double>& angles_deg() const { return m_angles_deg; }
    std::size_t count() const { return m_angles_deg.size(); }

    // The angle, clamped to the first and last node.
    double clamped(double angle_deg) const;

    // The two nodes around an angle.
    std::array<std::size_t, 2> neighbours(double angle_deg) const;

    // Weights of the nodes at the clamped angle, times a factor.
    LdfSource::AngleWeights weights(double angle_deg, double factor) const;

private:
    std::vector<double> m_angles_deg;
    AngleSpline m_spline;
};

// The angles, and the middle of each two neighbours.
std::vector<double> with_middles(const std::vector<double>& angles_deg);

// Albedos at which the totals of calibrated libraries are compared with exact totals. Calibration makes them equal at
// every other one, from the first to the last. More: smaller errors at other albedos, larger files.
inline constexpr std::array<double, 31> compared_albedos = {
    0.01,  0.05,   0.1,    0.2,    0.3,    0.4,     0.5,     0.6,     0.7,    0.75,  0.8,
    0.86,  0.9,    0.93,   0.95,   0.97,   0.98,    0.986,   0.99,    0.995,  0.997, 0.9983,
    0.999, 0.9995, 0.9997, 0.9998, 0.9999, 0.99995, 0.99997, 0.99998, 0.99999};

// Weight of each order bin at an albedo: the mean of albedo^n over the bin, to second order in the spread of its orders
// n.
std::array<double, order_bin_count> order_weights(const SideResult& side, double albedo);

// Relative errors of a calibrated library's totals, at a simulated angle and halfway to the next, [albedo].
struct Residuals {
    std::array<float, compared_albedos.size()> here{};
    std::array<float, compared_albedos.size()> halfway{};
};
using SideResiduals = std::array<Residuals, side_count>;

class LdfLibrary;

// The LDFs of a medium with a curved surface (transport/simulation.h).
struct CurvedPart {
    double curvature = 0.0;  // 1 / mean free path, not 0
    // Its results are slim: without batches and deviations, see `slimmed`. Its residuals are relative standard errors.
    std::shared_ptr<const LdfLibrary> library;
};

class LdfLibrary final : public LdfSource {
public:
    // Takes one result per angle, in any order; of a calibrated library also the remaining errors, by ascending angles.
    // Throws InvalidArgument.
    LdfLibrary(const Medium& medium, std::uint64_t photons, std::uint64_t seed, std::vector<AngleResult> results,
               std::vector<SideResiduals> residuals = {});

    // A copy with these curved parts, in any order, instead of its own. Throws InvalidArgument.
    LdfLibrary with_curved(std::vector<CurvedPart> parts) const;

    const Medium& medium() const { return m_medium; }
    std::uint64_t photons() const { return m_photons; }  // per angle
    std::uint64_t seed() const { return m_seed; }
    const std::vector<AngleResult>& results() const { return m_results; }
    const std::vector<double>& angles_deg() const { return m_simulated.angles_deg(); }
    bool is_calibrated() const { return !m_residuals.empty(); }  // see `calibrated`
    const std::vector<SideResiduals>& residuals() const { return m_residuals; }

    // Power that leaves one side per unit incident power. Includes unscattered light, excludes specular reflection at
    // entry. The angle (degrees) is within the simulated ones, the albedo in [0, 1).
    double total(double angle_deg, double albedo, Side side) const;

    // `total` on a surface of a curvature, without light that crosses a ball unscattered.
    double total(double angle_deg, double albedo, Side side, double curvature) const;

    // Standard error of `total`, from the scatter of the batches. A calibrated library hardly has any; there it
    // includes the error of the exact totals and the errors that calibration and interpolation between angles left.
    double standard_error(double angle_deg, double albedo, Side side) const;
    double standard_error(double angle_deg, double albedo, Side side, double curvature) const;

    // Reflectance under uniform diffuse light: the mean of `total` over the hemisphere, weighted by the cosine.
    double diffuse_reflectance(double albedo) const;

    // The scattered part of the LDF, per unit incident power.
    RadialProfile profile(double angle_deg, double albedo, Side side) const override;

    // The scattered part as one profile around each pole (transport/tally/tally.h), without the blur of `profile`; with
    // `group` (< group_count), from that group of batches alone.
    std::vector<RadialProfile> pole_profiles(double angle_deg, double albedo, Side side,
                                             std::optional<std::size_t> group = {}) const;

    // Profiles around the entry, per unit power that *entered*: `angle_weights` include the Fresnel transmittance at
    // entry. Nodes are the simulated angles, and angles between them where poles move along the beam.
    std::vector<RadialProfile> node_profiles(double albedo, Side side) const override;
    AngleWeights angle_weights(double angle_deg, Side side) const override;

    // Curved parts, by ascending curvatures.
    const std::vector<CurvedPart>& curved() const { return m_curved; }
    std::vector<double> curvatures() const override;

    // A curved part may have fewer angles than the plane: its difference to the plane is interpolated between them.
    std::vector<RadialProfile> curved_node_profiles(double albedo, Side side, std::size_t curvature) const override;

    // The scattered part of the LDF on a surface of a curvature, linear between `curvatures`.
    RadialProfile curved_profile(double angle_deg, double albedo, Side side, double curvature) const;

    std::vector<BallisticExit> ballistic(double angle_deg, Side side) const override;

    // Throws InvalidArgument if the library does not reach to this angle.
    void check_angle(double angle_deg) const override;

    // Throws InvalidArgument for the far side of a half-space.
    void check_side(Side side) const override;

private:
    using PoleProfiles = std::vector<RadialProfile>;  // of the simulated angles

    // Part of an interpolated value: an index of `curvatures` and its weight.
    struct CurvatureWeight {
        std::size_t index;
        double weight;
    };
    // Weights of the two curvatures around. Throws InvalidArgument.
    std::array<CurvatureWeight, 2> curvature_weights(double curvature) const;

    // Adds the unscattered light of slabs to `node_profiles`, between the exits halfway to the neighbouring angles.
    void add_unscattered(std::vector<RadialProfile>& profiles, Side side) const;

    const CurvedPart* curved_part(std::size_t curvature) const;  // null for the plane

    // Weights of the plane's simulated angles and of a part's, for weights of the plane's angles.
    struct SplitWeights {
        AngleWeights plane;
        AngleWeights part;
    };
    SplitWeights split_weights(const AngleWeights& weights, const LdfLibrary& part) const;

    AngleWeights simulated_weights(double angle_deg) const;

    // Variance of a total with these weights of the simulated angles, from the scatter of the batches.
    double statistical_variance(const AngleWeights& weights, double albedo, Side side) const;
    double residual(double angle_deg, double albedo, Side side) const;
    double entry_transmittance(double angle_deg) const;

    // Profiles of each pole at the simulated angles, with the centre still at 0.
    std::vector<PoleProfiles> simulated_profiles(double albedo, Side side, std::optional<std::size_t> group = {},
                                                 RadialEnd end = RadialEnd::faded) const;
    RadialProfile interpolated(double angle_deg, Side side, std::size_t pole, const PoleProfiles& nodes,
                               const AngleWeights& weights) const;

    Medium m_medium;
    std::uint64_t m_photons;
    std::uint64_t m_seed;
    std::vector<AngleResult> m_results;  // ascending angles
    std::vector<SideResiduals> m_residuals;
    AngleNodes m_simulated;
    std::array<AngleNodes, side_count> m_nodes;  // of `node_profiles`
    std::vector<CurvedPart> m_curved;
};

// Simulates a medium at these angles, on a plane and, at the same angles, on surfaces of these curvatures. See
// `simulate`.
LdfLibrary simulate_library(const Medium& medium, const std::vector<double>& angles_deg, std::uint64_t photons,
                            std::uint64_t seed, int threads, std::string_view kernel, Progress& progress,
                            const std::vector<double>& curvatures = {});

// Simulates surfaces of these curvatures; 0 is left out. Curvatures and angles are in any order, but distinct.
std::vector<CurvedPart> simulate_curved(const Medium& medium, const std::vector<double>& curvatures,
                                        const std::vector<double>& angles_deg, std::uint64_t photons,
                                        std::uint64_t seed, int threads, std::string_view kernel, Progress& progress);

// A result of a curved surface with what files keep: numbers rounded to what their noise allows, without batches and
// their deviations.
AngleResult slimmed(AngleResult result);

// Power that leaves one side at one angle, per unit power that entered and scattered.
double scattered_total(const SideResult& side, double albedo);

// A copy with exact totals: the power p_b of every order bin b, and so its distribution, is scaled by the s_b that
// minimize
//   sum_b (s_b - 1)^2 / v_b + sum_k ((sum_b a_k^n_b s_b p_b - T_k) / e_k)^2,
// with v_b the relative variance of p_b, and T_k the exact total, within e_k, at albedo a_k (every other one of
// `compared_albedos`). The batches are scaled alike, so that their scatter is the remaining statistical error. Throws
// InvalidArgument for a library of too few photons.
LdfLibrary calibrated(const LdfLibrary& library, int threads);

// Mean exitance of each texel per unit incident power, in 1/mfp^2: size x size texels of side `pitch` (mean free
// paths), rows v upward, columns u, O at the centre. The beam lights a disk of this diameter around O evenly (0: a
// point). On a curved surface distances from O are chords. Throws InvalidArgument.
std::vector<float> ldf_image(const LdfLibrary& library, double angle_deg, double albedo, std::size_t size, double pitch,
                             Side side, double beam_diameter, double curvature);

// Standard error of each texel of `ldf_image`, from the scatter between groups of batches, with a relative error of
// about a quarter. Throws InvalidArgument.
std::vector<float> ldf_image_standard_error(const LdfLibrary& library, double angle_deg, double albedo,
                                            std::size_t size, double pitch, Side side, double beam_diameter);

// Write and read one multi-part OpenEXR file; library_format.h describes the layout. Without the plane, a file has only
// the curved parts. Throw IoError.
void save_library(const LdfLibrary& library, const std::filesystem::path& path, bool with_plane = true);
LdfLibrary load_library(const std::filesystem::path& path);
std::vector<CurvedPart> load_curved(const std::filesystem::path& path);

}  // namespace beamspread
