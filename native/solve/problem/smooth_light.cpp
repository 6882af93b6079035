#include "solve/problem/smooth_light.h"

#include <algorithm>
#include <cmath>
#include <complex>

#include <Eigen/Dense>

#include "base/threads.h"

namespace beamspread {

namespace {

// Harmonics that are found together: powers of azimuths follow from each other. Fewer: more starts of these.
constexpr std::size_t harmonics_at_once = 8;
static_assert(harmonic_count % harmonics_at_once == 0);

// A direction between two of the angles.
struct Place {
    std::size_t first;
    float part;  // toward the next
    std::complex<float> azimuth;  // of unit length

    explicit Place(const Vec3f& travel)
    {
        const float across = std::sqrt(travel.x * travel.x + travel.y * travel.y);  // hypotf asks for a new glibc
        azimuth = across > 0.0f ? std::complex(travel.x / across, travel.y / across) : std::complex(1.0f, 0.0f);
        const float at = across / (1.0f - travel.z) * static_cast<float>(SmoothLight::angles - 1);  // tan(theta / 2)
        first = std::min(static_cast<std::size_t>(at), SmoothLight::angles - 2);
        part = at - static_cast<float>(first);
    }
};

using Moments = Eigen::Matrix<float, Eigen::Dynamic, static_cast<int>(SmoothLight::angles), Eigen::RowMajor>;

// The rays of texels, by harmonic.
class RayMoments {
public:
    explicit RayMoments(const TexelRays& rays) : m_rays(rays)
    {
        m_places.reserve(rays.travel.size());
        for (const Vec3f& travel : rays.travel)
            m_places.emplace_back(travel);
    }

    // Moments of harmonics that follow each other.
    class Walk {
    public:
        Walk(const RayMoments& of, std::size_t m) : m_of(of), m_powers(of.m_places.size())
        {
            std::ranges::transform(of.m_places, m_powers.begin(), [m](const Place& place) {
                return std::polar(1.0f, static_cast<float>(m) * std::arg(place.azimuth));
            });
        }

        // Writes the moments of the next harmonic, [texel][angle].
        void next(Moments& cosine, Moments& sine)
        {
            const std::size_t texels = m_of.m_rays.texels;
            const auto rows = static_cast<Eigen::Index>(texels);
            cosine.setZero(rows, Eigen::NoChange);
            sine.setZero(rows, Eigen::NoChange);
            for (std::size_t i = 0; i < m_powers.size(); ++i) {
                const Place& place = m_of.m_places[i];
                const std::complex<float> value = m_of.m_rays.irradiance[i] * m_powers[i];
                const std::size_t at = i % texels * SmoothLight::angles + place.first;
                cosine.data()[at] += (1.0f - place.part) * value.real();
                cosine.data()[at + 1] += place.part * value.real();
                sine.data()[at] += (1.0f - place.part) * value.imag();
                sine.data()[at + 1] += place.part * value.imag();
                m_powers[i] *= place.azimuth;
            }
        }

    private:
        const RayMoments& m_of;
        std::vector<std::complex<float>> m_powers;
    };

private:
    const TexelRays& m_rays;
    std::vector<Place> m_places;
};

}  // namespace

SmoothLight::SmoothLight() : m_products(harmonic_count * angles * angles) {}

SmoothLight::SmoothLight(std::span<const Vec3f> travel, const std::vector<double>& of_directions) : SmoothLight()
{
    const std::vector<Place> places(travel.begin(), travel.end());
    for (std::size_t i = 0; i < places.size(); ++i)
        for (std::size_t j = 0; j < places.size(); ++j) {
            const Place& a = places[i];
            const Place& b = places[j];
            const double apart = std::arg(std::complex<double>(a.azimuth) * std::conj(std::complex<double>(b.azimuth)));
            for (std::size_t m = 0; m < harmonic_count; ++m) {
                const double product = of_directions[i * places.size() + j] * std::cos(static_cast<double>(m) * apart);
                for (const std::size_t k : {0, 1})
                    for (const std::size_t l : {0, 1})
                        products(m)[(a.first + k) * angles + b.first + l] +=
                            product * (k ? a.part : 1.0f - a.part) * (l ? b.part : 1.0f - b.part);
            }
        }
}

SmoothLight::SmoothLight(const TexelRays& first, const TexelRays& second) : SmoothLight()
{
    const RayMoments a(first);
    const RayMoments b(second);
    parallel_for(harmonic_count / harmonics_at_once, [&](std::size_t item) {
        RayMoments::Walk walk_a(a, item * harmonics_at_once);
        RayMoments::Walk walk_b(b, item * harmonics_at_once);
        Moments cosine_a, sine_a, cosine_b, sine_b;
        for (std::size_t m = item * harmonics_at_once; m < (item + 1) * harmonics_at_once; ++m) {
            walk_a.next(cosine_a, sine_a);
            walk_b.next(cosine_b, sine_b);
            const Eigen::MatrixXf sum = cosine_a.transpose() * cosine_b + sine_a.transpose() * sine_b;
            const double texels = static_cast<double>(first.texels);
            for (std::size_t k = 0; k < angles; ++k)
                for (std::size_t l = 0; l < angles; ++l)
                    products(m)[k * angles + l] =
                        static_cast<double>(sum(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(l))) / texels;
        }
    });
}

double SmoothLight::half_tangent(std::size_t angle)
{
    return static_cast<double>(angle) / static_cast<double>(angles - 1);
}

void SmoothLight::add(const SmoothLight& light, double factor)
{
    for (std::size_t i = 0; i < m_products.size(); ++i)
        m_products[i] += factor * light.m_products[i];
}

double SmoothLight::squared_moment(std::size_t m, const std::array<double, angles>& function) const
{
    double sum = 0.0;
    for (std::size_t k = 0; k < angles; ++k)
        for (std::size_t l = 0; l < angles; ++l)
            sum += function[k] * function[l] * products(m)[k * angles + l];
    return std::max(sum, 0.0);
}

}  // namespace beamspread
