// Interpolation of LDFs between samples on a regular grid of angle, albedo and anisotropy.
#pragma once

#include <array>
#include <cstddef>
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

// Gaussian blur of (height, width) values with a standard deviation of `sigma` texels (0: none). At borders the weights
// inside the image are normalized.
std::vector<double> blur(const std::vector<double>& values, std::size_t width, std::size_t height, double sigma);

// Smooth positive version of an LDF's image, whose logarithm is hardly noisy.
struct Envelope {
    std::vector<double> value;     // nowhere 0
    std::vector<double> variance;  // of the image's noise in one texel, relative to the value squared
};

// The image itself where its relative noise is below 10 %. Elsewhere m blur(image) / blur(m), with m the mean over
// rings around O and the narrowest blur that brings the noise below 10 %; the division by blur(m) compensates a steep
// decline. m declines exponentially beyond the last light. The image's odd part in v, which an LDF lacks, estimates the
// noise: a library's image stays unchanged.

Envelope envelope(const LdfSample& sample);

enum class Interpolation { angular, adaptive, planar };

// Interpolates the LDF at an angle, albedo and g from samples on a regular grid.
//
// angular: Manabe et al. 2012, Eq. 3 and 4. Exitance is blended with linear weights in angle, albedo and g at the same
// direction of angular space; H and Q, `height` mean free paths above it, are blended with the same weights. As all
// points Q have one height, texels keep their solid angles: the total of the blend is the blend of the totals, except
// for light that moves across the images' borders. The result does not depend on the height, because the maps to
// angular space and back cancel except for the shift of H.
//
// planar: the same weights at the same (u, v).
//
// adaptive: see adaptive_interpolation.cpp.
//
// Returns a sample's own image at its angle, albedo and g. Throws InvalidArgument.
LdfSample interpolate(const std::vector<const LdfSample*>& samples, double angle_deg, double albedo,
                      std::optional<double> g, Interpolation method, std::optional<double> height);

// The image of method `adaptive` at an angle, albedo and g inside the cell.
std::vector<float> adaptive_image(const SampleCell& cell, double angle_deg, double albedo, std::optional<double> g);

}  // namespace beamspread
