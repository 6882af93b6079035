#include "bake/canvas.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <utility>

#include "base/constants.h"

namespace beamspread {

namespace {

// Largest relative difference of the sides of texels on one canvas. Larger: kernels of some patches are off by more.
constexpr double same_pitch = 1e-4;

// Fraction of the power of a kernel that may lie beyond the gaps. Larger: smaller gaps, light of one patch on another.
constexpr double max_beyond = 3e-4;

// Angle of incidence, degrees, at which unscattered light of a slab reaches far.
constexpr double grazing = 85.0;

// Length of the taper of kernels that reach beyond all patches: texels, and fraction of the largest patch. Smaller:
// transforms ring.
constexpr double min_taper = 28.0;
constexpr double taper = 0.125;

// Gaps from which on a coarse grid is worth it, and what it needs besides, texels.
constexpr double wide_gap = 256.0;
constexpr double beside_gap = 32.0;

// Patches that are worth a canvas: their number, and texels of one, or its area with gaps relative to its own. Larger
// patches choose fewer terms alone, and gaps have to be transformed.
constexpr std::size_t min_patches = 8;
constexpr std::size_t small_patch = std::size_t{1} << 14;
constexpr double max_padding = 6.0;

// Least width and height of patches on one divided plane, relative to the first. Smaller: more padding.
constexpr double same_size = 0.75;

// Largest patch of a divided plane, texels. Larger patches choose a coarse grid for light that spreads far.
constexpr std::size_t max_divided_patch = 400 * 400;

// Radius within which a medium spreads all light but the part `max_beyond`, metres.
double reach(const ChannelMedium& medium)
{
    double paths = 0.0;
    for (const RadialProfile& profile : medium.ldf->node_profiles(medium.albedo, medium.side))
        paths = std::max(paths, profile.reach(max_beyond));
    for (const BallisticExit& exit : medium.ldf->ballistic(grazing, medium.side))
        if (exit.power > max_beyond)
            paths = std::max(paths, exit.u);
    return paths * medium.mean_free_path;
}

double diagonal(const Surface& surface)
{
    const Plane plane = surface.plane();
    return std::hypot(static_cast<double>(plane.width) * plane.pitch_x,
                      static_cast<double>(plane.height) * plane.pitch_y);
}

bool have_same_pitch(const Surface& a, const Surface& b)
{
    const auto are_same = [](double x, double y) { return std::abs(x - y) <= same_pitch * x; };
    return are_same(a.grid.pitch_x, b.grid.pitch_x) && are_same(a.grid.pitch_y, b.grid.pitch_y);
}

// The gaps between patches, the largest of which has this diagonal.
Plane with_gaps(const Surface& first, double extent, double all_reach)
{
    Plane plane{
        .width = 0, .height = 0, .pitch_x = first.grid.pitch_x, .pitch_y = first.grid.pitch_y, .extent = extent};
    const double unit = std::max(plane.pitch_x, plane.pitch_y);
    const double texels = extent / unit;
    // A kernel without a taper ends at the extent.
    const double of_extent = texels <= min_taper ? texels : texels + std::max(min_taper, taper * texels);
    double gap = std::min(all_reach / unit, of_extent);
    if (gap > wide_gap)
        gap += beside_gap;
    plane.gap = (gap + 2.0) * unit;
    return plane;
}

std::size_t gap_texels(double gap, double pitch)
{
    return static_cast<std::size_t>(std::ceil(gap / pitch));
}

std::size_t texels_of(std::span<const Patch> patches)
{
    const auto add = [](std::size_t sum, const Patch& patch) { return sum + patch.surface->samples(); };
    return std::accumulate(patches.begin(), patches.end(), std::size_t{0}, add);
}

double area_of(const Plane& plane, std::span<const Patch> patches)
{
    return static_cast<double>(texels_of(patches)) * plane.pitch_x * plane.pitch_y;
}

std::size_t padded_texels(const Surface& surface, const Plane& gaps)
{
    return (surface.grid.width + gap_texels(gaps.gap, gaps.pitch_x)) *
           (surface.grid.height + gap_texels(gaps.gap, gaps.pitch_y));
}

}  // namespace

Canvas::Canvas(const Surface& surface, std::size_t index)
    : plane(surface.plane()), patches{{.surface = &surface, .index = index}}, area(area_of(plane, patches))
{
    Patch& patch = patches.front();
    patch.x = gap_texels(surface.mirrored, plane.pitch_x);
    patch.y = gap_texels(surface.mirrored, plane.pitch_y);
    plane.width += 2 * patch.x;
    plane.height += 2 * patch.y;
}

Canvas::Canvas(std::span<const Patch> unplaced, std::size_t side, const Plane& gaps)
    : plane(gaps), patches(unplaced.begin(), unplaced.end()), area(area_of(plane, patches))
{
    const std::size_t gap_x = gap_texels(gaps.gap, gaps.pitch_x);
    const std::size_t gap_y = gap_texels(gaps.gap, gaps.pitch_y);
    std::size_t x = 0;
    std::size_t y = 0;
    std::size_t row_height = 0;
    for (Patch& patch : patches) {
        const auto [width, height] = std::pair(patch.surface->grid.width, patch.surface->grid.height);
        if (x > 0 && x + width > side) {
            x = 0;
            y += row_height + gap_y;
            row_height = 0;
        }
        patch.x = x;
        patch.y = y;
        row_height = std::max(row_height, height);
        plane.width = std::max(plane.width, x + width);
        plane.height = std::max(plane.height, y + height);
        x += width + gap_x;
        plane.parts.push_back({.y = patch.y, .x = patch.x, .height = height, .width = width});
    }
}

double Canvas::share(const Patch& patch) const
{
    return static_cast<double>(patch.surface->samples()) * plane.pitch_x * plane.pitch_y / area;
}

namespace {

// Patches by the size of their texels, those of a group from the largest to the smallest.
std::vector<std::vector<Patch>> by_pitch(const std::vector<Surface>& surfaces)
{
    std::vector<std::vector<Patch>> groups;
    for (std::size_t i = 0; i < surfaces.size(); ++i) {
        if (surfaces[i].mirrored > 0.0 || surfaces[i].grid.is_bent())
            continue;
        const auto same = std::ranges::find_if(
            groups, [&](const auto& group) { return have_same_pitch(*group.front().surface, surfaces[i]); });
        (same == groups.end() ? groups.emplace_back() : *same).push_back({.surface = &surfaces[i], .index = i});
    }
    for (std::vector<Patch>& group : groups)
        std::ranges::stable_sort(group, std::greater{}, [](const Patch& patch) { return patch.surface->samples(); });
    return groups;
}

bool return_unscattered(const ChannelMedium& medium)
{
    return std::ranges::any_of(medium.ldf->ballistic(grazing, medium.side),
                               [](const BallisticExit& exit) { return exit.power > 0.0; });
}

bool have_same_size(const Surface& first, const Surface& other)
{
    const auto are_near = [](std::size_t a, std::size_t b) {
        const auto [smaller, larger] = std::minmax(static_cast<double>(a), static_cast<double>(b));
        return smaller >= same_size * larger;
    };
    return are_near(first.grid.width, other.grid.width) && are_near(first.grid.height, other.grid.height);
}

// Divided planes of patches of about one size. Returns the other patches, from the largest to the smallest.
std::vector<Patch> add_divided(std::vector<Patch> group, std::size_t max_texels, std::vector<Canvas>& all)
{
    std::vector<Patch> others;
    while (!group.empty()) {
        const Surface& first = *group.front().surface;
        const auto rest = std::ranges::stable_partition(
            group, [&](const Patch& patch) { return have_same_size(first, *patch.surface); });
        std::vector<Patch> same(group.begin(), rest.begin());
        group.erase(group.begin(), rest.begin());
        if (same.size() < min_patches || first.samples() > max_divided_patch) {
            others.insert(others.end(), same.begin(), same.end());
            continue;
        }
        std::ranges::stable_sort(same, std::greater{}, [](const Patch& patch) { return patch.surface->grid.height; });
        const auto canvas_count =
            static_cast<std::size_t>(std::ceil(static_cast<double>(texels_of(same)) / static_cast<double>(max_texels)));
        const std::size_t each = (same.size() + canvas_count - 1) / canvas_count;
        for (std::size_t i = 0; i < same.size(); i += each) {
            const std::span<Patch> patches = std::span(same).subspan(i, std::min(each, same.size() - i));
            Plane plane{.width = 0, .height = 0, .pitch_x = first.grid.pitch_x, .pitch_y = first.grid.pitch_y};
            std::size_t widest = 0;
            for (const Patch& patch : patches) {
                plane.extent = std::max(plane.extent, diagonal(*patch.surface));
                widest = std::max(widest, patch.surface->grid.width);
            }
            const auto side = static_cast<std::size_t>(std::sqrt(texels_of(patches)));
            all.emplace_back(patches, std::max(widest, side), plane);
        }
    }
    std::ranges::stable_sort(others, std::greater{}, [](const Patch& patch) { return patch.surface->samples(); });
    return others;
}

// Splits a group into canvases with gaps.
void add_canvases(std::vector<Patch> group, double all_reach, std::size_t max_texels, std::vector<Canvas>& all)
{
    const auto gaps_of = [&](const Patch& largest) {
        return with_gaps(*largest.surface, diagonal(*largest.surface), all_reach);
    };
    const auto stays_alone = [&](const Patch& patch) {
        const std::size_t samples = patch.surface->samples();
        const auto padded = static_cast<double>(padded_texels(*patch.surface, gaps_of(patch)));
        return samples > small_patch && padded > max_padding * static_cast<double>(samples);
    };
    const auto packed = std::ranges::stable_partition(group, stays_alone);
    const auto first_packed = packed.size() < min_patches ? group.end() : packed.begin();
    for (auto patch = group.begin(); patch != first_packed; ++patch)
        all.emplace_back(*patch->surface, patch->index);
    for (auto first = first_packed; first != group.end();) {
        double extent = 0.0;  // long patches may follow larger ones
        for (auto patch = first; patch != group.end(); ++patch)
            extent = std::max(extent, diagonal(*patch->surface));
        const Plane gaps = with_gaps(*first->surface, extent, all_reach);
        std::size_t texels = 0;
        std::size_t side = 0;
        auto end = first;
        for (; end != group.end(); ++end) {
            const std::size_t padded = padded_texels(*end->surface, gaps);
            if (end != first && texels + padded > max_texels)
                break;
            texels += padded;
            side = std::max(side, end->surface->grid.width);
        }
        const std::span<Patch> patches(first, end);
        if (patches.size() == 1) {
            all.emplace_back(*first->surface, first->index);
        } else {
            std::ranges::stable_sort(patches, std::greater{}, [](const Patch& p) { return p.surface->grid.height; });
            all.emplace_back(patches, std::max(side, static_cast<std::size_t>(std::sqrt(texels))), gaps);
        }
        first = end;
    }
}

}  // namespace

std::vector<Canvas> canvases(const std::vector<Surface>& surfaces, const std::vector<ChannelMedium>& media,
                             std::size_t max_texels)
{
    const bool are_packed = max_texels > 0;
    double all_reach = 0.0;
    if (are_packed && surfaces.size() >= min_patches)
        for (const ChannelMedium& medium : media)
            all_reach = std::max(all_reach, reach(medium));
    std::vector<Canvas> all;
    for (std::size_t i = 0; i < surfaces.size(); ++i)
        if (!surfaces[i].grid.is_bent() && (!are_packed || surfaces[i].mirrored > 0.0))
            all.emplace_back(surfaces[i], i);
    const bool is_divided = !std::ranges::any_of(media, return_unscattered);
    for (std::vector<Patch>& group : by_pitch(surfaces))
        if (are_packed)
            add_canvases(is_divided ? add_divided(std::move(group), max_texels, all) : std::move(group), all_reach,
                         max_texels, all);
    return all;
}

}  // namespace beamspread
