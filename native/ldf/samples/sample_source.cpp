#include "ldf/samples/sample_source.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>
#include <utility>

#include "base/constants.h"
#include "base/error.h"
#include "ldf/samples/interpolate.h"

namespace beamspread {

namespace {

// Largest step in degrees between nodes, at which samples are interpolated; between nodes their moments are. Larger:
// less time, larger errors.
constexpr double max_step_deg = 5.0;

// Rounding error of directions in single precision, degrees.
constexpr double rounding_deg = 1e-4;

// Points along each side of a texel in sums over rings. More: smaller errors, more time.
constexpr double points_per_texel = 4.0;

// Number of harmonics of a sample's profile. More: smaller errors, more time; an image of texels hardly resolves more.
constexpr std::size_t sample_harmonics = 17;

// Exitance of the texel at (u, v), averaged with that at (u, -v); 0 outside the image.
double even_exitance(const LdfSample& sample, double u, double v)
{
    const double x = std::floor(u / sample.pitch + 0.5 * static_cast<double>(sample.width));
    double sum = 0.0;
    if (x < 0.0 || x >= static_cast<double>(sample.width))
        return sum;
    for (const double side : {v, -v}) {
        const double y = std::floor(side / sample.pitch + 0.5 * static_cast<double>(sample.height));
        if (y >= 0.0 && y < static_cast<double>(sample.height))
            sum +=
                0.5 *
                std::max(0.0, static_cast<double>(sample.at(static_cast<std::size_t>(y), static_cast<std::size_t>(x))));
    }
    return sum;
}

// Integrals of the image times cos(m phi) over the ring from r0 to r1.
std::array<double, sample_harmonics> ring_moments(const LdfSample& sample, double r0, double r1)
{
    const double spacing = sample.pitch / points_per_texel;
    const auto radii = static_cast<int>(std::max(2.0, std::ceil((r1 - r0) / spacing)));
    const auto azimuths = static_cast<int>(std::max(8.0 * sample_harmonics, std::ceil(pi * r1 / spacing)));
    std::array<double, sample_harmonics> moments{};
    for (int j = 0; j < azimuths; ++j) {
        const double phi = (j + 0.5) * pi / azimuths;
        const double cos_phi = std::cos(phi);
        const double sin_phi = std::sin(phi);
        double power = 0.0;
        for (int i = 0; i < radii; ++i) {
            const double r = r0 + (i + 0.5) * (r1 - r0) / radii;
            power += even_exitance(sample, r * cos_phi, r * sin_phi) * r;
        }
        power *= (r1 - r0) / radii * 2.0 * pi / azimuths;
        double previous = cos_phi;
        double cosine = 1.0;
        for (double& moment : moments) {
            moment += power * cosine;
            previous = std::exchange(cosine, 2.0 * cos_phi * cosine - previous);
        }
    }
    return moments;
}

std::vector<double> node_angles(const std::vector<LdfSample>& samples)
{
    std::vector<double> sampled;
    for (const LdfSample& sample : samples)
        sampled.push_back(sample.angle_deg);
    std::sort(sampled.begin(), sampled.end());
    std::vector<double> angles{sampled.front()};
    for (const double angle : sampled) {
        const double from = angles.back();
        const int steps = static_cast<int>(std::ceil((angle - from - rounding_deg) / max_step_deg));
        for (int i = 1; i <= steps; ++i)
            angles.push_back(from + (angle - from) * i / steps);
    }
    return angles;
}

// Largest power of a sample. No medium returns more light than arrives; three standard errors of a simulation of a
// thousand photons, .5 / sqrt(photons) each (binomial), are allowed.
constexpr double max_power = 1.05;

void check_power(const LdfSample& sample)
{
    if (const double power = sample.power(); !(power >= 0.0 && power <= max_power))
        reject("ldf", "a sample of power " + std::to_string(power),
               "0 to 1.05, of which .05 are noise: the integral of exitance per unit incident power");
}

}  // namespace

RadialProfile sample_profile(const LdfSample& sample)
{
    const double farthest = 0.5 * sample.pitch * std::hypot(sample.width, sample.height);
    const std::size_t harmonics = sample.angle_deg == 0.0 ? 1 : sample_harmonics;
    std::vector<double> moments(harmonics * radius_bin_count, 0.0);
    double power = 0.0;
    double inner = 0.0;
    for (std::size_t k = 0; k < radius_bin_count && inner < farthest; ++k) {
        // The last bin includes the rest of the image.
        const double outer = k + 1 < radius_bin_count ? std::min(radius_bin_edge(k), farthest) : farthest;
        const auto ring = ring_moments(sample, inner, outer);
        for (std::size_t m = 0; m < harmonics; ++m)
            moments[m * radius_bin_count + k] = ring[m];
        power += ring[0];
        inner = outer;
    }
    if (power > 0.0)
        for (double& moment : moments)
            moment *= std::max(0.0, sample.power()) / power;
    return RadialProfile(0.0, moments, RadialDetail::bins);
}

SampleSource::SampleSource(std::vector<LdfSample> samples, Interpolation method)
    : m_samples(std::move(samples)), m_method(method)
{
    for (const LdfSample& sample : m_samples) {
        check_power(sample);
        m_pointers.push_back(&sample);
    }
    const SampleGrid grid(m_pointers);
    grid.cell(m_samples.front().angle_deg, m_samples.front().albedo, std::nullopt);  // rejects samples of several g
    m_angles = node_angles(m_samples);
}

void SampleSource::check_angle(double angle_deg) const
{
    if (angle_deg >= m_angles.front() - rounding_deg && angle_deg <= m_angles.back() + rounding_deg)
        return;
    std::ostringstream span;
    span << m_angles.front() << " <= angle <= " << m_angles.back() << " degrees, the span of the samples";
    reject("angle", angle_deg, span.str());
}

void SampleSource::check_side(Side side) const
{
    if (side != Side::reflected)
        reject("side", "'transmitted'", "'reflected' for LDF samples, which don't know the light of the far side");
}

RadialProfile SampleSource::at_node(double angle_deg, double albedo) const
{
    const std::pair key(angle_deg, albedo);
    {
        const std::scoped_lock lock(m_mutex);
        if (const auto cached = m_cache.find(key); cached != m_cache.end())
            return cached->second;
    }
    RadialProfile profile =
        sample_profile(interpolate(m_pointers, angle_deg, albedo, std::nullopt, m_method, std::nullopt));
    const std::scoped_lock lock(m_mutex);
    return m_cache.emplace(key, std::move(profile)).first->second;
}

RadialProfile SampleSource::profile(double angle_deg, double albedo, Side) const
{
    check_angle(angle_deg);
    return at_node(std::clamp(angle_deg, m_angles.front(), m_angles.back()), albedo);
}

std::vector<RadialProfile> SampleSource::node_profiles(double albedo, Side) const
{
    std::vector<RadialProfile> profiles;
    for (const double angle : m_angles)
        profiles.push_back(at_node(angle, albedo));
    return profiles;
}

LdfSource::AngleWeights SampleSource::angle_weights(double angle_deg, Side /*side*/) const
{
    check_angle(angle_deg);
    std::vector<double> weights(m_angles.size(), 0.0);
    if (m_angles.size() == 1) {
        weights.front() = 1.0;
        return {weights, weights, {0, 0}};
    }
    const auto above = std::upper_bound(m_angles.begin() + 1, m_angles.end() - 1, angle_deg);
    const auto upper = static_cast<std::size_t>(above - m_angles.begin());
    const double t = std::clamp((angle_deg - *(above - 1)) / (*above - *(above - 1)), 0.0, 1.0);
    weights[upper - 1] = 1.0 - t;
    weights[upper] = t;
    return {weights, weights, {upper - 1, upper}};
}

}  // namespace beamspread
