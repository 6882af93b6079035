#include "bake/bent_samples.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace beamspread {

namespace {

// The solver takes samples as disks, which overlap where texels are long: a texel's light reaches its neighbors beside in
// place of its own ends. Long texels are divided into pieces: their length over width from which on, their length over the
// shortest mean free path below which they stay whole, and their largest number, also for parts of texels. Larger lengths:
// fewer samples, and light that is blurred across long texels (docs/tuning.md).
constexpr double max_stretch = 1.3;
constexpr double short_in_paths = 0.1;
constexpr std::size_t max_pieces = 64;
constexpr std::size_t max_cut_pieces = 8;

// Narrow texels of a row share samples up to this width, over the length of theirs and of a mean texel. They turn by less
// than these cosines, in their plane and out of it.
constexpr double run_width = 1.0;
constexpr double least_run_cosine = 0.9;
constexpr float least_normal_cosine = 0.99f;

// Coverage from which on a texel counts as whole.
constexpr float least_whole_coverage = 0.999f;

// Largest ratio of the areas of texels side by side on an even lattice.
constexpr float most_growth = 1.08f;

// Coverage that smaller ones count as: rounding decides about their areas.
constexpr float least_coverage = 1e-5f;

// Replaces the sides of a parallelogram by those of the rectangle of the same covariance, the shorter one first.
void find_axes(Vec3& across, Vec3& along)
{
    const double xx = glm::dot(across, across);
    const double yy = glm::dot(along, along);
    const double xy = glm::dot(across, along);
    const double angle = 0.5 * std::atan2(2.0 * xy, xx - yy);  // of the longer axis
    const Vec3 longer = across * std::cos(angle) + along * std::sin(angle);
    across = along * std::cos(angle) - across * std::sin(angle);
    along = longer;
}

// True inside the mesh for a texel that the mesh covers wholly.
bool is_whole(const Surface& surface, std::size_t texel)
{
    return surface.grid.bent_texel(texel).area > 0.0f &&
           (!surface.coverage || surface.coverage[texel] >= least_whole_coverage);
}

// Change of the normal along an axis of the texture, per texel: half of that from the texel before to the one after, or that
// to one of them, where they are neighbors.
Vec3 turn_along(const ReceiverGrid& grid, std::size_t texel, std::size_t place, std::size_t count, std::size_t stride,
                Vec3f BentTexel::* step)
{
    const BentTexel& here = grid.bent_texel(texel);
    Vec3 sum(0.0);
    double found = 0.0;
    if (place > 0 && are_neighbors(grid.bent_texel(texel - stride), here, step)) {
        sum += Vec3(here.normal - grid.bent_texel(texel - stride).normal);
        found += 1.0;
    }
    if (place + 1 < count && are_neighbors(here, grid.bent_texel(texel + stride), step)) {
        sum += Vec3(grid.bent_texel(texel + stride).normal - here.normal);
        found += 1.0;
    }
    return found > 0.0 ? sum / found : sum;
}

// Change of the normal along a vector of a texel's plane.
Vec3 turn_along(const ReceiverGrid& grid, std::size_t texel, const Vec3& along)
{
    const Vec3 x(grid.bent_texel(texel).step_x);
    const Vec3 y(grid.bent_texel(texel).step_y);
    const Vec3 normal = glm::cross(x, y);
    const double square = glm::dot(normal, normal);
    return glm::dot(glm::cross(along, y), normal) / square *
               turn_along(grid, texel, texel % grid.width, grid.width, 1, &BentTexel::step_x) +
           glm::dot(glm::cross(x, along), normal) / square *
               turn_along(grid, texel, texel / grid.width, grid.height, grid.width, &BentTexel::step_y);
}

}  // namespace

BentSamples::BentSamples(const Surface& surface, double mean_free_path)
{
    const ReceiverGrid& grid = surface.grid;
    find_runs(surface);
    of_texel.resize(grid.texels());
    for (std::size_t i = 0; i < grid.texels(); ++i) {
        if (!(grid.bent_texel(i).area > 0.0f))
            continue;
        const Run* const here = run_of(i);
        if (here != nullptr && i > here->first) {
            of_texel[i] = of_texel[here->first];
            continue;
        }
        const auto begin = static_cast<std::uint32_t>(all.size());
        add(grid, here != nullptr ? here->first + here->count / 2 : i, part_of(surface, i), mean_free_path);
        of_texel[i] = {begin, static_cast<std::uint32_t>(all.size()) - begin};
    }
    find_neighbors(grid);
}

void BentSamples::find_runs(const Surface& surface)
{
    const ReceiverGrid& grid = surface.grid;
    const auto width_of = [&](std::size_t i) { return static_cast<double>(glm::length(grid.bent_texel(i).step_x)); };
    // Number of texels that share samples, by their size.
    const auto most_of = [&](std::size_t i) {
        const auto length = static_cast<double>(glm::length(grid.bent_texel(i).step_y));
        return static_cast<std::size_t>(run_width * std::min(length, grid.pitch_x) / width_of(i));
    };
    const auto is_alike = [&](std::size_t i, std::size_t other) {
        const BentTexel& a = grid.bent_texel(i);
        const BentTexel& b = grid.bent_texel(other);
        return glm::dot(Vec3(a.step_x), Vec3(b.step_x)) >= least_run_cosine * width_of(i) * width_of(other) &&
               glm::dot(a.normal, b.normal) >= least_normal_cosine;
    };
    for (std::size_t i = 0; i < grid.texels(); ++i) {
        if (!is_whole(surface, i) || most_of(i) < 2)
            continue;
        const std::size_t row_end = (i / grid.width + 1) * grid.width;
        const auto goes_on_at = [&](std::size_t next) {
            return next < row_end && is_whole(surface, next) && most_of(next) >= 2 &&
                   are_neighbors(grid.bent_texel(next - 1), grid.bent_texel(next), &BentTexel::step_x);
        };
        std::size_t end = i + 1;
        std::size_t most = most_of(i);
        while (goes_on_at(end)) {
            most = std::min(most, most_of(end));
            ++end;
        }
        // Runs of about the same number of texels: a short one at the end would have a disk unlike its neighbors.
        std::size_t parts = (end - i + most - 1) / most;
        const auto begin_of = [&](std::size_t part) { return i + part * (end - i) / parts; };
        const auto turns = [&] {
            for (std::size_t part = 0; part < parts; ++part)
                if (!is_alike(begin_of(part), begin_of(part + 1) - 1))
                    return true;
            return false;
        };
        while (parts < end - i && turns())
            parts = std::min(2 * parts, end - i);
        for (std::size_t part = 0; part < parts; ++part) {
            Run found{
                .first = begin_of(part), .count = begin_of(part + 1) - begin_of(part), .goes_on = part + 1 < parts};
            for (std::size_t k = found.first; k < found.first + found.count; ++k)
                found.area += grid.bent_texel(k).area;
            run.resize(grid.texels());
            runs.push_back(found);
            std::fill_n(run.begin() + static_cast<std::ptrdiff_t>(found.first), found.count,
                        static_cast<std::uint32_t>(runs.size()));
        }
        i = end - 1;
    }
}

BentSamples::Part BentSamples::part_of(const Surface& surface, std::size_t texel) const
{
    const ReceiverGrid& grid = surface.grid;
    const Run* const here = run_of(texel);
    const std::size_t count = here != nullptr ? here->count : 1;
    const BentTexel& middle = grid.bent_texel(texel + count / 2);
    Part part{.tangent = Vec3(middle.tangent), .step_y = Vec3(middle.step_y)};
    if (surface.coverage)
        part.coverage = surface.coverage[texel];
    for (std::size_t i = texel; i < texel + count; ++i) {
        const BentTexel& other = grid.bent_texel(i);
        part.position += static_cast<double>(other.area) * other.position;
        part.normal += Vec3(other.normal);
        part.step_x += Vec3(other.step_x);
        part.area += other.area;
    }
    part.position /= static_cast<double>(part.area);
    part.is_uneven = is_uneven(surface, texel, count);
    return part;
}

bool BentSamples::is_uneven(const Surface& surface, std::size_t first, std::size_t count)
{
    const ReceiverGrid& grid = surface.grid;
    const auto goes_on = [&](std::size_t a, std::size_t b, Vec3f BentTexel::* step) {
        const auto [smaller, larger] = std::minmax(grid.bent_texel(a).area, grid.bent_texel(b).area);
        return is_whole(surface, a) && is_whole(surface, b) && larger < most_growth * smaller &&
               are_neighbors(grid.bent_texel(a), grid.bent_texel(b), step);
    };
    const std::size_t last = first + count - 1;
    const std::size_t middle = first + count / 2;
    return !(first % grid.width > 0 && goes_on(first - 1, first, &BentTexel::step_x) && (last + 1) % grid.width > 0 &&
             goes_on(last, last + 1, &BentTexel::step_x) && middle >= grid.width &&
             goes_on(middle - grid.width, middle, &BentTexel::step_y) && middle + grid.width < grid.texels() &&
             goes_on(middle, middle + grid.width, &BentTexel::step_y));
}

void BentSamples::add(const ReceiverGrid& grid, std::size_t texel, const Part& part, double mean_free_path)
{
    const Vec3 origin = 0.5 * (grid.shape->low + grid.shape->high);
    Vec3 across = part.step_x;
    Vec3 along = part.step_y;
    if (part.coverage < 1.0f)
        find_axes(across, along);
    else
        reduce_steps(across, along);
    const double length = glm::length(along);
    const double longest = std::max(max_stretch * glm::length(across), short_in_paths * mean_free_path);
    const double wanted = length > longest ? std::ceil(length / longest) : 1.0;
    const std::size_t most = part.coverage < 1.0f ? max_cut_pieces : max_pieces;
    const auto pieces = static_cast<std::size_t>(std::min(wanted, static_cast<double>(most)));
    // Pieces of one normal would have edges between texels, as pairs see them.
    const Vec3 turn = pieces > 1 ? turn_along(grid, texel, along) : Vec3(0.0);
    for (std::size_t k = 0; k < pieces; ++k) {
        const double at = (static_cast<double>(k) + 0.5) / static_cast<double>(pieces) - 0.5;
        const Vec3 normal = glm::normalize(glm::normalize(part.normal) + at * turn);
        const Vec3 tangent = part.tangent - normal * glm::dot(part.tangent, normal);
        all.push_back({Vec3f(part.position + at * along - origin), Vec3f(normal), Vec3f(glm::normalize(tangent)),
                       part.area / static_cast<float>(pieces)});
        steps.push_back({Vec3f(across), Vec3f(along / static_cast<double>(pieces))});
        uneven_sides.push_back(part.is_uneven ? std::sqrt(part.area / std::max(part.coverage, least_coverage)) : 0.0f);
    }
}

// The neighbors of a piece are the pieces of the same number in the four texels beside its own.
void BentSamples::find_neighbors(const ReceiverGrid& grid)
{
    neighbors.resize(all.size());
    for (std::size_t i = 0; i < grid.texels(); ++i) {
        const Run* const here = run_of(i);
        if (here != nullptr && i > here->first)
            continue;
        const std::size_t last = here != nullptr ? i + here->count - 1 : i;
        const std::size_t middle = (i + last + 1) / 2;
        const std::array<std::size_t, 4> beside = {i % grid.width > 0 ? i - 1 : i,
                                                   (last + 1) % grid.width > 0 ? last + 1 : i,
                                                   middle >= grid.width ? middle - grid.width : i,
                                                   middle + grid.width < grid.texels() ? middle + grid.width : i};
        // Pieces beside whole texels, or beside more pieces, are no lattice.
        const bool is_even = std::ranges::all_of(
            beside, [&](std::size_t n) { return of_texel[n].count == 0 || of_texel[n].count == of_texel[i].count; });
        for (std::uint32_t k = 0; k < of_texel[i].count; ++k) {
            const std::uint32_t sample = of_texel[i].begin + k;
            if (!is_even && uneven_sides[sample] == 0.0f)
                uneven_sides[sample] = std::sqrt(all[sample].area * static_cast<float>(of_texel[i].count));
            for (std::size_t n = 0; n < beside.size(); ++n) {
                const Range& other = of_texel[beside[n]];
                neighbors[sample][n] = other.count == 0 ? sample : other.begin + std::min(k, other.count - 1);
            }
        }
    }
}

std::pair<std::size_t, float> BentSamples::beside(std::size_t texel) const
{
    const Run* const here = run_of(texel);
    if (here == nullptr)
        return {texel, 0.0f};
    const float from_middle = static_cast<float>(texel - here->first) - 0.5f * static_cast<float>(here->count - 1);
    const Run* const other = from_middle > 0.0f ? here + 1 : here - 1;
    const bool is_known =
        from_middle > 0.0f
            ? here->goes_on && other < runs.data() + runs.size() && other->first == here->first + here->count
            : other >= runs.data() && other->goes_on && other->first + other->count == here->first;
    if (!is_known)
        return {texel, 0.0f};
    return {other->first, std::abs(from_middle) / (0.5f * static_cast<float>(here->count + other->count))};
}

std::vector<std::uint8_t> BentSamples::whole_texels(const Surface& surface) const
{
    std::vector<std::uint8_t> are_whole(surface.samples());
    for (std::size_t i = 0; i < are_whole.size(); ++i)
        are_whole[i] = is_whole(surface, i) ? 1 : 0;
    return are_whole;
}

}  // namespace beamspread
