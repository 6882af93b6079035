#include "solve/spectral/padded_plane.h"

#include <cmath>
#include <limits>

#include "fft/fft.h"
#include "solve/spectral/convolution.h"

namespace beamspread {

namespace {

// Side in texels up to which all of a kernel is its centre, integrated exactly. Larger: more exact, more time.
constexpr std::size_t max_centre_side = 32;

// Largest distance of the coarse grid's nodes, in texels.
constexpr std::size_t max_coarsening = 64;

// Standard deviation of the centre's window, in texels. Larger: smaller errors of suns, more time.
constexpr double centre_deviation = 3.0;

// Standard deviation of the window between the levels, in nodes of the coarse grid. Larger: smaller errors, more time.
constexpr double level_deviation = 3.0;

// Number of harmonics per node of deviation that a window's outside resolves: three nodes to the shortest period.
// Larger: less time, larger errors.
constexpr double harmonics_per_deviation = 10.0;

// Part of the largest kernel's power that harmonics beyond these may have outside the window.
constexpr double negligible_outside = 3e-4;

// Largest deviation, in texels, of windows that include a thin slab's mirror images, which are sharper than texels.
// Larger: smaller errors for slabs of longer mean free paths, more time.
constexpr double max_deviation = 16.0;

// Deviation of a window, widened until the harmonics outside are resolved: their detail grows finer toward the pole.
double widened(double deviation, const std::vector<ScaledProfile>& profiles, double unit)
{
    double power = 0.0;
    for (const ScaledProfile& scaled : profiles)
        power = std::max(power, scaled.profile.total());
    std::size_t harmonics = 0;
    for (const ScaledProfile& scaled : profiles) {
        const double border = window_radius * deviation * unit / scaled.mean_free_path;
        harmonics = std::max(harmonics, scaled.profile.harmonics_beyond(border, negligible_outside * power));
    }
    deviation = std::max(deviation, static_cast<double>(harmonics) / harmonics_per_deviation);
    for (const ScaledProfile& scaled : profiles)
        if (scaled.profile.detail() == RadialDetail::all)
            deviation = std::max(deviation, std::min(0.5 * fine_end * scaled.mean_free_path / unit, max_deviation));
    return deviation;
}

struct Tiling {
    PaddedPlane plane;
    double cost = 0.0;  // transformed nodes; infinite if no tiles fit into the budget
};

// Cost of the light's angles and their harmonics, for all terms in memory together, in transforms along one axis.
constexpr double angles_cost = 4.0;

// Number of transforms of a tile's node in `Convolution`, those along x and along y counting half profile: the light
// again for every part of the media, the results for every part of the terms.
double transforms(const LevelChoice& choice, const SpectraAtOnce& at_once)
{
    const auto rounds = [](std::size_t count, std::size_t at) {
        const std::size_t parts = (count + at - 1) / at;
        return static_cast<double>(parts);
    };
    const auto terms = static_cast<double>(choice.terms);
    const auto media = static_cast<double>(choice.media);
    const double of_terms = rounds(choice.terms, at_once.terms);
    const double of_media = rounds(choice.media, at_once.media);
    const double light_along_x = (terms + angles_cost * of_terms) * (of_terms > 1.0 ? of_media : 1.0);
    return 0.5 * (light_along_x + media + terms * of_media + media * of_terms);
}

Tiling with_tiles(PaddedPlane plane, std::size_t count, const LevelChoice& choice)
{
    // Light that wraps around falls into the halo; on an undivided plane, beyond its end.
    const auto pad = [&](std::size_t size, std::size_t halo, std::size_t& tile) {
        tile = (size + count - 1) / count;
        return fast_even_size(tile + (count > 1 ? 2 : 1) * halo);
    };
    plane.padded_width = pad(plane.width, plane.halo_x, plane.tile_width);
    plane.padded_height = pad(plane.height, plane.halo_y, plane.tile_height);
    const SpectraAtOnce at_once = spectra_at_once(plane, choice.terms, choice.media, choice.budget);
    const double nodes = static_cast<double>(count * count * plane.padded_width * plane.padded_height);
    return {plane, at_once.terms > 0 ? nodes * transforms(choice, at_once) : std::numeric_limits<double>::infinity()};
}

Tiling choose_tiles(const PaddedPlane& plane, const LevelChoice& choice)
{
    constexpr std::size_t max_tiles = 16;  // along a side
    Tiling best = with_tiles(plane, 1, choice);
    for (std::size_t count = 2; count <= max_tiles; ++count) {
        const Tiling tiling = with_tiles(plane, count, choice);
        if (tiling.cost < best.cost)
            best = tiling;
    }
    return best;
}

std::size_t texels_within(double length, double pitch)
{
    return static_cast<std::size_t>(std::ceil(length / pitch)) + 1;
}

// The part of a ring inside an outer window.
RadialWindow inside(const RadialWindow& ring, double deviation)
{
    return {ring.inner, deviation, window_end * deviation, 0.0};
}

void set_halo(Level& level)
{
    PaddedPlane& plane = level.plane;
    const auto halo = [&](double pitch) {
        return level.ring ? texels_within(level.ring->end(), pitch / plane.unit()) : 0;
    };
    plane.halo_x = std::max(level.centre ? level.centre->x : 0, halo(plane.pitch_x));
    plane.halo_y = std::max(level.centre ? level.centre->y : 0, halo(plane.pitch_y));
}

// The grid of nodes `coarsening` texels apart, for the kernels outside a window of this deviation (texels).
Level coarse_level(const PaddedPlane& fine, const RadialWindow& ring, std::size_t coarsening, double deviation)
{
    const auto step = [&](double pitch) { return coarsening * static_cast<std::size_t>(fine.unit() / pitch); };
    Level level;
    PaddedPlane& plane = level.plane;
    plane.texels_x = step(fine.pitch_x);
    plane.texels_y = step(fine.pitch_y);
    plane.width = SplineAxis(fine.width, plane.texels_x).nodes();
    plane.height = SplineAxis(fine.height, plane.texels_y).nodes();
    plane.pitch_x = static_cast<double>(plane.texels_x) * fine.pitch_x;
    plane.pitch_y = static_cast<double>(plane.texels_y) * fine.pitch_y;
    const double per_unit = fine.unit() / plane.unit();
    level.ring = {deviation * per_unit, 0.0, ring.cut * per_unit, ring.taper * per_unit};
    set_halo(level);
    return level;
}

}  // namespace

SpectraAtOnce spectra_at_once(const PaddedPlane& plane, std::size_t terms, std::size_t media, std::size_t budget)
{
    const std::size_t all = budget / (plane.rows() * plane.columns() * sizeof(Complex));
    if (all < 2)
        return {};
    const std::size_t results = std::min(media, std::max(all / 2, all - std::min(all, terms)));
    return {std::min(terms, all - results), results};
}

Levels choose_levels(const Plane& plane, const std::vector<ScaledProfile>& profiles, const LevelChoice& choice)
{
    const auto& [width, height, pitch_x, pitch_y, extent, gap, parts] = plane;
    Level single{{width, height, pitch_x, pitch_y}, KernelCentre{}, std::nullopt};
    const double unit = single.plane.unit();
    double cut = 0.0;
    for (const ScaledProfile& scaled : profiles)
        cut = std::max(cut, scaled.reach / unit);
    // No two texels of a part are farther apart.
    const double diagonal = extent > 0.0 ? extent / unit
                                         : std::hypot(static_cast<double>(width) * pitch_x / unit,
                                                      static_cast<double>(height) * pitch_y / unit);
    const double farthest = gap > 0.0 ? gap / unit : std::numeric_limits<double>::infinity();
    const double deviation = widened(centre_deviation, profiles, unit);
    const double centre_end = window_end * deviation;
    // The centre needs no taper.
    cut = std::min(cut, diagonal <= centre_end && extent > 0.0 ? diagonal : farthest);
    if (cut > centre_end && std::max(width, height) > max_centre_side) {
        single.ring = {deviation, 0.0, cut, 0.0};
        if (cut > diagonal) {
            // The taper avoids ringing of an abrupt end.
            single.ring->cut = diagonal;
            single.ring->taper = std::min(std::max(centre_end, diagonal / 8.0), farthest - diagonal);
        }
    }
    const auto half_width = [&](double pitch, std::size_t size) {
        const double end = (single.ring ? centre_end : cut) * unit / pitch;
        return static_cast<std::size_t>(std::min(std::ceil(end + 0.5), static_cast<double>(size - 1)));
    };
    single.centre = {half_width(pitch_x, width), half_width(pitch_y, height)};
    set_halo(single);
    Tiling best = choice.one_tile ? with_tiles(single.plane, 1, choice) : choose_tiles(single.plane, choice);
    Levels levels{single, std::nullopt, single.ring};
    levels.texels.plane = best.plane;
    if (!single.ring || choice.one_tile)
        return levels;

    for (std::size_t coarsening = 4; coarsening <= max_coarsening; coarsening *= 2) {
        if (choice.coarsening != 0 && choice.coarsening != coarsening)
            continue;
        const auto step = static_cast<double>(coarsening);
        const double border = step * widened(level_deviation, profiles, step * unit);
        // Splines of the coarse grid widen light by two nodes, and once more its luminance.
        if (window_end * border >= single.ring->cut || single.ring->end() + 4.0 * step > farthest)
            break;
        Level fine = single;
        fine.ring = inside(*single.ring, border);
        set_halo(fine);
        const Tiling tiling = choose_tiles(fine.plane, choice);
        Level coarse = coarse_level(single.plane, *single.ring, coarsening, border);
        const Tiling coarse_tiling = with_tiles(coarse.plane, 1, choice);
        const PaddedPlane& nodes = coarse_tiling.plane;
        // The results of all media stay in memory, beside several of the texels' spectra.
        const bool fits = nodes.width * nodes.height * sizeof(float) * choice.media <= choice.budget / 6;
        const double cost = tiling.cost + coarse_tiling.cost;
        constexpr double max_cost_ratio = 0.9;  // of two levels to one
        if (choice.coarsening == coarsening || (fits && cost < max_cost_ratio * best.cost)) {
            best.cost = cost;
            fine.plane = tiling.plane;
            coarse.plane = nodes;
            levels.texels = fine;
            levels.coarse = coarse;
        }
    }
    return levels;
}

}  // namespace beamspread
