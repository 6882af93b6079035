// One light of a bake, and its rays at a surface.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "bake/field_light.h"
#include "bake/surface.h"
#include "base/threads.h"
#include "scene/light.h"
#include "scene/occluders.h"
#include "scene/ray_gather.h"

namespace beamspread {

// A light that is traced or one that was computed elsewhere.
struct SurfaceLight {
    const Light* light = nullptr;        // null: `field` is set
    const FieldLight* field = nullptr;   // its shadows are part of it
    std::vector<double> color;           // [channel] strength times color
    const Occluders* occluders = nullptr;  // objects that block it; null: none

    // True if rays differ in color where they arrive on the surface.
    bool is_colored(const Surface& surface) const;

    // True if directions are the same at all texels, and the light changes slowly.
    bool is_smooth() const { return field && field->lobes() > 1; }

    // True if several rays reach a texel.
    bool has_size() const { return light ? !light->is_delta() : field->lobes() > 1; }

    // The direction at each texel that stands for the light inside a medium; none if its rays differ too much.
    std::optional<Directions> directions(const ReceiverGrid& grid) const;

    // Hands the rays of strength 1 to the sink, of the covered part of each texel and of the color that the surface
    // lets in. Not `all`: of a field, only at texels that are no inner ones.
    void gather(const Surface& surface, const RaySettings& settings, RaySink& sink, Progress& progress,
                bool all = true) const;

private:
    void gather_lamp(const Surface& surface, RaySettings settings, RaySink& sink, Progress& progress) const;
};

// Sum of the rays of each texel.
class RaySum final : public RaySink {
public:
    // `channels`: 1 for the first one alone, or 3.
    RaySum(const ReceiverGrid& grid, std::size_t channels, bool with_flow);

    void add(const RayRun& run) override;

    std::size_t channels;
    std::vector<float> irradiance;  // [texel][channel], W/m^2
    std::vector<Vec3f> flow;        // [texel] sum of mean irradiance times travel, W/m^2; empty without
};

// Lights of a surface at all its texels, and the arrays that hold them.
struct StoredLight {
    std::vector<std::vector<float>> arrays;
    std::vector<PlaneLight> lights;  // dark ones are left out

    // Adds irradiance [texel][channel] of one color or of three; the light's color is a factor.
    void add(const ReceiverGrid& grid, std::vector<float> irradiance, std::size_t channels,
             const Directions& directions, const std::vector<double>& color);

    // Adds a light that has one direction at each texel.
    void add_one_direction(const Surface& surface, const SurfaceLight& light, const RaySettings& settings,
                           Progress& progress);

    // Adds each ray of a light as a light of its own.
    void add_rays(const Surface& surface, const SurfaceLight& light, const RaySettings& settings, Progress& progress);

    // Adds a light with the mean direction of each texel.
    void add_mean_direction(const Surface& surface, const SurfaceLight& light, const RaySettings& settings,
                            Progress& progress);

    // Mean irradiance of all lights, texels and channels, W/m^2.
    double mean() const;
};

}  // namespace beamspread
