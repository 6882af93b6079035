// Luminance at single texels of a plane, apart by the functions of a basis.
#pragma once

#include <cstddef>
#include <vector>

#include "solve/separable/light_pyramid.h"
#include "solve/separable/low_rank.h"
#include "solve/term_choice/probe_tables.h"

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
    struct Span;

    // Whether these squares are, and so all that they are made of.
    bool dark(std::size_t level, const Span& rows, const Span& columns) const;
    void add_quarters(Place& place, std::size_t level, std::size_t y, std::size_t x) const;
    void add_far(Place& place, bool nearby) const;
    void add_near(Place& place, std::size_t y, std::size_t x) const;
    void add_nearby(Place& place) const;

    const std::vector<LightPyramid>& m_lights;
    std::size_t m_height;
    std::size_t m_width;
    double m_pitch_x;  // metres
    double m_pitch_y;
    ProbeTables m_tables;
};

}  // namespace beamspread
