#include "solve/adaptive/near_field.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "base/constants.h"
#include "base/threads.h"
#include "simd/target_clones.h"

namespace beamspread {

namespace {

struct Light {
    std::ptrdiff_t x;
    double value;
};

// Lights of one row that reach a block of targets, and the kernel's rows at dx = 0 for even and odd columns.
struct LightRow {
    const Light* first;
    const Light* last;
    std::array<const double*, 2> kernel;
};

using Lanes = double __attribute__((vector_size(64), aligned(8), may_alias));
static_assert(2 * sizeof(Lanes) == near_block * sizeof(double));

// Adds the lights of many rows to the targets x .. x + near_block - 1.
BEAMSPREAD_CLONES void add_rows(double* sum, std::ptrdiff_t x, const LightRow* rows, std::size_t count)
{
    auto* to = reinterpret_cast<Lanes*>(sum);
    Lanes left = to[0];
    Lanes right = to[1];
    for (std::size_t i = 0; i < count; ++i) {
        const LightRow& row = rows[i];
        for (const Light* light = row.first; light != row.last; ++light) {
            const auto* kernel = reinterpret_cast<const Lanes*>(row.kernel[light->x & 1] + (x - light->x));
            left += light->value * kernel[0];
            right += light->value * kernel[1];
        }
    }
    to[0] = left;
    to[1] = right;
}

// A row of lights as far as it reaches a row of targets.
struct SourceRow {
    std::size_t y;
    std::ptrdiff_t chord;  // half the width of what it reaches
    std::array<const double*, 2> kernel;
};

// Lights other than zero, row by row.
class LightRows {
public:
    explicit LightRows(const Grid& grid) : m_width(static_cast<std::ptrdiff_t>(grid.width)), m_rows(grid.height)
    {
        for (std::size_t y = 0; y < grid.height; ++y) {
            Row& row = m_rows[y];
            row.before.reserve(grid.width + 1);
            for (std::size_t x = 0; x < grid.width; ++x) {
                row.before.push_back(static_cast<std::uint32_t>(row.lights.size()));
                if (grid.row(y)[x] != 0.0)
                    row.lights.push_back({static_cast<std::ptrdiff_t>(x), grid.row(y)[x]});
            }
            row.before.push_back(static_cast<std::uint32_t>(row.lights.size()));
            if (!row.lights.empty())
                m_lit.push_back(y);
        }
    }

    // Rows that have any.
    const std::vector<std::size_t>& lit() const { return m_lit; }

    // Lights of row y in the columns first .. last.
    std::pair<const Light*, const Light*> between(std::size_t y, std::ptrdiff_t first, std::ptrdiff_t last) const
    {
        const Row& row = m_rows[y];
        const auto at = [&](std::ptrdiff_t x) {
            return row.lights.data() + row.before[static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(x, 0, m_width))];
        };
        return {at(first), at(last + 1)};
    }

private:
    struct Row {
        std::vector<Light> lights;
        std::vector<std::uint32_t> before;  // lights to the left of each column
    };
    std::ptrdiff_t m_width;
    std::vector<Row> m_rows;
    std::vector<std::size_t> m_lit;
};

}  // namespace

void add_near(Grid& sum, const Grid& lights, const NearKernels& kernels)
{
    const LightRows light_rows(lights);
    const auto width = static_cast<std::ptrdiff_t>(sum.width);
    parallel_for(sum.height, [&](std::size_t target) {
        std::vector<SourceRow> sources;
        for (const std::size_t source : light_rows.lit()) {
            const std::ptrdiff_t dy = static_cast<std::ptrdiff_t>(target) - static_cast<std::ptrdiff_t>(source);
            if (std::abs(dy) > kernels.radius)
                continue;
            const auto chord =
                static_cast<std::ptrdiff_t>(std::sqrt(static_cast<double>(kernels.radius * kernels.radius - dy * dy)));
            const std::size_t parity = 2 * (source % 2);
            sources.push_back({source, chord, {kernels.tables[parity]->row(dy), kernels.tables[parity + 1]->row(dy)}});
        }
        std::vector<LightRow> rows;
        for (std::ptrdiff_t x = 0; x < width; x += near_block) {
            rows.clear();
            for (const SourceRow& source : sources) {
                const auto [first, last] =
                    light_rows.between(source.y, x - source.chord, x + near_block - 1 + source.chord);
                if (first != last)
                    rows.push_back({first, last, source.kernel});
            }
            std::array<double, near_block> block{};
            add_rows(block.data(), x, rows.data(), rows.size());
            const auto count = std::min(near_block, width - x);
            for (std::ptrdiff_t k = 0; k < count; ++k)
                sum.row(target)[x + k] += block[static_cast<std::size_t>(k)];
        }
    });
}

double near_cost(std::ptrdiff_t radius, std::size_t height, std::size_t width)
{
    const auto r = static_cast<double>(radius);
    const double rows = std::min(2.0 * r + 1.0, static_cast<double>(height));
    const auto block = static_cast<double>(near_block);
    return std::min(pi * r * r + rows * block, rows * (static_cast<double>(width) + block));
}

}  // namespace beamspread
