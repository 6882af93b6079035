#include "bake/patch_sink.h"

#include <algorithm>
#include <cstddef>

namespace beamspread {

// The places of texels [at, at + count) of a patch of `size` texels, on an axis of `all` texels. The patch begins at
// `before`. Its images follow each other, and every other one is flipped.
std::vector<PatchSink::Image> PatchSink::images(std::size_t at, std::size_t count, std::size_t size, std::size_t before,
                                                std::size_t all)
{
    const auto signed_of = [](std::size_t value) { return static_cast<std::ptrdiff_t>(value); };
    std::vector<Image> found;
    const std::ptrdiff_t first_image = -signed_of((before + size - 1) / size);
    for (std::ptrdiff_t image = first_image; signed_of(before) + image * signed_of(size) < signed_of(all); ++image) {
        const bool is_flipped = image % 2 != 0;
        const std::size_t in_image = is_flipped ? size - at - count : at;
        const std::ptrdiff_t first = signed_of(before) + image * signed_of(size) + signed_of(in_image);
        const std::ptrdiff_t begin = std::max<std::ptrdiff_t>(-first, 0);
        const std::ptrdiff_t end = std::min(signed_of(count), signed_of(all) - first);
        if (begin < end)
            found.push_back({static_cast<std::size_t>(first + begin), static_cast<std::size_t>(begin),
                             static_cast<std::size_t>(end - begin), is_flipped});
    }
    return found;
}

void PatchSink::add(const RayRun& run)
{
    RayRun moved = run;
    if (!m_canvas.is_mirrored()) {
        moved.sample = m_canvas.sample(m_patch, run.sample);
        m_next.add(moved);
        return;
    }
    const std::size_t width = m_patch.surface->grid.width;
    const std::size_t height = m_patch.surface->grid.height;
    const Plane& plane = m_canvas.plane;
    Scratch& scratch = m_scratch.local();
    for (const Image& row : images(run.sample / width, 1, height, m_patch.y, plane.height))
        for (const Image& part : images(run.sample % width, run.count, width, m_patch.x, plane.width)) {
            scratch.travel.clear();
            scratch.irradiance.clear();
            for (std::size_t i = part.begin; i < part.begin + part.count; ++i) {
                const std::size_t from = part.is_flipped ? run.count - 1 - i : i;
                scratch.irradiance.push_back(run.irradiance[from]);
                if (run.travel) {
                    const Vec3f& travel = run.travel[from];
                    scratch.travel.emplace_back(part.is_flipped ? -travel.x : travel.x,
                                                row.is_flipped ? -travel.y : travel.y, travel.z);
                }
            }
            moved.sample = row.first * plane.width + part.first;
            moved.count = part.count;
            moved.irradiance = scratch.irradiance.data();
            moved.travel = run.travel ? scratch.travel.data() : nullptr;
            m_next.add(moved);
        }
}

}  // namespace beamspread
