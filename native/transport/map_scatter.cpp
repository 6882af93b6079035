#include "transport/map_scatter.h"

#include <algorithm>
#include <cmath>

#include "transport/counted_bins.h"

namespace beamspread {

namespace {

// To what half precision holds exactly.
float rounded_to_five_bits(double x)
{
    if (std::abs(x) < 0x1p-14)
        return 0.0F;
    int exponent = 0;
    const double mantissa = std::frexp(x, &exponent);
    return static_cast<float>(std::ldexp(std::round(mantissa * 32.0) / 32.0, exponent));
}

// Sums over the orders at an albedo, [harmonic][radius bin].
std::vector<double> contracted(const Tally& tally, double albedo, std::span<const std::size_t> harmonics)
{
    const std::size_t most = *std::max_element(harmonics.begin(), harmonics.end());
    std::vector<double> sums(most * radius_bin_count, 0.0);
    for (std::size_t b = 1; b < order_bin_count; ++b) {
        if (tally.weight[b] == 0.0)
            continue;
        const double weight = std::pow(albedo, tally.weight_order[b] / tally.weight[b]);
        for (std::size_t k = 0; k < radius_bin_count; ++k) {
            const double* ring = tally.ring(b, k);
            for (std::size_t m = 0; m < harmonics[b]; ++m)
                sums[m * radius_bin_count + k] += weight * ring[m];
        }
    }
    return sums;
}

}  // namespace

std::vector<std::size_t> scatter_bins(const Medium& medium, std::size_t albedo, std::size_t radii)
{
    if (fine_orders(medium) == 0 || albedo < 2)
        return counted_bins(medium, 0, radii);
    if (albedo > 2)
        return {};
    std::vector<std::size_t> bins = counted_bins(medium, order_bin_count, radii);
    std::erase_if(bins, [](std::size_t k) { return k < first_fine_bin; });
    return bins;
}

std::size_t scatter_count(const Medium& medium, std::size_t radii)
{
    std::size_t count = 0;
    for (std::size_t a = 0; a < scatter_albedos.size(); ++a)
        count += scatter_bins(medium, a, radii).size();
    return count;
}

std::vector<float> relative_deviations(const Medium& medium, std::span<const Tally* const> groups,
                                       std::span<const std::size_t> harmonics, std::size_t radii)
{
    std::vector<std::vector<std::vector<double>>> by_albedo;
    std::vector<std::vector<double>> means;
    for (const double albedo : scatter_albedos) {
        std::vector<std::vector<double>>& of_groups = by_albedo.emplace_back();
        for (const Tally* group : groups)
            of_groups.push_back(contracted(*group, albedo, harmonics));
        std::vector<double>& mean = means.emplace_back(of_groups.front().size(), 0.0);
        for (const std::vector<double>& sums : of_groups)
            for (std::size_t i = 0; i < sums.size(); ++i)
                mean[i] += sums[i] / static_cast<double>(groups.size());
    }
    std::vector<float> deviations;
    for (std::size_t group = 0; group < groups.size(); ++group)
        for (std::size_t a = 0; a < scatter_albedos.size(); ++a) {
            const std::vector<std::size_t> bins = scatter_bins(medium, a, radii);
            for (std::size_t ring = 0; ring < means[a].size(); ring += radius_bin_count)
                for (const std::size_t k : bins) {
                    const double power = means[a][k];
                    const double difference = by_albedo[a][group][ring + k] - means[a][ring + k];
                    deviations.push_back(power > 0.0 ? rounded_to_five_bits(difference / power) : 0.0F);
                }
        }
    return deviations;
}

std::vector<double> deviations_at(const Medium& medium, std::span<const float> deviations, std::size_t radii,
                                  std::size_t group, double albedo)
{
    const auto place = [](double a) { return std::log1p(-a); };
    const double x = std::clamp(place(albedo), place(scatter_albedos.back()), place(scatter_albedos.front()));
    std::size_t high = 1;
    while (high + 1 < scatter_albedos.size() && x < place(scatter_albedos[high]))
        ++high;
    const double t =
        (x - place(scatter_albedos[high - 1])) / (place(scatter_albedos[high]) - place(scatter_albedos[high - 1]));

    const std::size_t values = deviations.size() / group_count;
    const std::size_t harmonics = values / scatter_count(medium, radii);
    const float* kept = deviations.data() + group * values;
    std::vector<double> result(harmonics * radius_bin_count, 0.0);
    for (std::size_t a = 0; a <= high; ++a) {
        const std::vector<std::size_t> bins = scatter_bins(medium, a, radii);
        // What is not kept at the higher albedo stays as it is at the lower one.
        const double weight = a < high ? 1.0 : t;
        for (std::size_t m = 0; m < harmonics; ++m)
            for (const std::size_t k : bins) {
                double& deviation = result[m * radius_bin_count + k];
                deviation += weight * (static_cast<double>(*kept++) - deviation);
            }
    }
    return result;
}

}  // namespace beamspread
