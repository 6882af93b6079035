// Samples of a mesh that bends, for the solver `surface`.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "bake/surface.h"
#include "solve/surface/surface_field.h"

namespace beamspread {

// In the order of the texels: one for each texel inside the mesh, or several for a long one.
struct BentSamples {
    // `mean_free_path`: the shortest one of all channels, metres.
    BentSamples(const Surface& surface, double mean_free_path);

    // [texel] not 0 inside the mesh for texels that the mesh covers wholly.
    std::vector<std::uint8_t> whole_texels(const Surface& surface) const;

    // As in `SurfaceProblem`.
    std::vector<SurfaceSample> all;
    std::vector<SampleSteps> steps;
    std::vector<SampleNeighbors> neighbors;
    std::vector<float> whole_areas;
    std::vector<std::size_t> first;  // [texel], and the number of all

private:
    void find_neighbors(const ReceiverGrid& grid);
};

}  // namespace beamspread
