// Media, solvers and lights from Python's sequences and names.
#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "base/error.h"
#include "python/casters.h"
#include "solve/problem/problem.h"

namespace beamspread {

using Sources = std::vector<std::shared_ptr<LdfSource>>;

// The media do not own the sources. Throws InvalidArgument if the sequences differ in length, or if a source does not know
// the side's light.
inline std::vector<ChannelMedium> media_of(const Sources& ldf, const std::vector<double>& albedo,
                                           const std::vector<double>& mean_free_path, const std::string& side)
{
    const Side leaving = side_from_name(side);
    if (ldf.size() != albedo.size() || mean_free_path.size() != albedo.size())
        reject("ldf", "of another number of channels than albedo", "one per channel");
    std::vector<ChannelMedium> media;
    for (std::size_t c = 0; c < albedo.size(); ++c) {
        ldf[c]->check_side(leaving);
        media.push_back({ldf[c].get(), albedo[c], mean_free_path[c], leaving});
    }
    return media;
}

// Throws InvalidArgument.
inline Solver named_solver(const std::string& solver)
{
    return named<Solver>("solver", solver,
                         {{"fft", Solver::fft}, {"direct", Solver::direct}, {"adaptive", Solver::adaptive}});
}

// A light and the arrays that it views: Python's PlaneLight.
struct HeldLight {
    PlaneLight light;
    std::vector<py::object> arrays;
};

using Lights = std::vector<const HeldLight*>;

// The plane of the lights; empty without any.
inline Plane plane_of(const Lights& lights, std::array<double, 2> pitch)
{
    if (lights.empty())
        return {};
    const View2D<const float>& irradiance = lights.front()->light.irradiance;
    return {irradiance.width, irradiance.height, pitch[0], pitch[1]};
}

inline Problem problem_of(const Lights& lights, const Sources& ldf, const std::vector<double>& albedo,
                          const std::vector<double>& mean_free_path, std::array<double, 2> pitch, double tolerance,
                          const std::string& side = "reflected")
{
    Problem problem;
    problem.plane = plane_of(lights, pitch);
    problem.channels = media_of(ldf, albedo, mean_free_path, side);
    for (const HeldLight* held : lights)
        problem.lights.push_back(held->light);
    problem.tolerance = tolerance;
    return problem;
}

}  // namespace beamspread
