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
    RaySum(std::size_t samples, std::size_t channels, bool with_flow);

    void add(const RayRun& run) override;

    std::size_t channels;
    std::vector<float> irradiance;  // [texel][channel], W/m^2
    std::vector<Vec3f> flow;        // [texel] sum of mean irradiance times travel, W/m^2; empty without
};

}  // namespace beamspread
