// Colors of light that enters the surfaces of a canvas, apart from that light.
#pragma once

#include <vector>

#include "bake/canvas.h"
#include "bake/surface.h"

namespace beamspread {

// A canvas whose surfaces let in all light, and the factors of that light: solvers multiply by them what channels share.
class EnteringColors {
public:
    explicit EnteringColors(const Canvas& canvas);
    EnteringColors(const EnteringColors&) = delete;
    EnteringColors& operator=(const EnteringColors&) = delete;

    // Has the patches of the canvas that this is made of.
    const Canvas& canvas() const { return m_canvas; }

    // [sample of the canvas][channel]; null: 1.
    const float* factors() const { return m_factors; }

private:
    std::vector<Surface> m_surfaces;  // [patch]
    Canvas m_canvas;
    std::vector<float> m_own;  // factors on a canvas that is more than one surface
    const float* m_factors = nullptr;
};

}  // namespace beamspread
