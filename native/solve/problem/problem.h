// What a solver is asked: light on a plane of texels, and the medium beneath.
#pragma once

#include <cstddef>
#include <vector>

#include "ldf/radial/ldf_source.h"
#include "solve/problem/light.h"

namespace beamspread {

// The medium that a colour channel sees.
struct ChannelMedium {
    const LdfSource* ldf = nullptr;
    double albedo = 0.0;
    double mean_free_path = 1.0;  // metres

    bool operator==(const ChannelMedium&) const = default;
};

// Light that is still to come, at a few texels spread over the plane.
struct LightSurvey {
    Plane plane;
    std::vector<PlaneLight> lights;
};

enum class Solver { fft, direct, adaptive };

struct Problem {
    Plane plane;
    std::vector<ChannelMedium> channels;
    std::vector<PlaneLight> lights;
    Solver solver = Solver::fft;
    double tolerance = 1e-3;  // relative error of the radiance that an approximating solver may make
    int threads = 0;
    std::size_t memory = std::size_t{5} << 26;  // bytes that spectra may take at once; beyond, in tiles
    std::size_t coarsening = 0;  // of the grid that light spreads far on, texels; 1: none, 0: what costs least
    LightSurvey to_come{};           // in a field of light, see `SpectralField`
    std::size_t most_for_light = 0;  // bytes that what is kept of light to come may take; 0: any
};

// Throws InvalidArgument for a plane, media, light or options that solvers don't cover.
void validate(const Problem& problem);

// Likewise for a light that comes later.
void validate(const Problem& problem, const PlaneLight& light);

}  // namespace beamspread
