// The task of a solver: light on a plane of texels, and the medium beneath.
#pragma once

#include <cstddef>
#include <vector>

#include "ldf/radial/ldf_source.h"
#include "solve/problem/light.h"

namespace beamspread {

// The medium of a color channel.
struct ChannelMedium {
    const LdfSource* ldf = nullptr;
    double albedo = 0.0;
    double mean_free_path = 1.0;  // metres

    bool operator==(const ChannelMedium&) const = default;
};

// Light that will be added to a light field later. It decides which terms the field keeps.
struct ComingLight {
    // All of that light at few texels, spread over a plane of the same size: its angles and colors.
    Plane plane;
    std::vector<PlaneLight> survey;

    // Some of that light at all texels; terms are chosen for its luminance. Empty: for any light of the survey's angles.
    std::vector<PlaneLight> examples;
};

enum class Solver { fft, direct, adaptive };

struct Problem {
    Plane plane;
    std::vector<ChannelMedium> channels;
    std::vector<PlaneLight> lights;
    Solver solver = Solver::fft;
    double tolerance = 1e-3;  // largest relative error of the luminance by an approximating solver
    int threads = 0;          // 0: all
    std::size_t memory = std::size_t{5} << 26;  // bytes of spectra at once; larger planes are solved in tiles
    std::size_t coarsening = 0;  // texels per node of the coarse grid of solver `fft`; 1: no such grid, 0: the fastest
    ComingLight coming{};
    std::size_t max_moment_bytes = 0;  // bytes of moments of coming light; 0: any
};

// Throws InvalidArgument for a plane, media, light or options that solvers don't cover.
void validate(const Problem& problem);

}  // namespace beamspread
