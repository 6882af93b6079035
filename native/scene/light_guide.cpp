#include "scene/light_guide.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <ranges>

namespace beamspread {

namespace {

// Fraction of rays that stay even. More: less noise of light that no hit tells of, and more of the rest.
constexpr double even_share = 0.1;

// Boxes around that of the hits: how many times as large, and their fractions of the rays. They find light beside the hits.
struct WideBox {
    double size;
    double share;
};
constexpr std::array wide_boxes = {WideBox{2.5, 0.2}, WideBox{10.0, 0.1}};
constexpr double histogram_share = 0.7;

// Number of hits up to which they do not tell how large the opening is. Boxes with these half sides lie around their own.
constexpr std::size_t few_hits = 5;
constexpr std::array few_reaches = {1.0 / 2048, 1.0 / 512, 1.0 / 128, 1.0 / 32, 1.0 / 8};

// Distance of the box's border to the outermost hits, as a fraction of half its extent, besides the distance at which two
// hits lie apart on average. Less: rays beyond the border, which count more, make noise.
constexpr double margin = 0.15;

// Smallest distance of the box's border to a hit. Smaller: narrower light, and more noise where hits coincide by chance.
constexpr double min_reach = 1.0 / 16384;

// A hit counts by this in cells beside its own, and by its square in those at the corners; all cells have this fraction of
// the mean besides. More: smoother, where hits are few.
constexpr double beside = 0.5;
constexpr double floor_of_mean = 0.05;

// Moves of places with the position count if they explain the places this many times as well, for each degree of freedom,
// as chance does (an F-test).
constexpr double min_evidence = 10.0;

// Distance from their center, in standard deviations of the hits, up to which moves with the position are known.
constexpr double known_spreads = 2.5;

// Clusters part where the widest gap between hits is more than this fraction of their extent. Less: more clusters.
constexpr float min_gap = 0.35f;
constexpr std::size_t max_clusters = 6;

// Index of the first end above a number, at most the last.
std::size_t find_part(std::span<const double> ends, double at)
{
    return static_cast<std::size_t>(std::ranges::upper_bound(ends.begin(), ends.end() - 1, at) - ends.begin());
}

// Moves a number that lies in part i of [0, 1) to where it lies within the part, 0 to 1.
double within(std::span<const double> ends, std::size_t i, double at)
{
    const double begin = i > 0 ? ends[i - 1] : 0.0;
    return std::clamp((at - begin) / (ends[i] - begin), 0.0, 1.0);
}

bool is_within(const Vec2& inside, const Vec2& size)
{
    return inside.x <= size.x && inside.y <= size.y;
}

// The widest gap between neighboring places along an axis, and the outermost places.
struct Gap {
    float low = 0.0f, high = 0.0f;  // ends of the gap
    float first = 0.0f, last = 0.0f;

    float width() const { return high - low; }
    float extent() const { return last - first; }
};

// Without sorting: of n places in n - 1 equal cells between the first and the last, the widest gap lies between cells, not
// within one.
Gap find_gap(std::span<const LightHit> hits, Vec2f::length_type axis, std::vector<Vec2f>& cells)
{
    const auto place = [axis](const LightHit& hit) { return hit.place[axis]; };
    const auto [first, last] = std::ranges::minmax(hits | std::views::transform(place));
    Gap widest{.low = first, .high = first, .first = first, .last = last};
    if (!(first < last))
        return widest;
    const auto count = static_cast<float>(hits.size() - 1);
    // [cell] first and last place
    cells.assign(hits.size(), Vec2f(std::numeric_limits<float>::max(), std::numeric_limits<float>::lowest()));
    for (const LightHit& hit : hits) {
        Vec2f& cell = cells[static_cast<std::size_t>((place(hit) - first) / (last - first) * count)];
        cell = {std::min(cell.x, place(hit)), std::max(cell.y, place(hit))};
    }
    float before = first;
    for (const Vec2f& cell : cells) {
        if (cell.x > cell.y)
            continue;
        if (cell.x - before > widest.width()) {
            widest.low = before;
            widest.high = cell.x;
        }
        before = cell.y;
    }
    return widest;
}

// Moves places by 1 so that the widest gap lies around them: light may go on beyond a border of the square, as that of
// the sky does, which is round.
void unwrap(std::span<LightHit> hits, Vec2f::length_type axis, std::vector<Vec2f>& cells)
{
    const Gap gap = find_gap(hits, axis, cells);
    if (gap.width() <= 1.0f - gap.extent())
        return;
    for (LightHit& hit : hits)
        if (hit.place[axis] <= gap.low)
            hit.place[axis] += 1.0f;
}

}  // namespace

HitCluster::HitCluster(std::span<const LightHit> hits)
{
    fit_steps(hits);
    std::vector<Vec2> places;
    Vec2 low(std::numeric_limits<double>::max()), high(std::numeric_limits<double>::lowest());
    for (const LightHit& hit : hits) {
        places.push_back(Vec2(hit.place) - move_to(Vec2(hit.position)));
        low = glm::min(low, places.back());
        high = glm::max(high, places.back());
    }
    const Vec2 center = 0.5 * (low + high);
    const Vec2 half = 0.5 * (high - low) * (1.0 + margin + 4.0 / static_cast<double>(hits.size())) + min_reach;
    const auto box = [&](const Vec2& reach, double share) {
        const Vec2 most = glm::min(reach, Vec2(0.5));
        return Box{center - most, 2.0 * most, share};
    };
    if (hits.size() <= few_hits) {
        for (const double reach : few_reaches)
            m_boxes.push_back(box(half + reach, 1.0 / few_reaches.size()));
        return;
    }
    m_histogram = box(half, histogram_share);
    for (const WideBox& wide : wide_boxes)
        m_boxes.push_back(box(wide.size * half, wide.share));
    count(places);
}

Vec2 HitCluster::move_to(const Vec2& position) const
{
    const Vec2 from_center = position - m_center;
    return from_center.x * m_step_x + from_center.y * m_step_y;
}

// Finds the linear map from positions to places with the least squares.
void HitCluster::fit_steps(std::span<const LightHit> hits)
{
    if (hits.size() <= few_hits)
        return;
    Vec2 mean_place(0.0);
    for (const LightHit& hit : hits) {
        m_center += Vec2(hit.position) / static_cast<double>(hits.size());
        mean_place += Vec2(hit.place) / static_cast<double>(hits.size());
    }
    double xx = 0.0, xy = 0.0, yy = 0.0, variance = 0.0;
    Vec2 by_x(0.0), by_y(0.0);
    for (const LightHit& hit : hits) {
        const Vec2 position = Vec2(hit.position) - m_center;
        const Vec2 place = Vec2(hit.place) - mean_place;
        xx += position.x * position.x;
        xy += position.x * position.y;
        yy += position.y * position.y;
        by_x += position.x * place;
        by_y += position.y * place;
        variance += glm::dot(place, place);
    }
    const double determinant = xx * yy - xy * xy;
    if (!(determinant > 1e-3 * xx * yy))
        return;
    const Vec2 step_x = (yy * by_x - xy * by_y) / determinant;
    const Vec2 step_y = (xx * by_y - xy * by_x) / determinant;
    const double explained = glm::dot(step_x, by_x) + glm::dot(step_y, by_y);
    const double left_over = std::max(variance - explained, 0.0);
    if (explained / 2.0 < min_evidence * left_over / static_cast<double>(hits.size() - 3))
        return;
    m_step_x = step_x;
    m_step_y = step_y;
    m_known = known_spreads * std::sqrt((xx + yy) / static_cast<double>(hits.size()));
}

double HitCluster::growth(const Vec2& position) const
{
    return m_known > 0.0 ? std::max(1.0, glm::length(position - m_center) / m_known) : 1.0;
}

// Makes the histogram.
void HitCluster::count(std::span<const Vec2> places)
{
    constexpr double cells_per_side = side;
    m_cells.fill(floor_of_mean * static_cast<double>(places.size()) / (cells_per_side * cells_per_side));
    for (const Vec2& place : places) {
        const Vec2 cell = glm::floor(glm::fract(place - m_histogram.low) / m_histogram.size * cells_per_side);
        for (int x = -1; x <= 1; ++x)
            for (int y = -1; y <= 1; ++y) {
                const double column = cell.x + x, row = cell.y + y;
                if (column >= 0.0 && row >= 0.0 && column < cells_per_side && row < cells_per_side)
                    m_cells[static_cast<std::size_t>(column) * side + static_cast<std::size_t>(row)] +=
                        (x == 0 ? 1.0 : beside) * (y == 0 ? 1.0 : beside);
            }
    }
    double total = 0.0;
    for (std::size_t column = 0; column < side; ++column) {
        double sum = 0.0;
        for (std::size_t row = 0; row < side; ++row)
            m_rows[column * side + row] = sum += m_cells[column * side + row];
        for (std::size_t row = 0; row < side; ++row)
            m_rows[column * side + row] /= sum;
        m_columns[column] = total += sum;
    }
    for (double& end : m_columns)
        end /= total;
    const double cell_area = m_histogram.size.x * m_histogram.size.y / (cells_per_side * cells_per_side);
    for (double& cell : m_cells)
        cell *= m_histogram.share / (total * cell_area);
}

// The histogram is inverted column first, which keeps the order of places, and so the evenness of low-discrepancy ones.
Vec2 HitCluster::place_at(const Vec2& position, const Vec2& square) const
{
    const Vec2 move = move_to(position);
    if (square.x < m_histogram.share) {
        const double at = square.x / m_histogram.share;
        const std::size_t column = find_part(m_columns, at);
        const std::span rows = std::span(m_rows).subspan(column * side, side);
        const std::size_t row = find_part(rows, square.y);
        const Vec2 cell(static_cast<double>(column) + within(m_columns, column, at),
                        static_cast<double>(row) + within(rows, row, square.y));
        return move + m_histogram.low + cell / static_cast<double>(side) * m_histogram.size;
    }
    double at = square.x - m_histogram.share;
    std::size_t i = 0;
    for (; i + 1 < m_boxes.size() && at >= m_boxes[i].share; ++i)
        at -= m_boxes[i].share;
    const Box box = m_boxes[i].grown(growth(position));
    return move + box.low + Vec2(std::min(at / box.share, 1.0), square.y) * box.size;
}

double HitCluster::density(const Vec2& position, const Vec2& place) const
{
    const Vec2 still = place - move_to(position);
    const double larger = growth(position);
    double sum = 0.0;
    for (const Box& small : m_boxes) {
        const Box box = small.grown(larger);
        if (is_within(glm::fract(still - box.low), box.size))
            sum += box.share / (box.size.x * box.size.y);
    }
    const Vec2 inside = glm::fract(still - m_histogram.low);
    if (m_histogram.share > 0.0 && is_within(inside, m_histogram.size)) {
        const Vec2 cell =
            glm::min(inside / m_histogram.size * static_cast<double>(side), Vec2(static_cast<double>(side - 1)));
        sum += m_cells[static_cast<std::size_t>(cell.x) * side + static_cast<std::size_t>(cell.y)];
    }
    return sum;
}

void LightGuide::assign(std::span<LightHit> hits)
{
    m_clusters.clear();
    m_ends.clear();
    if (hits.empty())
        return;
    unwrap(hits, 0, m_cells);
    unwrap(hits, 1, m_cells);
    add_clusters(hits);
    for (double& end : m_ends)
        end /= m_ends.back();
}

// Parts hits at their widest gap, and the parts again: there may be several windows.
void LightGuide::add_clusters(std::span<LightHit> hits)
{
    if (hits.size() > 1 && m_clusters.size() + 1 < max_clusters)
        for (const Vec2f::length_type axis : {0, 1}) {
            const Gap gap = find_gap(hits, axis, m_cells);
            if (gap.width() > min_gap * gap.extent()) {
                const auto after = std::partition(hits.begin(), hits.end(),
                                                  [&](const LightHit& hit) { return hit.place[axis] <= gap.low; });
                add_clusters(std::span(hits.begin(), after));
                add_clusters(std::span(after, hits.end()));
                return;
            }
        }
    m_clusters.emplace_back(hits);
    m_ends.push_back((m_ends.empty() ? 0.0 : m_ends.back()) + static_cast<double>(hits.size()));
}

double LightGuide::guide(const Vec2& position, Vec2& place) const
{
    if (empty())
        return 1.0;
    if (place.x < even_share) {
        place.x /= even_share;
    } else {
        const double at = (place.x - even_share) / (1.0 - even_share);
        const std::size_t i = find_part(m_ends, at);
        place = glm::fract(m_clusters[i].place_at(position, Vec2(within(m_ends, i, at), place.y)));
    }
    double density = 0.0;
    for (std::size_t i = 0; i < m_clusters.size(); ++i)
        density += (m_ends[i] - (i > 0 ? m_ends[i - 1] : 0.0)) * m_clusters[i].density(position, place);
    return even_share + (1.0 - even_share) * density;
}

}  // namespace beamspread
