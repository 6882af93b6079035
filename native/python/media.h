// Media and solvers from Python's sequences and names.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "base/error.h"
#include "python/casters.h"
#include "solve/problem/problem.h"

namespace beamspread {

using Sources = std::vector<std::shared_ptr<LdfSource>>;

// The media do not own the sources. Throws InvalidArgument if the sequences differ in length.
inline std::vector<ChannelMedium> media_of(const Sources& ldf, const std::vector<double>& albedo,
                                           const std::vector<double>& mean_free_path)
{
    if (ldf.size() != albedo.size() || mean_free_path.size() != albedo.size())
        reject("ldf", "of another number of channels than albedo", "one per channel");
    std::vector<ChannelMedium> media;
    for (std::size_t c = 0; c < albedo.size(); ++c)
        media.push_back({ldf[c].get(), albedo[c], mean_free_path[c]});
    return media;
}

// Throws InvalidArgument.
inline Solver named_solver(const std::string& solver)
{
    return named<Solver>("solver", solver,
                         {{"fft", Solver::fft}, {"direct", Solver::direct}, {"adaptive", Solver::adaptive}});
}

}  // namespace beamspread
