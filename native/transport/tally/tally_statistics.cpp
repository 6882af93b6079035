#include "transport/tally/tally.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace beamspread {

namespace {

// Root mean square of the omitted harmonics, relative to the mean around a ring, below which they are dropped without
// regard to noise. Larger: smaller files, larger errors.
constexpr double negligible = 3e-3;

// Sums of cos(m phi) over an octave of radii and some rows.
struct Octave {
    std::array<double, harmonic_count> first{};
    std::array<double, harmonic_count> second{};
};

// Sums rows and radii that texels see together. A ring alone cannot separate signal from noise: weak harmonics that
// many rings share would be lost.
std::vector<Octave> octaves(const Tally& first, const Tally& second, std::size_t begin, std::size_t end)
{
    std::vector<Octave> sums(1);
    for (std::size_t k = 0; k < radius_bin_count; ++k) {
        if (k > 1 && std::ilogb(radius_bin_edge(k - 1)) != std::ilogb(radius_bin_edge(k - 2)))
            sums.emplace_back();
        for (std::size_t row = begin; row < end; ++row)
            for (std::size_t m = 0; m < harmonics_of(row); ++m) {
                sums.back().first[m] += first.ring(row, k)[m];
                sums.back().second[m] += second.ring(row, k)[m];
            }
    }
    return sums;
}

std::size_t significant_count(const std::vector<Octave>& octaves, std::size_t count)
{
    // Compute mean squares around the rings, relative to the rings' mean and weighted by their power.
    std::array<double, harmonic_count> signal{};
    std::array<double, harmonic_count> noise{};
    double power = 0.0;
    for (const Octave& octave : octaves) {
        const double ring = octave.first[0] + octave.second[0];
        if (!(ring > 0.0))
            continue;
        power += ring;
        // cos^2 has the mean 1/2, and c_m is twice the mean of cos(m phi).
        for (std::size_t m = 1; m < count; ++m) {
            const double a = octave.first[m];
            const double b = octave.second[m];
            signal[m] += 2.0 * 4.0 * a * b / ring;
            noise[m] += 2.0 * (a - b) * (a - b) / ring;
        }
    }
    // Maximize the gain: a harmonic removes its signal from the error and adds its noise.
    std::size_t best = 1;
    double gain = 0.0;
    double best_gain = 0.0;
    for (std::size_t m = 1; m < count; ++m) {
        gain += signal[m] - noise[m];
        if (gain > best_gain) {
            best_gain = gain;
            best = m + 1;
        }
    }
    double left_out = 0.0;
    while (best > 1 && left_out + signal[best - 1] <= negligible * negligible * power)
        left_out += signal[--best];
    return best;
}

// Albedos at which deviations are stored, around the first pole and around mirror images. A group's relative deviation
// changes slowly with log(1 - albedo), in which it is interpolated, and hardly at all around mirror images, where light
// has scattered few times.
constexpr std::array<double, 4> first_albedos = {0.6, 0.95, 0.995, 0.9995};
constexpr std::array<double, 2> image_albedos = {0.6, 0.995};

std::span<const double> albedos_of(std::size_t pole)
{
    return pole == 0 ? std::span<const double>(first_albedos) : std::span<const double>(image_albedos);
}

// Rounds to five binary digits, which half precision holds exactly.
float rounded_to_five_bits(double x)
{
    if (std::abs(x) < 0x1p-14)
        return 0.0F;
    int exponent = 0;
    const double mantissa = std::frexp(x, &exponent);
    return static_cast<float>(std::ldexp(std::round(mantissa * 32.0) / 32.0, exponent));
}

// Number of a group's deviations before this pole's.
std::size_t count_before(std::span<const std::size_t> harmonics, std::size_t radii, std::size_t pole)
{
    std::size_t count = 0;
    for (std::size_t before = 0; before < pole; ++before)
        count += albedos_of(before).size() * max_harmonics(harmonics, before) * radii;
    return count;
}

// Sums over the scattering orders, weighted for an albedo, [harmonic][radius bin].
std::vector<double> contracted(const Tally& tally, double albedo, std::span<const std::size_t> harmonics,
                               std::size_t radii, std::size_t pole)
{
    std::vector<double> sums(max_harmonics(harmonics, pole) * radii, 0.0);
    for (std::size_t row = first_row(pole); row < end_row(pole); ++row) {
        const std::size_t b = order_bin_of(row);
        if (b == 0 || tally.weight[b] == 0.0)
            continue;
        const double weight = std::pow(albedo, tally.weight_order[b] / tally.weight[b]);
        for (std::size_t k = 0; k < radii; ++k) {
            const double* ring = tally.ring(row, k);
            for (std::size_t m = 0; m < harmonics[row]; ++m)
                sums[m * radii + k] += weight * ring[m];
        }
    }
    return sums;
}

// Appends the deviations of each group at an albedo, [harmonic][radius bin].
void add_deviations(std::vector<std::vector<float>>& by_group, std::span<const Tally* const> groups, double albedo,
                    std::span<const std::size_t> harmonics, std::size_t radii, std::size_t pole)
{
    std::vector<std::vector<double>> sums;
    for (const Tally* group : groups)
        sums.push_back(contracted(*group, albedo, harmonics, radii, pole));
    std::vector<double> mean(sums.front().size(), 0.0);
    for (const std::vector<double>& of_group : sums)
        for (std::size_t i = 0; i < mean.size(); ++i)
            mean[i] += of_group[i] / static_cast<double>(groups.size());
    for (std::size_t group = 0; group < groups.size(); ++group)
        for (std::size_t i = 0; i < mean.size(); ++i) {
            const double power = mean[i % radii];
            const double difference = sums[group][i] - mean[i];
            by_group[group].push_back(power > 0.0 ? rounded_to_five_bits(difference / power) : 0.0F);
        }
}

}  // namespace

std::array<std::size_t, row_count> significant_harmonics(const Tally& first, const Tally& second)
{
    std::array<std::size_t, row_count> counts{};
    for (std::size_t begin = 0; begin < row_count;) {
        const bool is_octave = begin >= exact_orders && begin < order_bin_count;
        const std::size_t end = begin + (is_octave ? 4 : 1);
        const std::size_t count = significant_count(octaves(first, second, begin, end), harmonics_of(begin));
        std::fill(counts.begin() + static_cast<std::ptrdiff_t>(begin),
                  counts.begin() + static_cast<std::ptrdiff_t>(end), count);
        begin = end;
    }
    return counts;
}

std::size_t deviation_count(std::span<const std::size_t> harmonics, std::size_t radii)
{
    return count_before(harmonics, radii, pole_count);
}

std::vector<float> relative_deviations(std::span<const Tally* const> groups, std::span<const std::size_t> harmonics,
                                       std::size_t radii)
{
    std::vector<std::vector<float>> by_group(groups.size());
    for (std::size_t pole = 0; pole < pole_count; ++pole)
        for (const double albedo : albedos_of(pole))
            add_deviations(by_group, groups, albedo, harmonics, radii, pole);
    std::vector<float> all;
    for (const std::vector<float>& of_group : by_group)
        all.insert(all.end(), of_group.begin(), of_group.end());
    return all;
}

std::vector<double> deviations_at(std::span<const float> deviations, std::span<const std::size_t> harmonics,
                                  std::size_t radii, std::size_t group, std::size_t pole, double albedo)
{
    const std::span<const double> albedos = albedos_of(pole);
    const auto log_absorption = [](double a) { return std::log1p(-a); };
    const double x =
        std::clamp(log_absorption(albedo), log_absorption(albedos.back()), log_absorption(albedos.front()));
    std::size_t high = 1;
    while (high + 1 < albedos.size() && x < log_absorption(albedos[high]))
        ++high;
    const double low_end = log_absorption(albedos[high - 1]);
    const double t = (x - low_end) / (log_absorption(albedos[high]) - low_end);

    const std::size_t rings = max_harmonics(harmonics, pole);
    const float* stored =
        deviations.data() + group * deviation_count(harmonics, radii) + count_before(harmonics, radii, pole);
    std::vector<double> result(rings * radius_bin_count, 0.0);
    for (const auto& [albedo_index, weight] : {std::pair(high - 1, 1.0 - t), std::pair(high, t)})
        for (std::size_t m = 0; m < rings; ++m)
            for (std::size_t k = 0; k < radii; ++k)
                result[m * radius_bin_count + k] +=
                    weight * static_cast<double>(stored[(albedo_index * rings + m) * radii + k]);
    return result;
}

}  // namespace beamspread
