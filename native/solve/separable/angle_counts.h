// How much light there is from which angles.
#pragma once

#include <cstddef>
#include <vector>

namespace beamspread {

// By tan(theta / 2), which needs no trigonometry and in which LDFs are smooth everywhere.
class AngleCounts {
public:
    static constexpr std::size_t bins = 2048;  // from 0 to 1
    struct Bin {
        double light = 0.0;  // sum of irradiance
        double texels = 0.0;
    };

    void add(double half_tangent, double light, double texels);
    void add(const AngleCounts& others);

    // Widens the range of what there is; adding to the bins does not.
    void include(float first, float last);

    float first() const { return m_first; }  // beyond `last`: nothing is lit
    float last() const { return m_last; }
    const Bin& bin(std::size_t i) const { return m_bins[i]; }

private:
    float m_first = 1.0f;
    float m_last = 0.0f;
    std::vector<Bin> m_bins = std::vector<Bin>(bins);
};

}  // namespace beamspread
