#include "bake/canvas_light.h"

#include <algorithm>
#include <utility>

#include "bake/patch_sink.h"
#include "bake/smooth_rays.h"

namespace beamspread {

namespace {

// Directions of a sun on patches with a kernel of their own each. More: more transforms, fewer choices of terms.
constexpr std::size_t max_directions = 8;

// Distance of two unit vectors that count as one direction: the frames of parallel planes differ by rounding of their
// corners and UVs. Larger: fewer transforms, kernels off by some times as much.
constexpr double same_direction = 3e-5;

bool are_same(const Vec3& a, const Vec3& b)
{
    return glm::distance(a, b) <= same_direction;
}

}  // namespace

CanvasLight::CanvasLight(const Canvas& canvas, std::vector<const SurfaceLight*> parts)
    : m_canvas(canvas),
      m_parts(std::move(parts)),
      m_color((*std::ranges::find_if(m_parts, [](const SurfaceLight* part) { return part != nullptr; }))->color)
{
}

template <class Predicate>
bool CanvasLight::any(const Predicate& predicate) const
{
    for (std::size_t i = 0; i < m_parts.size(); ++i)
        if (m_parts[i] && predicate(*m_parts[i], *m_canvas.patches[i].surface))
            return true;
    return false;
}

bool CanvasLight::is_field() const
{
    return any([](const SurfaceLight& part, const Surface& /*surface*/) { return part.field != nullptr; });
}

bool CanvasLight::is_colored() const
{
    return any([](const SurfaceLight& part, const Surface& surface) { return part.is_colored(surface); });
}

bool CanvasLight::is_smooth() const
{
    return !m_canvas.is_mirrored() &&
           any([](const SurfaceLight& part, const Surface& /*surface*/) { return part.is_smooth(); });
}

bool CanvasLight::has_one_direction() const
{
    return !any([](const SurfaceLight& part, const Surface& surface) { return !part.directions(surface.grid); });
}

bool CanvasLight::has_size() const
{
    return any([](const SurfaceLight& part, const Surface& /*surface*/) { return part.has_size(); });
}

std::optional<Directions> CanvasLight::directions() const
{
    if (m_canvas.is_mirrored())
        return std::nullopt;
    if (m_canvas.is_alone())
        return m_parts.front()->directions(m_canvas.patches.front().surface->grid);
    std::optional<Vec3> travel;
    const bool differ = any([&](const SurfaceLight& part, const Surface& surface) {
        const std::optional<Directions> directions = part.directions(surface.grid);
        if (!directions || !std::holds_alternative<OneDirection>(*directions))
            return true;
        const Vec3 of_part = std::get<OneDirection>(*directions).travel;
        return !are_same(of_part, travel.emplace(travel.value_or(of_part)));
    });
    if (differ || !travel)
        return std::nullopt;
    return OneDirection{*travel};
}

std::vector<std::pair<OneDirection, std::vector<std::size_t>>> CanvasLight::parallel() const
{
    std::vector<std::pair<OneDirection, std::vector<std::size_t>>> groups;
    if (m_canvas.is_mirrored())
        return {};
    for (std::size_t i = 0; i < m_parts.size(); ++i) {
        if (!m_parts[i])
            continue;
        const std::optional<Directions> directions = m_parts[i]->directions(m_canvas.patches[i].surface->grid);
        if (!directions || !std::holds_alternative<OneDirection>(*directions))
            return {};
        const OneDirection& direction = std::get<OneDirection>(*directions);
        const auto same = std::ranges::find_if(
            groups, [&](const auto& group) { return are_same(group.first.travel, direction.travel); });
        if (same != groups.end())
            same->second.push_back(i);
        else if (groups.size() == max_directions)
            return {};
        else
            groups.push_back({direction, {i}});
    }
    return groups;
}

void CanvasLight::gather(const RaySettings& settings, RaySink& sink, Progress& progress) const
{
    gather(std::vector<RaySettings>(m_parts.size(), settings), sink, progress);
}

void CanvasLight::gather(const std::vector<RaySettings>& settings, RaySink& sink, Progress& progress, bool all) const
{
    progress.set_total(1.0);
    for (std::size_t i = 0; i < m_parts.size(); ++i) {
        const Patch& patch = m_canvas.patches[i];
        const double share = m_canvas.share(patch);
        progress.advance_by(share, [&](Progress& part) {
            if (!m_parts[i])
                return;
            RaySettings of_patch = settings[i];
            RayNoise noise;
            of_patch.noise = settings[i].noise ? &noise : nullptr;
            PatchSink moved(m_canvas, patch, sink);
            m_parts[i]->gather(*patch.surface, of_patch, moved, part, all);
            if (settings[i].noise) {
                settings[i].noise->irradiance += share * noise.irradiance;
                settings[i].noise->variance += share * noise.variance;
            }
        });
    }
    progress.finish();
}

void CanvasLight::add_inner_moments(int threads, LightField& field, Progress& progress) const
{
    progress.set_total(1.0);
    for (std::size_t i = 0; i < m_parts.size(); ++i) {
        const Patch& patch = m_canvas.patches[i];
        progress.advance_by(m_canvas.share(patch), [&](Progress& part) {
            if (m_parts[i])
                m_parts[i]->field->add_inner_moments(*patch.surface, {patch.y, patch.x}, m_color, threads, field, part);
        });
    }
    progress.finish();
}

SmoothLight CanvasLight::smooth_light(const RaySettings& settings, Progress& progress) const
{
    SmoothLight sum;
    progress.set_total(1.0);
    for (std::size_t i = 0; i < m_parts.size(); ++i) {
        const Surface& surface = *m_canvas.patches[i].surface;
        const double share = m_canvas.share(m_canvas.patches[i]);
        progress.advance_by(share, [&](Progress& part) {
            if (m_parts[i])
                sum.add(m_parts[i]->field ? m_parts[i]->field->smooth_light(m_color)
                                          : smooth_rays(surface, *m_parts[i], share, settings, part),
                        share);
        });
    }
    progress.finish();
    return sum;
}

}  // namespace beamspread
