// Light on a surface of any shape and the luminance that it causes, by the solver `surface`: a sum over pairs of
// samples, each by the LDF of its own curvature.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "base/progress.h"
#include "base/threads.h"
#include "base/vec.h"
#include "solve/separable/light_terms.h"
#include "solve/surface/pair_sum.h"
#include "solve/surface/pair_tables.h"
#include "solve/surface/surface_basis.h"
#include "solve/surface/surface_kernels.h"
#include "solve/surface/surface_tree.h"
#include "solve/surface/uneven_sample.h"

namespace beamspread {

// Steps from a sample to its neighbors: they span its area, or that of a whole one in proportion.
struct SampleSteps {
    Vec3f x, y;
};

// Indices of the samples beside a sample, or its own one where there is none.
using SampleNeighbors = std::array<std::uint32_t, 4>;

struct SurfaceProblem {
    std::span<const SurfaceSample> samples;
    std::span<const SampleSteps> steps{};  // [sample]; empty: unknown
    std::span<const SampleNeighbors> neighbors{};  // [sample]; empty: all are as large as the sample
    // [sample] sides of the texels of samples whose neighbors are no even lattice, metres; 0: they are; empty: all are.
    std::span<const float> uneven_sides{};
    std::vector<ChannelMedium> channels;  // at most 3
    double tolerance = 1e-3;  // largest error of a luminance against all pairs, relative to the largest
    double max_angle_deg = 90.0;  // light comes at up to this angle from the normal
    bool is_colored = false;  // true if channels of all light together are not proportional
    int threads = 0;  // 0: all
    std::size_t max_moment_bytes = 0;  // bytes of moments of the light; 0: any
    bool is_direct = false;  // true: all pairs one by one, the truth
};

class SurfaceField {
public:
    // Views the problem's samples, which must outlive the field. Throws InvalidArgument, MemoryLimit, Cancelled.
    SurfaceField(const SurfaceProblem& problem, Progress& progress);

    // Adds rays, one at each of some samples. `travel` has vectors of the sample's frame with z < 0; the power of a ray is
    // its irradiance, W/m^2, times the color. Several threads may add to different samples at once.
    void add(std::span<const std::uint32_t> samples, const Vec3f* travel, const Vec3f* irradiance,
             const std::vector<double>& color);

    // Removes all rays; the basis and tables stay.
    void clear();

    // Writes [sample][channel], radiance in W/(m^2 sr): the sum over all rays. Throws Cancelled.
    void solve(Progress& progress, float* luminance);

    // The same in parts: `gather` after the last ray, then `solve` for some samples at a time, those where `is_wanted`
    // [sample] is not 0. Others keep their luminance. Throws Cancelled.
    void gather();
    void solve(std::span<const std::uint8_t> is_wanted, Progress& progress, float* luminance);

    // The following are known after `gather`. Results are channels, or media that channels share.
    std::size_t results() const { return m_tables.lanes.results; }

    // Weights of some of a sample's moments.
    struct Weight {
        std::size_t moment;
        float weight;
    };

    // Radiant exitance over the largest one, if the same light as at a sample enters around it up to a radius (metres) and
    // nowhere else: weights of a result for `exitance_within`.
    std::vector<Weight> weights_within(double radius, std::size_t result) const;
    float exitance_within(std::span<const Weight> weights, std::size_t sample) const;

    // Largest luminance of each channel, about.
    std::vector<float> brightest() const;

    // Whether the light of a solved sample comes from pairs that bend more than the media's LDFs cover.
    bool is_beyond(std::size_t sample) const { return m_is_beyond[sample] != 0; }

    // Share of the area whose light comes from such pairs; after all samples are solved.
    double beyond_share() const;

    // Mean number of sources, samples and clusters, of all samples' light.
    double mean_sources() const { return static_cast<double>(m_pairs) / static_cast<double>(m_problem.samples.size()); }

    // Bytes of a sample's moments.
    std::size_t moment_bytes() const { return m_basis.lanes.moments() * sizeof(float); }

    const SurfaceBasis& basis() const { return m_basis; }

private:
    struct Scratch {
        BeamMoments moments;
        BeamRow beams;
        std::vector<float> irradiance;  // [set][beam]
        std::vector<float> values;  // [term][beam]
    };

    // Light of pairs at a sample, [result], and its part by pairs that bend more than the tables.
    struct Exitance {
        std::array<float, 3> sums{};
        float beyond = 0.0f;
    };

    void find_opening();
    std::size_t solve_group(const SurfaceTree::Group& group, const SurfaceTree::Opening& opening,
                            SurfaceTree::Sources& sources,
                            const std::function<void(std::size_t, const Exitance&)>& store_exitance) const;
    float neighbor_disk(std::size_t sample) const;
    LatticeShape lattice(std::size_t sample) const;
    void add_self(std::size_t sample, SurfaceTree::Sources& sources, std::array<float, 3>& sums) const;
    // False if too many samples are near.
    bool add_uneven(std::size_t sample, SurfaceTree::Sources& sources, std::array<float, 3>& sums) const;
    void store(std::size_t sample, const Exitance& exitance, float* luminance);
    double luminance_of(const ChannelSets::Member& member, float exitance) const;
    void set_color(const std::vector<double>& color);

    SurfaceProblem m_problem;
    std::shared_ptr<SurfaceKernels> m_kernels;
    const SurfaceBasis& m_basis;
    PairTables m_tables;
    SurfaceTree m_tree;
    std::vector<float> m_moments;  // [sample], then [node of the tree], as in `SurfaceBasis`
    std::vector<double> m_color;  // of all light, if channels are proportional
    std::mutex m_color_lock;
    PerThread<Scratch> m_scratch;
    PerThread<SurfaceTree::Sources> m_sources;
    SurfaceTree::Opening m_opening;
    std::array<float, 3> m_brightest{};  // [result] radiant exitance
    std::vector<std::uint8_t> m_is_beyond;  // [sample]
    std::size_t m_pairs = 0;
};

}  // namespace beamspread
