// The texels of a plane whose luminance is looked at.
#pragma once

#include <cstddef>
#include <vector>

#include "solve/separable/light_pyramid.h"

namespace beamspread {

struct Texel {
    std::size_t y;
    std::size_t x;
};

// Some thousand, drawn by chance but always the same: all over the plane, where it is lit, where the light changes and
// in the dark beside, at corners of shadows, and around the places where each light is extreme or comes from.
std::vector<Texel> probe_texels(const std::vector<LightPyramid>& lights, double pitch_x, double pitch_y);

// Others close to some; different ones for every `draw`.
std::vector<Texel> texels_around(const std::vector<Texel>& texels, std::size_t height, std::size_t width,
                                 std::size_t draw);

}  // namespace beamspread
