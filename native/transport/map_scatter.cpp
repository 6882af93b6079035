#include "transport/map_scatter.h"

#include <algorithm>
#include <cmath>

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

std::vector<float> relative_deviations(std::span<const Tally* const> groups, std::span<const std::size_t> harmonics)
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
        for (std::size_t a = 0; a < scatter_albedos.size(); ++a)
            for (std::size_t i = 0; i < means[a].size(); ++i) {
                const double ring = means[a][i % radius_bin_count];
                const double difference = by_albedo[a][group][i] - means[a][i];
                deviations.push_back(ring > 0.0 ? rounded_to_five_bits(difference / ring) : 0.0F);
            }
    return deviations;
}

std::vector<double> deviations_at(std::span<const float> deviations, std::size_t group, double albedo)
{
    const auto place = [](double a) { return std::log1p(-a); };
    const double x = std::clamp(place(albedo), place(scatter_albedos.back()), place(scatter_albedos.front()));
    std::size_t a = 0;
    while (a + 2 < scatter_albedos.size() && x < place(scatter_albedos[a + 1]))
        ++a;
    const double t = (x - place(scatter_albedos[a])) / (place(scatter_albedos[a + 1]) - place(scatter_albedos[a]));
    const std::size_t values = deviations.size() / (group_count * scatter_albedos.size());
    const float* low = deviations.data() + (group * scatter_albedos.size() + a) * values;
    const float* high = low + values;
    std::vector<double> result(values);
    for (std::size_t i = 0; i < values; ++i)
        result[i] = (1.0 - t) * static_cast<double>(low[i]) + t * static_cast<double>(high[i]);
    return result;
}

}  // namespace beamspread
