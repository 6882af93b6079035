#include "bake/entering.h"

#include <algorithm>
#include <cstddef>

#include "bake/patch_sink.h"

namespace beamspread {

namespace {

// Keeps the irradiance of rays as factors.
class FactorSink final : public RaySink {
public:
    explicit FactorSink(std::vector<float>& factors) : m_factors(factors) {}

    void add(const RayRun& run) override
    {
        const float* const values = &run.irradiance->x;
        std::copy_n(values, 3 * run.count, m_factors.begin() + static_cast<std::ptrdiff_t>(3 * run.sample));
    }

private:
    std::vector<float>& m_factors;
};

}  // namespace

EnteringColors::EnteringColors(const Canvas& canvas) : m_canvas(canvas)
{
    const auto is_colored = [](const Patch& patch) { return patch.surface->color_in != nullptr; };
    if (std::ranges::none_of(canvas.patches, is_colored))
        return;
    const bool is_surface = canvas.is_alone() && !canvas.is_mirrored();
    if (is_surface)
        m_factors = canvas.patches.front().surface->color_in;
    else
        m_own.assign(3 * canvas.samples(), 1.0f);
    FactorSink sink(m_own);
    for (const Patch& patch : canvas.patches) {
        const Surface& surface = *patch.surface;
        m_surfaces.push_back(surface);
        m_surfaces.back().color_in = nullptr;
        PatchSink moved(canvas, patch, sink);
        std::vector<Vec3f> row(surface.grid.width);
        for (std::size_t first = 0; first < surface.samples() && !is_surface && is_colored(patch);
             first += row.size()) {
            for (std::size_t i = 0; i < row.size(); ++i) {
                const float* const color = surface.color_in + 3 * (first + i);
                row[i] = Vec3f(color[0], color[1], color[2]);
            }
            moved.add({.sample = first, .count = row.size(), .irradiance = row.data()});
        }
    }
    if (!is_surface)
        m_factors = m_own.data();
    for (std::size_t i = 0; i < m_surfaces.size(); ++i)
        m_canvas.patches[i].surface = &m_surfaces[i];
}

}  // namespace beamspread
