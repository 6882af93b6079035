// Luminance at single texels of a plane, apart by the functions of a basis.
#pragma once

#include <cstddef>
#include <vector>

#include "solve/light_pyramid.h"
#include "solve/low_rank.h"

namespace beamspread {

// Light of the texels around is taken as it is, that of squares of texels farther away as one beam each, the larger the
// farther: right to some percent, which is enough to tell what a function is worth.
class LuminanceProbe {
public:
    // The lights must outlive the probe.
    LuminanceProbe(const std::vector<LightPyramid>& lights, const LowRankBasis& basis, double pitch_x, double pitch_y);

    // Times pi, per unit irradiance.
    struct Reading {
        std::vector<float> parts;    // [medium][function]
        std::vector<double> nearby;  // [medium]: mean luminance of the 17 x 17 texels around
    };
    Reading read(std::size_t y, std::size_t x) const;

private:
    struct Place;

    // Tables below hold, for each rank, a row of harmonics up to the last that the basis has, in whole blocks; zero for
    // those that it lacks.
    std::size_t functions() const { return m_starts.back(); }

    void tabulate_angles(const LowRankBasis& basis);
    void tabulate_radii(const LowRankBasis& basis);
    void tabulate_widths();
    void integrate_near(const LowRankBasis& basis);
    void integrate_nearby(const LowRankBasis& basis);

    void add_square(Place& place, std::size_t level, std::size_t y, std::size_t x) const;
    void add_far(Place& place, std::size_t level, std::size_t y, std::size_t x) const;
    void add_near(Place& place, std::size_t y, std::size_t x) const;
    void add_nearby(Place& place) const;
    const float* at_angle(const Vec3f& direction) const;

    const std::vector<LightPyramid>& m_lights;
    std::size_t m_height;
    std::size_t m_width;
    double m_pitch_x;  // metres
    double m_pitch_y;
    std::size_t m_media;
    std::size_t m_ranks;
    std::size_t m_harmonics = 0;
    std::vector<std::size_t> m_starts;   // of each rank's row, and the end of the last
    std::vector<std::size_t> m_columns;  // [block]: its first harmonic
    std::vector<std::size_t> m_place;   // of each function in these rows
    float m_first;                      // of the table of angles
    float m_per_step;
    std::vector<float> m_by_angle;   // [step]
    double m_least_radius;           // of the table of radii, metres
    std::size_t m_radii = 0;         // within the kernels' reach
    std::vector<float> m_by_radius;  // [step][medium]: density times the area of a texel
    std::vector<float> m_by_width;   // [step][m]: what is left of harmonics over the width of squares
    std::vector<float> m_near;       // [dy][dx][phase][medium], of a quadrant: texel integrals
    std::vector<double> m_nearby;    // [medium][rank][y][x]: of m = 0, light of squares, summed from a corner
};

}  // namespace beamspread
