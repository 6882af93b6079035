// Samples on a regular grid of angle, albedo and anisotropy.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "ldf/samples/ldf_sample.h"

namespace beamspread {

// The two values of an axis around a requested one.
struct Bracket {
    double lower = 0.0;
    double upper = 0.0;   // equal to `lower` if the axis has the requested value
    double weight = 0.0;  // linear weight of the upper value

    double weight_of(std::size_t i) const { return i ? weight : 1.0 - weight; }
};

// The cell of the grid around a requested angle, albedo and g.
struct SampleCell {
    Bracket angle;   // degrees
    Bracket albedo;
    Bracket g;  // zeros if the samples' g is unknown
    // [angle][albedo][g], 0: lower, 1: upper; the same sample twice if `lower` equals `upper`.
    std::array<std::array<std::array<const LdfSample*, 2>, 2>, 2> corners{};
};

class SampleGrid {
public:
    // Takes one sample per corner of the grid, in any order, all with the same texels and beam diameter. The caller
    // owns the samples. Throws InvalidArgument.
    explicit SampleGrid(std::vector<const LdfSample*> samples);

    // The cell around a request; without g, all samples must have the same. Throws InvalidArgument, naming the samples'
    // span, for requests outside.
    SampleCell cell(double angle_deg, double albedo, std::optional<double> g) const;

    const LdfSample& first() const { return *m_samples.front(); }

private:
    const LdfSample* find(double angle_deg, double albedo, std::optional<double> g) const;

    std::vector<const LdfSample*> m_samples;
    std::vector<double> m_angles;  // ascending
    std::vector<double> m_albedos;
    std::vector<double> m_gs;  // empty if unknown
};

}  // namespace beamspread
