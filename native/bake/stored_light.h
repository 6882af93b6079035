// Lights that are stored at all texels until a solver sees them.
#pragma once

#include <vector>

#include "bake/canvas.h"
#include "bake/canvas_light.h"
#include "solve/problem/problem.h"

namespace beamspread {

// Lights of a canvas at all its texels, and the arrays that hold them.
struct StoredLight {
    std::vector<std::vector<float>> arrays;
    std::vector<PlaneLight> lights;  // dark ones are left out

    // Adds irradiance [texel][channel] of one color or of three; the light's color is a factor.
    void add(const Plane& plane, std::vector<float> irradiance, std::size_t channels, const Directions& directions,
             const std::vector<double>& color);

    // Adds a light that has one direction at each texel.
    void add_one_direction(const Canvas& canvas, const CanvasLight& light, const RaySettings& settings,
                           Progress& progress);

    // Adds each ray of a light on a surface alone as a light of its own.
    void add_rays(const Canvas& canvas, const CanvasLight& light, const RaySettings& settings, Progress& progress);

    // Adds a light with the mean direction of each texel.
    void add_mean_direction(const Canvas& canvas, const CanvasLight& light, const RaySettings& settings,
                            Progress& progress);

    // Mean irradiance of all lights, texels and channels, W/m^2.
    double mean() const;

    // Mean over texels and channels of the length of the sum of irradiance times direction, W/m^2.
    double mean_flow(const Plane& plane) const;
};

}  // namespace beamspread
