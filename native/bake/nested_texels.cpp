#include "bake/nested_texels.h"

#include <utility>

#include "base/threads.h"

namespace beamspread {

namespace {

// Adds the interpolation along a line of texels, at `place` of `count`.
void add_line(const std::vector<std::uint32_t>& runs, std::size_t texel, std::size_t stride, std::size_t place,
              std::size_t count, std::size_t step, Stencil& stencil)
{
    const auto is_near = [&](bool after, std::size_t steps) {
        const std::size_t way = steps * step;
        return (after ? place + way < count : place >= way) &&
               runs[after ? texel + way * stride : texel - way * stride] == runs[texel];
    };
    if (!is_near(false, 1) || !is_near(true, 1))
        return;
    const bool has_before = is_near(false, 3);
    const bool has_after = is_near(true, 3);
    if (!has_before && !has_after)
        return;
    const auto add = [&](std::size_t at, float weight) {
        stencil.texel[stencil.count] = at;
        stencil.weight[stencil.count++] = weight;
    };
    const std::size_t way = step * stride;
    if (has_before)
        add(texel - 3 * way, has_after ? -0.0625f : -0.125f);
    add(texel - way, has_before && has_after ? 0.5625f : has_before ? 0.75f : 0.375f);
    add(texel + way, has_before && has_after ? 0.5625f : has_before ? 0.375f : 0.75f);
    if (has_after)
        add(texel + 3 * way, has_before ? -0.0625f : -0.125f);
}

}  // namespace

NestedTexels::NestedTexels(const ReceiverGrid& grid, std::vector<std::uint8_t> is_whole)
    : m_width(grid.width),
      m_height(grid.height),
      m_is_whole(std::move(is_whole)),
      m_row_runs(m_is_whole.size()),
      m_column_runs(m_is_whole.size())
{
    const auto find_runs = [&](std::size_t first, std::size_t count, std::size_t stride, Vec3f BentTexel::* step,
                               std::vector<std::uint32_t>& runs) {
        std::uint32_t run = 0;
        for (std::size_t i = 0; i < count; ++i) {
            const std::size_t texel = first + i * stride;
            if (m_is_whole[texel] == 0)
                continue;
            const bool goes_on = i > 0 && m_is_whole[texel - stride] != 0 &&
                                 are_neighbors(grid.bent_texel(texel - stride), grid.bent_texel(texel), step);
            run += goes_on ? 0 : 1;
            runs[texel] = run;
        }
    };
    parallel_for(m_height, [&](std::size_t y) { find_runs(y * m_width, m_width, 1, &BentTexel::step_x, m_row_runs); });
    parallel_for(m_width, [&](std::size_t x) { find_runs(x, m_height, m_width, &BentTexel::step_y, m_column_runs); });
}

void NestedTexels::for_each(std::size_t step, const std::function<void(const Place&)>& visit) const
{
    parallel_for((m_height + step - 1) / step, [&](std::size_t row) {
        const bool is_odd = row % 2 == 1;
        for (std::size_t column = is_odd ? 0 : 1; column * step < m_width; column += is_odd ? 1 : 2)
            if (is_whole(row * step * m_width + column * step))
                visit({column * step, row * step, !is_odd || column % 2 == 0});
    });
}

Stencil NestedTexels::stencil(const Place& place, std::size_t step) const
{
    Stencil stencil;
    const std::size_t texel = place.y * m_width + place.x;
    if (place.x / step % 2 == 1)
        add_line(m_row_runs, texel, 1, place.x, m_width, step, stencil);
    const std::size_t of_row = stencil.count;
    if (place.y / step % 2 == 1)
        add_line(m_column_runs, texel, m_width, place.y, m_height, step, stencil);
    if (of_row > 0 && stencil.count > of_row)
        for (float& weight : stencil.weight)
            weight *= 0.5f;
    return stencil;
}

}  // namespace beamspread
