// Samples of a mesh that bends, for the solver `surface`.
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "bake/surface.h"
#include "solve/surface/surface_field.h"

namespace beamspread {

// In the order of the texels: one for each texel inside the mesh, several for a long one, or one for narrow ones side by
// side in a row, as around the pole of a ball.
struct BentSamples {
    // `mean_free_path`: the shortest one of all channels, metres.
    BentSamples(const Surface& surface, double mean_free_path);

    // Samples of a texel; none outside of the mesh.
    struct Range {
        std::uint32_t begin = 0;
        std::uint32_t count = 0;
    };

    // Narrow texels that share samples, and the runs of them beside.
    struct Run {
        std::size_t first = 0;  // texel
        std::size_t count = 0;
        float area = 0.0f;  // m^2
        bool goes_on = false;  // true if the next run begins where this one ends, on the mesh, too
    };

    // [texel] not 0 inside the mesh for texels that the mesh covers wholly.
    std::vector<std::uint8_t> whole_texels(const Surface& surface) const;

    // The run of a texel; null for most.
    const Run* run_of(std::size_t texel) const
    {
        return run.empty() || run[texel] == 0 ? nullptr : &runs[run[texel] - 1];
    }

    // The texel of the nearest run beside that of a texel, and its weight beside the texel's own: values of runs are
    // linear in between.
    std::pair<std::size_t, float> beside(std::size_t texel) const;

    // Parts of a `SurfaceProblem`, in its order.
    std::vector<SurfaceSample> all;
    std::vector<SampleSteps> steps;
    std::vector<SampleNeighbors> neighbors;
    std::vector<float> uneven_sides;
    std::vector<Range> of_texel;
    std::vector<Run> runs;
    std::vector<std::uint32_t> run;  // [texel] number of its run from 1 on, 0: none; empty: no texel has one

private:
    // A texel, or a run of them.
    struct Part {
        Vec3 position{0.0}, normal{0.0}, tangent{0.0}, step_x{0.0}, step_y{0.0};
        float area = 0.0f;
        float coverage = 1.0f;
        bool is_uneven = false;
    };

    void find_runs(const Surface& surface);
    // True unless texels in a row, and those beside, are whole, of about the same size, and without a sharp edge between.
    static bool is_uneven(const Surface& surface, std::size_t first, std::size_t count);
    Part part_of(const Surface& surface, std::size_t texel) const;
    void add(const ReceiverGrid& grid, std::size_t texel, const Part& part, double mean_free_path);
    void find_neighbors(const ReceiverGrid& grid);
};

}  // namespace beamspread
