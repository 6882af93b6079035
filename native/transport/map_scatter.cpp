#include "transport/map_scatter.h"

#include <algorithm>
#include <cmath>

namespace beamspread {

namespace {

constexpr std::size_t group_values = scatter_albedos.size() * ring_value_count;

// To what half precision holds exactly.
float rounded_to_five_bits(double x)
{
    if (std::abs(x) < 0x1p-14)
        return 0.0F;
    int exponent = 0;
    const double mantissa = std::frexp(x, &exponent);
    return static_cast<float>(std::ldexp(std::round(mantissa * 32.0) / 32.0, exponent));
}

}  // namespace

MapScatter::MapScatter() : m_moments(group_count * group_values, 0.0) {}

void MapScatter::add(std::size_t group, const Tally& batch)
{
    for (std::size_t b = 1; b < order_bin_count; ++b) {
        if (batch.weight[b] == 0.0)
            continue;
        const double mean_order = batch.weight_order[b] / batch.weight[b];
        const double* from = batch.moments.data() + b * ring_value_count;
        for (std::size_t a = 0; a < scatter_albedos.size(); ++a) {
            const double weight = std::pow(scatter_albedos[a], mean_order);
            double* to = m_moments.data() + group * group_values + a * ring_value_count;
            for (std::size_t i = 0; i < ring_value_count; ++i)
                to[i] += weight * from[i];
        }
    }
}

std::vector<float> MapScatter::relative_deviations() const
{
    std::vector<double> mean(group_values, 0.0);
    for (std::size_t i = 0; i < m_moments.size(); ++i)
        mean[i % group_values] += m_moments[i] / static_cast<double>(group_count);
    std::vector<float> deviations(m_moments.size(), 0.0F);
    for (std::size_t i = 0; i < m_moments.size(); ++i) {
        const std::size_t value = i % group_values;
        const double ring = mean[value - value % harmonic_count];
        if (ring > 0.0)
            deviations[i] = rounded_to_five_bits((m_moments[i] - mean[value]) / ring);
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
    const float* low = deviations.data() + group * group_values + a * ring_value_count;
    const float* high = low + ring_value_count;
    std::vector<double> result(ring_value_count);
    for (std::size_t i = 0; i < ring_value_count; ++i)
        result[i] = (1.0 - t) * static_cast<double>(low[i]) + t * static_cast<double>(high[i]);
    return result;
}

}  // namespace beamspread
