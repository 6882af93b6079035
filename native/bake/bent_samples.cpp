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

// Coverage from which on a texel counts as whole.
constexpr float least_whole_coverage = 0.999f;

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

}  // namespace

BentSamples::BentSamples(const Surface& surface, double mean_free_path)
{
    const ReceiverGrid& grid = surface.grid;
    const Vec3 origin = 0.5 * (grid.shape->low + grid.shape->high);
    for (std::size_t i = 0; i < grid.texels(); ++i) {
        first.push_back(all.size());
        const BentTexel& texel = grid.bent_texel(i);
        if (!(texel.area > 0.0f))
            continue;
        Vec3 across(texel.step_x);
        Vec3 along(texel.step_y);
        const float coverage = surface.coverage ? surface.coverage[i] : 1.0f;
        if (coverage < 1.0f)
            find_axes(across, along);
        else
            reduce_steps(across, along);
        const double length = glm::length(along);
        const double longest = std::max(max_stretch * glm::length(across), short_in_paths * mean_free_path);
        const double wanted = length > longest ? std::ceil(length / longest) : 1.0;
        const std::size_t most = coverage < 1.0f ? max_cut_pieces : max_pieces;
        const auto pieces = static_cast<std::size_t>(std::min(wanted, static_cast<double>(most)));
        for (std::size_t k = 0; k < pieces; ++k) {
            const double at = (static_cast<double>(k) + 0.5) / static_cast<double>(pieces) - 0.5;
            all.push_back({Vec3f(texel.position + at * along - origin), texel.normal, texel.tangent,
                           texel.area / static_cast<float>(pieces)});
            steps.push_back({Vec3f(across), Vec3f(along / static_cast<double>(pieces))});
            whole_areas.push_back(all.back().area / std::max(coverage, least_coverage));
        }
    }
    first.push_back(all.size());
    find_neighbors(grid);
}

// Those of a texel are in the four texels beside; those of a piece are the pieces of the same number.
void BentSamples::find_neighbors(const ReceiverGrid& grid)
{
    for (std::size_t i = 0; i < grid.texels(); ++i) {
        const std::size_t x = i % grid.width;
        const std::array<std::size_t, 4> beside = {x > 0 ? i - 1 : i, x + 1 < grid.width ? i + 1 : i,
                                                   i >= grid.width ? i - grid.width : i,
                                                   i + grid.width < grid.texels() ? i + grid.width : i};
        for (std::size_t k = first[i]; k < first[i + 1]; ++k) {
            SampleNeighbors& here = neighbors.emplace_back();
            for (std::size_t n = 0; n < beside.size(); ++n) {
                const std::size_t count = first[beside[n] + 1] - first[beside[n]];
                here[n] =
                    static_cast<std::uint32_t>(count == 0 ? k : first[beside[n]] + std::min(k - first[i], count - 1));
            }
        }
    }
}

std::vector<std::uint8_t> BentSamples::whole_texels(const Surface& surface) const
{
    std::vector<std::uint8_t> is_whole(surface.samples());
    for (std::size_t i = 0; i < is_whole.size(); ++i)
        is_whole[i] = first[i + 1] > first[i] && (!surface.coverage || surface.coverage[i] >= least_whole_coverage);
    return is_whole;
}

}  // namespace beamspread
