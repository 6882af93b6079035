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
    // Returns the address of a term's value at the first beam.
    using Values = std::function<float*(std::size_t term)>;

    // Adds beams to terms [first, end). `colors` has their colour in each set, `irradiance` their irradiance,
    // [set][beam]; null: `beams.irradiance` in all sets.
    void add(const LightTerms& terms, const BeamRow& beams, const std::vector<float>& colors, std::size_t first,
             std::size_t end, const Values& values, const float* irradiance = nullptr);

private:
    std::vector<std::uint32_t> m_step;  // in the tables of the basis
    std::vector<float> m_part;
    std::vector<float> m_cosine;  // cos(m beta), sin(m beta), times irradiance if all sets share it
    std::vector<float> m_sine;
    std::vector<float> m_u;
    std::vector<float> m_product;
};

// The terms' light in one row of texels, from stored and added lights.
class TermRow {
public:
    // Computes the values of terms [first, first + count).
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

// Adds rays to the moments of terms. Each thread has its own object; threads must not add to the same row at once.
class MomentSum {
public:
    // Adds rays times `color`, a factor of each channel. `is_colored` is true if the rays' channels are not
    // proportional; otherwise the largest channel counts for all.
    void add(LightTerms& terms, const RayRow& rays, const std::vector<double>& color, bool is_colored);

private:
    void add_beams(LightTerms& terms, const RowSpan& span, const float* irradiance = nullptr);

    BeamRow m_beams;
    BeamMoments m_moments;
    std::vector<float> m_irradiance;  // [set][beam]
    std::vector<float> m_colors;
};

}  // namespace beamspread
