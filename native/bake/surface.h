// Surface that a bake lights: samples with an area and a texture. Its samples are the texels of a plane's grid or of a mesh
// that bends.
#pragma once

#include "scene/receiver.h"
#include "solve/problem/problem.h"

namespace beamspread {

struct Surface {
    ReceiverGrid grid;
    double clearance = 0.0;  // largest distance of the surface's faces to the plane, metres
    // [sample] fraction inside the mesh, 0 to 1; null: 1. Not used where the grid bends: the areas of its texels count.
    const float* coverage = nullptr;
    const float* color_in = nullptr;  // [sample][channel] factors of light that enters; null: 1
    const float* color_out = nullptr;  // [sample][channel] factors of light that leaves; null: 1
    double mirrored = 0.0;  // distance from the borders to which mirror images return light, metres; 0: it leaves

    std::size_t samples() const { return grid.width * grid.height; }
    Plane plane() const { return {grid.width, grid.height, grid.pitch_x, grid.pitch_y}; }

    // The surface alone, wholly covered, with few texels for a survey: at most `side` along each side, fewer and at least
    // `min_side` if it has but a `share` of all surfaces' texels.
    Surface coarse(double share, std::size_t side, std::size_t min_side) const;

    // Multiplies luminance [sample][channel] by the color of light that leaves.
    void scale_by_color_out(std::size_t channels, float* luminance) const
    {
        for (std::size_t i = 0; i < samples() * channels && color_out; ++i)
            luminance[i] *= color_out[i];
    }
};

}  // namespace beamspread
