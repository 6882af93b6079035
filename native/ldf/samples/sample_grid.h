// Samples on a regular grid of angle, albedo and anisotropy.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "ldf/samples/ldf_sample.h"

namespace beamspread {

// The two values of an axis around the one that is asked for, and its place between them.
struct Bracket {
    double lower = 0.0;
    double upper = 0.0;  // equal: the axis has that one value here
    double weight = 0.0;  // of the upper one, linear

    double weight_of(std::size_t i) const { return i ? weight : 1.0 - weight; }
};

// The cell of the grid that holds what is asked for.
struct SampleCell {
    Bracket angle;   // degrees
    Bracket albedo;
    Bracket g;  // both unknown where the samples don't say
    // [angle][albedo][g], 0: lower, 1: upper; the same sample twice where an axis has one value.
    std::array<std::array<std::array<const LdfSample*, 2>, 2>, 2> corners{};
};

class SampleGrid {
public:
    // In any order, one per corner of the grid, all with the same texels and beam; pointers stay with the caller.
    // Throws InvalidArgument.
    explicit SampleGrid(std::vector<const LdfSample*> samples);

    // Throws InvalidArgument, naming the span, for what lies outside of it. Without g, that of the samples, if it is
    // one.
    SampleCell cell(double angle_deg, double albedo, std::optional<double> g) const;

    const LdfSample& first() const { return *m_samples.front(); }

private:
    const LdfSample* find(double angle_deg, double albedo, std::optional<double> g) const;

    std::vector<const LdfSample*> m_samples;
    std::vector<double> m_angles;  // ascending
    std::vector<double> m_albedos;
    std::vector<double> m_gs;  // empty: unknown
};

}  // namespace beamspread
