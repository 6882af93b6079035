// Rays of a patch at the samples of its canvas.
#pragma once

#include <vector>

#include "bake/canvas.h"
#include "base/threads.h"
#include "scene/ray_gather.h"

namespace beamspread {

// Passes on rays at samples of the canvas; of a mirrored patch also at all mirror images, with their directions.
class PatchSink final : public RaySink {
public:
    PatchSink(const Canvas& canvas, const Patch& patch, RaySink& next) : m_canvas(canvas), m_patch(patch), m_next(next)
    {
    }

    void add(const RayRun& run) override;

private:
    // Part of a row of texels at an image of the patch.
    struct Image {
        std::size_t first;  // on the canvas
        std::size_t begin;  // in the run
        std::size_t count;
        bool is_flipped;
    };

    static std::vector<Image> images(std::size_t at, std::size_t count, std::size_t size, std::size_t before,
                                     std::size_t all);

    struct Scratch {
        std::vector<Vec3f> travel, irradiance;
    };

    const Canvas& m_canvas;
    const Patch& m_patch;
    RaySink& m_next;
    PerThread<Scratch> m_scratch;
};

}  // namespace beamspread
