#include <algorithm>
#include <cmath>
#include <vector>

#include "base/constants.h"
#include "solve/surface/chord_table.h"

namespace beamspread {

namespace {

// Standard deviation of the window in which sums over a grid are compared with integrals, in pitches, and its end. Wider:
// more of the kernel, more time.
constexpr double window_width = 1.6;
constexpr int window_end = 8;

// The harmonic 0 of a profile times a Gaussian window, lengths in mean free paths.
class WindowedProfile final : public RadialFunction {
public:
    WindowedProfile(const RadialProfile& profile, double pitch) : m_profile(profile)
    {
        constexpr int steps_per_octave = 32;
        constexpr int octaves = 16;
        for (int i = 0; i <= steps_per_octave * octaves; ++i) {
            m_radii.push_back(window_end * pitch * std::exp2(static_cast<double>(i) / steps_per_octave - octaves));
            const double middle = 0.5 * (m_radii.back() + (i == 0 ? 0.0 : m_radii[m_radii.size() - 2])) / pitch;
            m_window.push_back(std::exp(-0.5 * middle * middle / (window_width * window_width)));
            m_inside.push_back(profile.cumulative(m_radii.back())[0]);
            m_sum.push_back((i == 0 ? 0.0 : m_sum.back()) +
                            m_window.back() * (m_inside.back() - (i == 0 ? 0.0 : m_inside[m_inside.size() - 2])));
        }
    }

    std::size_t harmonics() const override { return 1; }

    Harmonics cumulative(double r) const override
    {
        const auto after =
            static_cast<std::size_t>(std::lower_bound(m_radii.begin(), m_radii.end(), r) - m_radii.begin());
        if (after == m_radii.size())
            return {m_sum.back()};
        return {m_sum[after] - m_window[after] * (m_inside[after] - m_profile.cumulative(r)[0])};
    }

    Harmonics remaining(double r) const override { return {m_sum.back() - cumulative(r)[0]}; }
    double support() const override { return m_radii.back(); }

private:
    const RadialProfile& m_profile;
    std::vector<double> m_radii;   // ascending
    std::vector<double> m_window;  // from the previous radius to this one
    std::vector<double> m_inside;  // of the profile
    std::vector<double> m_sum;     // of the product
};

}  // namespace

double grid_excess(const RadialProfile& profile, double radius)
{
    const double pitch = std::sqrt(pi) * radius;
    const WindowedProfile windowed(profile, pitch);
    double sum = 2.0 * pi * windowed.cumulative(radius)[0];
    for (int y = 0; y <= window_end; ++y)
        for (int x = 1; x * x + y * y <= window_end * window_end; ++x)
            sum += 4.0 * pitch * pitch * disk_mean(windowed, radius, pitch * std::hypot(x, y))[0];
    return sum - 2.0 * pi * windowed.cumulative(windowed.support())[0];
}

}  // namespace beamspread
