#include "solve/spectral/padded_plane.h"

#include <cmath>
#include <limits>

#include "fft/fft.h"
#include "solve/spectral/spline_axis.h"

namespace beamspread {

namespace {

// Planes up to this size are all centre; half takes as long. Planes of 48 and 64 texels a side would take .3 to .75 of their
// few milliseconds and lose errors of 2e-6 of the brightest texel, but it is on these that rings are tested against
// `direct`; of 96 and 128, .7 to 2 times as long.
constexpr std::size_t small_plane = 32;

// Coarse grids of more texels from node to node would save nothing on planes that fit into memory: on 512 x 512 and
// 1024 x 1024 texels 8 and 32 take as long.
constexpr std::size_t most_coarsening = 64;

// Border between the levels, nodes of the coarse grid: what is outside has next to no detail that its splines don't
// resolve. It leaves 1e-6 of a sun's brightest texel; 2 leaves 7e-6 in the same time, 4 half in up to 1.2 times the time.
constexpr double level_deviation = 3.0;

// Harmonics that a border of this deviation serves: no shorter than three nodes around it. Others may hold this part of
// the largest kernel's power outside. For a grazing lamp 10 leave 8e-6 of the brightest texel, half of it 6e-6 in up to
// 1.6 times the time, twice 1.6e-5 in .9 times; half and twice the part leave the same.
constexpr double harmonics_per_deviation = 10.0;
constexpr double negligible_outside = 3e-4;

// Kernels with finer edges of radius are sharper than texels around the beam's images in a thin slab's sides. A border of
// half the distance up to which edges are finer takes these in; farther than this they are wider than texels, and the
// centre would cost more than all else. Without, errors of 6e-3 of the brightest texel were seen, with this 4e-4. A slab
// with images 60 texels away: half differs by 2e-5 and takes .6 of the time, twice by 2e-4 and takes 2.6 times as long.
constexpr double widest_deviation = 16.0;

// The detail of a harmonic grows finer toward the pole: where many reach beyond a border, a wider one takes them in.
double widened(double deviation, const std::vector<ScaledProfile>& profiles, double unit)
{
    double power = 0.0;
    for (const ScaledProfile& each : profiles)
        power = std::max(power, each.profile.total());
    std::size_t harmonics = 0;
    for (const ScaledProfile& each : profiles) {
        const double border = window_radius * deviation * unit / each.mean_free_path;
        harmonics = std::max(harmonics, each.profile.harmonics_beyond(border, negligible_outside * power));
    }
    deviation = std::max(deviation, static_cast<double>(harmonics) / harmonics_per_deviation);
    for (const ScaledProfile& each : profiles)
        if (each.profile.detail() == RadialDetail::all)
            deviation = std::max(deviation, std::min(0.5 * fine_end * each.mean_free_path / unit, widest_deviation));
    return deviation;
}

struct Tiling {
    PaddedPlane plane;
    double cost = 0.0;  // nodes transformed; infinite where no tiles fit into the budget
};

// What terms that are in memory at once cost together, beside a transform along one axis each: the angles of the light
// are found, and turned to their harmonics. Half and twice lead to the same times with 8 MiB for 512 x 512 texels.
constexpr double angles_cost = 4.0;

// Beside the fewest tiles that fit, tiles that cost least take .55 to 1 of the time (tests/bench/fft.py, memory that is
// short).
//
// How often a node of a tile is transformed, along x and along y half each, by `Convolution`: the light again for every
// part of the media, the results for every part of the terms.
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
    // What wraps around falls into the halo, and on the whole plane beyond its end.
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
    constexpr std::size_t most_tiles =
        16;  // along a side; 8 and 32 take as long where 8 MiB are for 1024 x 1024 texels
    Tiling best = with_tiles(plane, 1, choice);
    for (std::size_t count = 2; count <= most_tiles; ++count) {
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

// What a ring holds inside an outer window.
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

// The grid of nodes `coarsening` texels apart, on which the kernels begin outside the window that ends the texels', of
// this many texels' deviation.
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
    const auto [width, height, pitch_x, pitch_y] = plane;
    Level one{{width, height, pitch_x, pitch_y}, KernelCentre{}, std::nullopt};
    const double unit = one.plane.unit();
    double cut = 0.0;
    for (const ScaledProfile& each : profiles)
        cut = std::max(cut, each.reach / unit);
    const double diagonal =
        std::hypot(static_cast<double>(width) * pitch_x / unit, static_cast<double>(height) * pitch_y / unit);
    const double centre_deviation = widened(choice.centre_deviation, profiles, unit);
    const double centre_end = window_end * centre_deviation;
    if (cut > centre_end && std::max(width, height) > small_plane) {
        one.ring = {centre_deviation, 0.0, cut, 0.0};
        if (cut > diagonal) {
            // No two texels are farther apart; an abrupt end would ring. A quarter and a 16th of the way give the same.
            one.ring->cut = diagonal;
            one.ring->taper = std::max(centre_end, diagonal / 8.0);
        }
    }
    const auto half_width = [&](double pitch, std::size_t size) {
        const double end = (one.ring ? centre_end : cut) * unit / pitch;
        return static_cast<std::size_t>(std::min(std::ceil(end + 0.5), static_cast<double>(size - 1)));
    };
    one.centre = {half_width(pitch_x, width), half_width(pitch_y, height)};
    set_halo(one);
    Tiling best = choose_tiles(one.plane, choice);
    Levels levels{one, std::nullopt, one.ring};
    levels.texels.plane = best.plane;
    if (!one.ring)
        return levels;

    for (std::size_t coarsening = 4; coarsening <= most_coarsening; coarsening *= 2) {
        if (choice.coarsening != 0 && choice.coarsening != coarsening)
            continue;
        const auto step = static_cast<double>(coarsening);
        const double deviation = step * widened(level_deviation, profiles, step * unit);
        if (window_end * deviation >= one.ring->cut)
            break;
        Level fine = one;
        fine.ring = inside(*one.ring, deviation);
        set_halo(fine);
        const Tiling tiling = choose_tiles(fine.plane, choice);
        Level coarse = coarse_level(one.plane, *one.ring, coarsening, deviation);
        const Tiling coarse_tiling = with_tiles(coarse.plane, 1, choice);
        const PaddedPlane& nodes = coarse_tiling.plane;
        // The results of all media are kept; so are the texels' spectra, of which there are several in any case. A third
        // of the memory and a twelfth, and a gain that has to be 1 or .7, lead to the same times.
        const bool fits = nodes.width * nodes.height * sizeof(float) * choice.media <= choice.budget / 6;
        const double cost = tiling.cost + coarse_tiling.cost;
        if (choice.coarsening == coarsening || (fits && cost < 0.9 * best.cost)) {
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
