// Luminance of the texels of a mesh that bends, from the light on its samples.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "bake/bake.h"
#include "bake/bent_samples.h"
#include "bake/nested_texels.h"
#include "base/progress.h"
#include "scene/receiver.h"
#include "solve/surface/surface_field.h"

namespace beamspread {

// Solves all texels, or few: texels at steps of 4, those between where light or the mesh changes from texel to texel, and
// more around where luminance is not as that of the larger step tells (sparse point representation, Holmström 1999,
// doi:10.1137/S1064827597316278). The others are interpolated, which is off by about the field's tolerance at most.
class BentSolution {
public:
    // How exact luminance has to be, and how noisy the light is.
    struct Accuracy {
        double tolerance;
        double noise = 0.0;  // standard deviation of a texel's light by rays, over the mean
        std::vector<double> texels{};  // [channel] number of texels that the light of one fills, about, and its own
    };

    // `texels`: null solves all. All are viewed.
    BentSolution(const ReceiverGrid& grid, const BentSamples& samples, const NestedTexels* texels);

    // Part of the samples that are solved at least.
    double least_part() const;

    // Writes [texel][channel]; 0 outside of the mesh. Rays have been added to the field. Throws Cancelled.
    void solve(SurfaceField& field, const Accuracy& accuracy, Progress& progress, float* luminance);

    // After `solve`.
    BentShares shares() const;

private:
    using Mask = std::vector<std::uint8_t>;  // [texel]
    struct Light;

    void solve_all(SurfaceField& field, Progress& progress, float* luminance);
    bool is_first(std::size_t texel) const;
    bool has_samples(std::size_t texel) const { return m_samples.of_texel[texel].count > 0; }
    float mean_of_pieces(std::size_t texel, std::size_t channel, std::size_t channels) const;
    double mean_of(std::span<const float> values, std::size_t index, std::size_t count) const;
    std::size_t find_wanted(std::size_t step, const Mask& is_rough, Mask& is_wanted) const;
    void mark_changes(std::size_t step, const Light& light, Mask& is_rough) const;
    void mark_differences(std::size_t step, const Light& light, const float* luminance, Mask& is_rough) const;
    void solve_some(const Mask& is_wanted, SurfaceField& field, Progress& progress, float* luminance);
    void interpolate(std::size_t step, std::size_t channels, float* luminance);

    const ReceiverGrid& m_grid;
    const BentSamples& m_samples;
    const NestedTexels* m_texels;
    Mask m_is_solved, m_is_beyond;
    std::vector<float> m_values;  // [sample][channel]
};

}  // namespace beamspread
