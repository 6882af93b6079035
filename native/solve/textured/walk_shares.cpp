#include "solve/textured/walk_shares.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/threads.h"
#include "solve/textured/nearest_texels.h"

namespace beamspread {

namespace {

// Weight of the light within reach of a run beside that of the tile itself. Larger: light that comes from beyond has less
// noise, all other has more.
constexpr double part_around = 0.1;

// Tiles that follow a walk in the time in which it is drawn. Larger: shares of small planes are more alike.
constexpr double tiles_for_drawing = 30.0;

// Tiles that follow a walk in the time in which a drawn walk is turned to a light.
constexpr double tiles_for_turning = 2.0;

// Steps of shares in each octave. More: shares are nearer to the best ones, and more of them are others where last bits of
// the light are, as from one host to the next.
constexpr double share_steps = 2.0;

// Time that drawing walks which few tiles follow may add. Larger: less noise for each walk, and longer.
constexpr double max_added = 0.5;

// Time that walks may add which lights of a group do not share. Larger: errors of lights differ more, so that more of them
// cancel; longer.
constexpr double max_apart = 0.25;

std::size_t walks_of(float share, std::size_t all)
{
    if (!(share > 0.0f))
        return 0;
    return static_cast<std::size_t>(std::max(std::round(static_cast<double>(share) * static_cast<double>(all)), 1.0));
}

// Irradiance of the texels in each tile, summed over all sublattices: [down, across].
std::vector<double> power_of_tiles(const View2D<const float>& light, const Sublattices& sublattices)
{
    const std::size_t rows = sublattices.side() * tile_rows, columns = sublattices.side() * tile_columns;
    std::vector<double> powers(sublattices.tile_count());
    const NearestTexels shown(light, sublattices.height(), sublattices.width());
    parallel_for(sublattices.tiles_down(), [&](std::size_t down) {
        std::vector<double> sums(sublattices.width());
        for (std::size_t y = down * rows; y < std::min((down + 1) * rows, sublattices.height()); ++y)
            for (std::size_t x = 0; x < sublattices.width(); ++x)
                sums[x] += static_cast<double>(shown(y, x));
        for (std::size_t x = 0; x < sublattices.width(); ++x)
            powers[down * sublattices.tiles_across() + x / columns] += sums[x];
    });
    return powers;
}

// Sums of the values that are at most `away` before or after each, along an axis: values are `step` apart, `count` of them.
std::vector<double> sums_along(const std::vector<double>& values, std::size_t step, std::size_t count, std::size_t away)
{
    std::vector<double> sums(values.size());
    for (std::size_t i = 0; i < values.size(); ++i) {
        const std::size_t at = i / step % count, first = at - std::min(at, away);
        for (std::size_t k = first; k <= std::min(at + away, count - 1); ++k)
            sums[i] += values[i + k * step - at * step];
    }
    return sums;
}

}  // namespace

WalkShares::WalkShares(const std::vector<View2D<const float>>& lights,
                       const std::vector<std::vector<std::size_t>>& groups, const Sublattices& sublattices)
    : m_across(sublattices.tiles_across()), m_groups(groups)
{
    const std::size_t rows = sublattices.side() * tile_rows, columns = sublattices.side() * tile_columns;
    const std::size_t away_down = (sublattices.reach() + rows - 1) / rows;
    const std::size_t away_across = (sublattices.reach() + columns - 1) / columns;
    std::vector<double> sums(sublattices.tile_count());
    for (const View2D<const float>& light : lights) {
        const std::vector<double> own = power_of_tiles(light, sublattices);
        const std::vector<double> near =
            sums_along(sums_along(own, m_across, sublattices.tiles_down(), away_down), 1, m_across, away_across);
        std::vector<float>& shares = m_shares.emplace_back(own.size());
        for (std::size_t i = 0; i < own.size(); ++i) {
            const double around = near[i] / static_cast<double>((2 * away_down + 1) * (2 * away_across + 1));
            shares[i] = static_cast<float>(own[i] + part_around * around);
            sums[i] += shares[i];
        }
    }
    divide_by(sums);
    even_out();
    round();
}

void WalkShares::divide_by(const std::vector<double>& sums)
{
    for (std::vector<float>& shares : m_shares)
        for (std::size_t i = 0; i < shares.size(); ++i)
            if (shares[i] > 0.0f)
                shares[i] /= static_cast<float>(sums[i]);
}

// Rounds the shares to steps, and makes those of each tile sum up to 1 again.
void WalkShares::round()
{
    std::vector<double> sums(m_shares.front().size());
    for (std::vector<float>& shares : m_shares)
        for (std::size_t i = 0; i < shares.size(); ++i)
            if (shares[i] > 0.0f) {
                shares[i] = static_cast<float>(
                    std::exp2(std::round(share_steps * std::log2(static_cast<double>(shares[i]))) / share_steps));
                sums[i] += static_cast<double>(shares[i]);
            }
    divide_by(sums);
}

double WalkShares::most_of(std::size_t light) const
{
    return static_cast<double>(*std::ranges::max_element(m_shares[light]));
}

// Each sublattice draws as many walks of a light as any of its tiles follow: where there are few tiles, most shares come
// nearer to their means.
void WalkShares::even_out()
{
    std::vector<double> means;
    for (const std::vector<float>& shares : m_shares)
        means.push_back(std::accumulate(shares.begin(), shares.end(), 0.0) / static_cast<double>(shares.size()));
    double most = 0.0, least = 0.0;
    for (const std::vector<std::size_t>& group : m_groups) {
        double most_drawn = 0.0, least_drawn = 0.0;
        for (const std::size_t light : group) {
            most += tiles_for_turning * most_of(light);
            least += tiles_for_turning * means[light];
            most_drawn = std::max(most_drawn, most_of(light));
            least_drawn = std::max(least_drawn, means[light]);
        }
        most += tiles_for_drawing * most_drawn;
        least += tiles_for_drawing * least_drawn;
    }
    const double allowed = max_added * static_cast<double>(m_shares.front().size());
    if (most - least <= allowed)
        return;
    const double part = allowed / (most - least);
    for (std::size_t light = 0; light < m_shares.size(); ++light)
        for (float& share : m_shares[light])
            if (share > 0.0f)
                share = static_cast<float>(std::lerp(means[light], static_cast<double>(share), part));
}

std::size_t WalkShares::walks(std::size_t light, std::size_t down, std::size_t across, std::size_t all) const
{
    return walks_of(m_shares[light][down * m_across + across], all);
}

std::size_t WalkShares::most(std::size_t light, std::size_t all) const
{
    return walks_of(*std::ranges::max_element(m_shares[light]), all);
}

double WalkShares::walks_at_once() const
{
    constexpr std::size_t many = 1000;
    double apart = 0.0;
    for (std::size_t group = 0; group < m_groups.size(); ++group)
        apart += tiles_for_drawing * static_cast<double>(drawn(group, many)) / static_cast<double>(many);
    for (std::size_t light = 0; light < m_shares.size(); ++light)
        apart += tiles_for_turning * most_of(light);
    const auto tiles = static_cast<double>(m_shares.front().size());
    return std::max((tiles + tiles_for_drawing + tiles_for_turning) / (tiles + apart), 1.0);
}

std::size_t WalkShares::drawn(std::size_t group, std::size_t all) const
{
    std::size_t largest = 0, sum = 0;
    for (const std::size_t light : m_groups[group]) {
        largest = std::max(largest, most(light, all));
        sum += most(light, all);
    }
    return std::clamp(apart(all), largest, sum);
}

std::size_t WalkShares::start(std::size_t group, std::size_t number, std::size_t all) const
{
    return number * apart(all) / m_groups[group].size() % std::max<std::size_t>(drawn(group, all), 1);
}

// Walks of a group that are drawn even if its lights may share fewer.
std::size_t WalkShares::apart(std::size_t all) const
{
    const double tiles = static_cast<double>(m_shares.front().size()) / static_cast<double>(m_groups.size());
    return static_cast<std::size_t>(max_apart * tiles / tiles_for_drawing * static_cast<double>(all));
}

}  // namespace beamspread
