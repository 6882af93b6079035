// The luminance distribution functions of one medium for every angle of incidence and every albedo.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string_view>
#include <vector>

#include "base/progress.h"
#include "ldf/library/angle_spline.h"
#include "ldf/radial/ldf_source.h"
#include "medium/medium.h"
#include "transport/simulation.h"

namespace beamspread {

// Albedos at which the totals of calibrated libraries are compared with exact ones. Calibration makes them equal at
// every other one of these, from the first to the last: their weights of the orders span those of all albedos.
inline constexpr std::array<double, 31> compared_albedos = {
    0.01,  0.05,   0.1,    0.2,    0.3,    0.4,     0.5,     0.6,     0.7,    0.75,  0.8,
    0.86,  0.9,    0.93,   0.95,   0.97,   0.98,    0.986,   0.99,    0.995,  0.997, 0.9983,
    0.999, 0.9995, 0.9997, 0.9998, 0.9999, 0.99995, 0.99997, 0.99998, 0.99999};

// Weight of each order bin at an albedo: the mean of albedo^n over the bin, to second order in the spread
// of its orders.
std::array<double, order_bin_count> order_weights(const SideResult& side, double albedo);

// Relative errors of the totals of a calibrated library, at a simulated angle and halfway to the next.
struct Residuals {
    std::array<float, compared_albedos.size()> here{};
    std::array<float, compared_albedos.size()> halfway{};
};
using SideResiduals = std::array<Residuals, side_count>;

class LdfLibrary final : public LdfSource {
public:
    // Results in any order, one per angle; of a calibrated library also, by ascending angles, what is left of its
    // errors. Throws InvalidArgument.
    LdfLibrary(const Medium& medium, std::uint64_t photons, std::uint64_t seed, std::vector<AngleResult> results,
               std::vector<SideResiduals> residuals = {});

    const Medium& medium() const { return m_medium; }
    std::uint64_t photons() const { return m_photons; }  // per angle
    std::uint64_t seed() const { return m_seed; }
    const std::vector<AngleResult>& results() const { return m_results; }
    const std::vector<double>& angles_deg() const { return m_simulated.angles_deg(); }
    bool is_calibrated() const { return !m_residuals.empty(); }  // see `calibrated`
    const std::vector<SideResiduals>& residuals() const { return m_residuals; }

    // Power that leaves one side per unit power incident, unscattered light included, specular reflection
    // at entry excluded. Angle in degrees within the simulated ones, albedo in [0, 1).
    double total(double angle_deg, double albedo, Side side) const;

    // Standard error of `total`, from the scatter of the batches. For a calibrated library, whose statistical error is
    // next to nothing, also the error of the exact totals, and what calibration and interpolation between angles left.
    double standard_error(double angle_deg, double albedo, Side side) const;

    // `total` of the reflected side under uniform diffuse light: the mean over the hemisphere, weighted by cosine.
    double diffuse_reflectance(double albedo) const;

    // The scattered part of the LDF, per unit power incident.
    RadialProfile profile(double angle_deg, double albedo, Side side) const override;

    // The same as a sum of profiles around each pole (transport/tally/poles.h), which shows what one pole blurs; or from a group
    // of batches alone, a simulation of its own; group < group_count.
    std::vector<RadialProfile> pole_profiles(double angle_deg, double albedo, Side side,
                                             std::optional<std::size_t> group = {}) const;

    // Per unit power that *entered*, around the first pole; the weights include the Fresnel transmittance at entry. At the
    // simulated angles, and between them where a beam has images.
    std::vector<RadialProfile> node_profiles(double albedo, Side side) const override;
    AngleWeights angle_weights(double angle_deg) const override;

    std::vector<BallisticExit> ballistic(double angle_deg, Side side) const override;

    // Throws InvalidArgument if the library does not reach to this angle.
    void check_angle(double angle_deg) const override;

private:
    using PoleProfiles = std::vector<RadialProfile>;  // of the simulated angles

    AngleWeights simulated_weights(double angle_deg) const;
    double residual(double angle_deg, double albedo, Side side) const;
    double entry_transmittance(double angle_deg) const;

    // Of each pole, which has no place yet.
    std::vector<PoleProfiles> simulated_profiles(double albedo, Side side, std::optional<std::size_t> group = {}) const;
    RadialProfile interpolated(double angle_deg, Side side, std::size_t pole, const PoleProfiles& nodes,
                               const AngleWeights& weights) const;

    Medium m_medium;
    std::uint64_t m_photons;
    std::uint64_t m_seed;
    std::vector<AngleResult> m_results;  // ascending angles
    std::vector<SideResiduals> m_residuals;
    AngleNodes m_simulated;
    AngleNodes m_nodes;  // that solvers know of
};

LdfLibrary simulate_library(const Medium& medium, const std::vector<double>& angles_deg, std::uint64_t photons,
                            std::uint64_t seed, int threads, std::string_view kernel, Progress& progress);

// A copy in which the power p_b of every order bin, with the distribution that it comes with, is scaled by the s_b that
// minimize  sum_b (s_b - 1)^2 / v_b + sum_k ((sum_b a_k^n_b s_b p_b - T_k) / e_k)^2:  v_b is the relative variance of
// p_b, and T_k the exact total at albedo a_k, every other one of `compared_albedos`, to within e_k. The batches follow,
// so that their scatter is the statistical error that remains. Throws InvalidArgument for a library of too few photons.
LdfLibrary calibrated(const LdfLibrary& library, int threads);

// One multi-part OpenEXR file; see library_format.h for the layout. Throw IoError.
void save_library(const LdfLibrary& library, const std::filesystem::path& path);
LdfLibrary load_library(const std::filesystem::path& path);

}  // namespace beamspread
