// Simulations of whole libraries.
#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "base/error.h"
#include "ldf/library/ldf_library.h"

namespace beamspread {

namespace {

// Precision of the numbers of curved surfaces: binary digits of a bin's power, and steps of a ratio between 0 and 1.
// Both errors are below the bins' noise. More: larger files.
constexpr int power_digits = 6;
constexpr float ratio_steps = 64.0F;

// Unit below which powers are rounded: the last digit of small numbers in files (library_format.h).
constexpr double smallest_power = 0x1p-38;

// Rounds a number to this many binary digits.
double rounded(double x, int digits, double smallest)
{
    int exponent = 0;
    std::frexp(x, &exponent);
    const double unit = std::max(std::ldexp(1.0, exponent - digits), smallest);
    return std::round(x / unit) * unit;
}

std::vector<double> sorted(std::vector<double> values)
{
    std::sort(values.begin(), values.end());
    return values;
}

// Curvatures, ascending, without 0.
std::vector<double> checked_curvatures(const std::vector<double>& curvatures)
{
    std::vector<double> all;
    for (const double curvature : sorted(curvatures)) {
        if (!all.empty() && all.back() == curvature)
            reject("curvatures", curvature, "distinct curvatures");
        if (curvature != 0.0)
            all.push_back(curvature);
    }
    return all;
}

std::vector<Beam> beams_of(double curvature, const std::vector<double>& angles_deg, std::uint64_t photons)
{
    std::vector<Beam> beams;
    for (const double angle : angles_deg)
        beams.push_back({angle, curvature, photons});
    return beams;
}

// Relative standard errors of a full result's totals, at the compared albedos.
SideResiduals relative_errors(const Medium& medium, std::uint64_t photons, std::uint64_t seed,
                              const AngleResult& result)
{
    const LdfLibrary alone(medium, photons, seed, {result});
    SideResiduals errors{};
    Residuals& reflected = errors[static_cast<std::size_t>(Side::reflected)];
    for (std::size_t k = 0; k < compared_albedos.size(); ++k) {
        const double total = alone.total(result.angle_deg, compared_albedos[k], Side::reflected);
        if (total > 0.0)
            reflected.here[k] = static_cast<float>(
                alone.standard_error(result.angle_deg, compared_albedos[k], Side::reflected) / total);
    }
    return errors;
}

// Parts of results, which are ordered by curvature and angle. Takes their contents.
std::vector<CurvedPart> parts_of(const Medium& medium, const std::vector<double>& curvatures, std::size_t angles,
                                 std::uint64_t photons, std::uint64_t seed, std::vector<AngleResult>::iterator result)
{
    std::vector<CurvedPart> parts;
    for (const double curvature : curvatures) {
        std::vector<AngleResult> slim;
        std::vector<SideResiduals> errors;
        for (std::size_t j = 0; j < angles; ++j, ++result) {
            errors.push_back(relative_errors(medium, photons, seed, *result));
            slim.push_back(slimmed(std::move(*result)));
        }
        parts.push_back(
            {curvature, std::make_shared<LdfLibrary>(medium, photons, seed, std::move(slim), std::move(errors))});
    }
    return parts;
}

}  // namespace

AngleResult slimmed(AngleResult result)
{
    for (SideResult& side : result.sides) {
        for (float& power : side.power)
            power = static_cast<float>(rounded(static_cast<double>(power), power_digits, smallest_power));
        for (float& ratio : side.ratios)
            ratio = std::round(ratio * ratio_steps) / ratio_steps;
        side.batch_totals.clear();
        side.deviations.clear();
    }
    return result;
}

LdfLibrary simulate_library(const Medium& medium, const std::vector<double>& angles_deg, std::uint64_t photons,
                            std::uint64_t seed, int threads, std::string_view kernel, Progress& progress,
                            const std::vector<double>& curvatures)
{
    const std::vector<double> angles = sorted(angles_deg);
    const AngleNodes checked(angles);  // rejects bad angles before the simulation
    const std::vector<double> curved = checked_curvatures(curvatures);
    std::vector<Beam> beams = beams_of(0.0, angles, photons);
    for (const double curvature : curved)
        for (const Beam& beam : beams_of(curvature, angles, photons))
            beams.push_back(beam);
    auto results = simulate(medium, beams, seed, threads, kernel, progress);
    const auto first_curved = results.begin() + static_cast<std::ptrdiff_t>(angles.size());
    auto parts = parts_of(medium, curved, angles.size(), photons, seed, first_curved);
    results.erase(first_curved, results.end());
    return LdfLibrary(medium, photons, seed, std::move(results)).with_curved(std::move(parts));
}

std::vector<CurvedPart> simulate_curved(const Medium& medium, const std::vector<double>& curvatures,
                                        const std::vector<double>& angles_deg, std::uint64_t photons,
                                        std::uint64_t seed, int threads, std::string_view kernel, Progress& progress)
{
    const std::vector<double> angles = sorted(angles_deg);
    const AngleNodes checked(angles);  // rejects bad angles before the simulation
    const std::vector<double> curved = checked_curvatures(curvatures);
    std::vector<Beam> beams;
    for (const double curvature : curved)
        for (const Beam& beam : beams_of(curvature, angles, photons))
            beams.push_back(beam);
    auto results = simulate(medium, beams, seed, threads, kernel, progress);
    return parts_of(medium, curved, angles.size(), photons, seed, results.begin());
}

}  // namespace beamspread
