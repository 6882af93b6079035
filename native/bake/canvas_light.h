// One light of a bake on all patches of a canvas.
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "bake/canvas.h"
#include "bake/surface_light.h"

namespace beamspread {

class CanvasLight {
public:
    // `parts`: [patch] the light there, null where it does not arrive; not all. The canvas must outlive the light.
    CanvasLight(const Canvas& canvas, std::vector<const SurfaceLight*> parts);

    const std::vector<double>& color() const { return m_color; }
    const std::vector<const SurfaceLight*>& parts() const { return m_parts; }

    // True if the light was computed elsewhere.
    bool is_field() const;

    // True if rays differ in color where they arrive.
    bool is_colored() const;

    // True if directions are the same at all texels of a patch, and the light changes slowly.
    bool is_smooth() const;

    // True if one direction stands for the light at each texel.
    bool has_one_direction() const;

    // True if several rays reach a texel.
    bool has_size() const;

    // Directions that hold on the whole canvas; none if those of patches or rays differ.
    std::optional<Directions> directions() const;

    // Directions that hold on some patches each, if all patches have one; empty: none, or too many.
    std::vector<std::pair<OneDirection, std::vector<std::size_t>>> parallel() const;

    // Hands rays to the sink as `SurfaceLight::gather` does, at samples of the canvas. `settings`: [patch].
    void gather(const std::vector<RaySettings>& settings, RaySink& sink, Progress& progress, bool all = true) const;
    void gather(const RaySettings& settings, RaySink& sink, Progress& progress) const;

    // Adds the moments of light that was computed elsewhere, as `FieldLight` does for one surface.
    void add_inner_moments(int threads, LightField& field, Progress& progress) const;

    // The light as a choice of terms by moments needs it; traced light with few rays. Not on a mirrored canvas.
    SmoothLight smooth_light(const RaySettings& settings, Progress& progress) const;

private:
    template <class Predicate>
    bool any(const Predicate& predicate) const;

    const Canvas& m_canvas;
    std::vector<const SurfaceLight*> m_parts;
    std::vector<double> m_color;
};

}  // namespace beamspread
