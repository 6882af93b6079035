// Planes of a surface side by side on one plane of texels, so that they share the choice of terms, kernels and transforms.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "bake/surface.h"
#include "solve/problem/problem.h"

namespace beamspread {

// A surface whose texel (0, 0) is the canvas's texel (x, y). If it is mirrored, its mirror images fill the canvas.
struct Patch {
    const Surface* surface;
    std::size_t index = 0;  // among all surfaces of the bake
    std::size_t x = 0;
    std::size_t y = 0;
};

struct Canvas {
    Plane plane;
    std::vector<Patch> patches;
    double area;  // of all patches, m^2

    // A surface alone, with its mirror images.
    explicit Canvas(const Surface& surface, std::size_t index = 0);

    // Patches with gaps, which may be 0, `side` texels wide.
    Canvas(std::span<const Patch> unplaced, std::size_t side, const Plane& gaps);

    std::size_t samples() const { return plane.texels(); }
    bool is_alone() const { return patches.size() == 1; }
    bool is_mirrored() const { return patches.front().surface->mirrored > 0.0; }

    // Fraction of the texels of all patches that a patch has.
    double share(const Patch& patch) const;

    // Sample of the canvas at a sample of a patch.
    std::size_t sample(const Patch& patch, std::size_t of_patch) const
    {
        const std::size_t width = patch.surface->grid.width;
        return (patch.y + of_patch / width) * plane.width + patch.x + of_patch % width;
    }
};

// Canvases of all planes among the surfaces, which share one if their texels are of one size. Light of one patch does
// not reach another: patches of about one size lie on a divided plane, others have gaps that follow from the reach of
// the media. `max_texels`: of a canvas of several patches; 0: each surface stays alone.
std::vector<Canvas> canvases(const std::vector<Surface>& surfaces, const std::vector<ChannelMedium>& media,
                             std::size_t max_texels);

}  // namespace beamspread
