// The light of terms, row by row.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "solve/separable/light_terms.h"

namespace beamspread {

// Adds beams of changing directions to the moments of terms.
class BeamMoments {
public:
    // Where the value of a term at the first beam is.
    using Values = std::function<float*(std::size_t term)>;

    // To terms [first, end); `colors`: of the beams in each set. `irradiance`: of the beams in each set, after each other;
    // null: in all of them that of the beams.
    void add(const LightTerms& terms, const BeamRow& beams, const std::vector<float>& colors, std::size_t first,
             std::size_t end, const Values& values, const float* irradiance = nullptr);

private:
    std::vector<std::uint32_t> m_step;  // in the tables of the basis
    std::vector<float> m_part;
    std::vector<float> m_cosine;  // cos(m beta), sin(m beta), times irradiance where that is the same for all sets
    std::vector<float> m_sine;
    std::vector<float> m_u;
    std::vector<float> m_product;
};

// The light of one row of texels: of lights that are kept, and what else has been added up.
class TermRow {
public:
    // Finds the values of terms [first, first + count).
    void start(const LightTerms& terms, const RowSpan& span, std::size_t first, std::size_t count);

    const float* values(std::size_t term) const { return m_values.data() + (term - m_first) * m_width; }

private:
    std::size_t m_width = 0;
    std::size_t m_first = 0;
    std::vector<float> m_values;  // [term - first][texel]
    std::vector<float> m_light;
    BeamRow m_beams;  // of one light
    BeamMoments m_moments;
};

// Adds rays to the moments of terms. One object for each thread; no two threads may add to one row at once.
class MomentSum {
public:
    // `is_colored`: true if channels differ by more than factors; else the largest counts for all. `color` is a factor of
    // each channel.
    void add(LightTerms& terms, const RayRow& rays, const std::vector<double>& color, bool is_colored);

private:
    void add_beams(LightTerms& terms, const RowSpan& span, const float* irradiance = nullptr);

    BeamRow m_beams;
    BeamMoments m_moments;
    std::vector<float> m_irradiance;  // [set][beam]
    std::vector<float> m_colors;
};

}  // namespace beamspread
