#include "solve/adaptive/texel_kernel.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/threads.h"
#include "ldf/radial/texel_integral.h"

namespace beamspread {

namespace {

constexpr std::ptrdiff_t factor = 3;          // blocks of three have the lit texel in the middle of the middle block
constexpr std::ptrdiff_t stencil_radius = 2;  // blocks on either side that a block's polynomial passes through

using Stencil = std::array<double, 2 * stencil_radius + 1>;

// Power of the left, middle and right third of a block from that of the block and its neighbours: the polynomial of
// degree four that has their powers, integrated over the third. Its primitive is known at the blocks' borders.
std::array<Stencil, 3> third_weights()
{
    const auto primitive = [](double x) {
        Stencil weights{};
        for (int i = 0; i <= 5; ++i) {
            double lagrange = 1.0;
            for (int k = 0; k <= 5; ++k)
                if (k != i)
                    lagrange *= (x - (k - 2.5)) / static_cast<double>(i - k);
            for (std::size_t block = 0; block < static_cast<std::size_t>(i); ++block)
                weights[block] += lagrange;
        }
        return weights;
    };
    std::array<Stencil, 3> thirds{};
    for (std::size_t third = 0; third < 3; ++third) {
        const Stencil from = primitive(-0.5 + static_cast<double>(third) / 3.0);
        const Stencil to = primitive(-0.5 + static_cast<double>(third + 1) / 3.0);
        for (std::size_t block = 0; block < from.size(); ++block)
            thirds[third][block] = to[block] - from[block];
    }
    return thirds;
}

// Power of a texel from the blocks around it: block_of(i) - stencil_radius and on.
const Stencil& weights_of(std::ptrdiff_t i, std::ptrdiff_t block)
{
    static const std::array<Stencil, 3> thirds = third_weights();
    return thirds[static_cast<std::size_t>(i - factor * block + 1)];
}

std::ptrdiff_t block_of(std::ptrdiff_t i)
{
    return i >= 0 ? (i + 1) / factor : -((1 - i) / factor);
}

std::ptrdiff_t coarse_reach(std::ptrdiff_t reach)
{
    return block_of(reach) + stencil_radius;
}

}  // namespace

KernelTable::KernelTable(std::ptrdiff_t reach_y, std::ptrdiff_t reach_x)
    : m_reach_y(reach_y), m_reach_x(reach_x), m_values(static_cast<std::size_t>((2 * reach_y + 1) * (2 * reach_x + 1)))
{
}

TexelKernels::TexelKernels(const RadialProfile& profile, double pitch_x, double pitch_y, std::ptrdiff_t reach_y,
                           std::ptrdiff_t reach_x, std::ptrdiff_t near)
{
    // As near in length along both axes where texels are not square.
    const auto blocks = [&](double pitch, std::ptrdiff_t reach) {
        const double wanted = static_cast<double>(near) * std::max(1.0, std::max(pitch_x, pitch_y) / pitch);
        return wanted < static_cast<double>(reach) ? static_cast<std::ptrdiff_t>(std::ceil(wanted)) : reach;
    };
    const std::ptrdiff_t near_y = blocks(pitch_y, reach_y);
    const std::ptrdiff_t near_x = blocks(pitch_x, reach_x);
    while (true) {
        Level level{reach_y,
                    reach_x,
                    static_cast<std::size_t>(std::min(reach_y, near_y) + 1),
                    static_cast<std::size_t>(std::min(reach_x, near_x) + 1),
                    {}};
        level.integrals =
            integrate_texels(profile, {-0.5 * pitch_x, -0.5 * pitch_y, pitch_x, pitch_y, level.width, level.height});
        m_levels.push_back(std::move(level));
        const bool split_y = reach_y > near_y;
        const bool split_x = reach_x > near_x;
        if (!split_y && !split_x)
            return;
        if (split_y) {
            reach_y = coarse_reach(reach_y);
            pitch_y *= factor;
        }
        if (split_x) {
            reach_x = coarse_reach(reach_x);
            pitch_x *= factor;
        }
    }
}

KernelTable TexelKernels::table(const HarmonicSum& harmonics) const
{
    KernelTable coarse;
    for (std::size_t i = m_levels.size(); i-- > 0;) {
        KernelTable table(m_levels[i].reach_y, m_levels[i].reach_x);
        if (i + 1 < m_levels.size())
            refine(coarse, table);
        integrate(m_levels[i], harmonics, table);
        coarse = std::move(table);
    }
    return coarse;
}

// Overwrites the blocks near the pole by exact integrals; the other quadrants follow by symmetry.
void TexelKernels::integrate(const Level& level, const HarmonicSum& harmonics, KernelTable& table)
{
    const std::size_t blocks = level.width * level.height;
    for (std::size_t i = 0; i < level.height; ++i) {
        const auto dy = static_cast<std::ptrdiff_t>(i);
        for (std::size_t j = 0; j < level.width; ++j) {
            // By parity of m: phi -> -phi for dy < 0, and phi -> pi - phi for dx < 0.
            std::array<double, 2> cosine{};
            std::array<double, 2> sine{};
            for (std::size_t m = 0; m < level.integrals.harmonics; ++m) {
                const std::size_t at = m * blocks + i * level.width + j;
                cosine[m % 2] += harmonics.cosine[m] * level.integrals.cosine[at];
                sine[m % 2] += harmonics.sine[m] * level.integrals.sine[at];
            }
            const auto dx = static_cast<std::ptrdiff_t>(j);
            table.row(dy)[dx] = cosine[0] + cosine[1] + sine[0] + sine[1];
            table.row(dy)[-dx] = cosine[0] - cosine[1] - sine[0] + sine[1];
            table.row(-dy)[dx] = cosine[0] + cosine[1] - sine[0] - sine[1];
            table.row(-dy)[-dx] = cosine[0] - cosine[1] + sine[0] - sine[1];
        }
    }
}

// Hands the power of blocks to their thirds, along the axes along which there are more of them.
void TexelKernels::refine(const KernelTable& coarse, KernelTable& table)
{
    KernelTable wide(coarse.reach_y(), table.reach_x());
    parallel_for(static_cast<std::size_t>(2 * coarse.reach_y() + 1), [&](std::size_t i) {
        const std::ptrdiff_t dy = static_cast<std::ptrdiff_t>(i) - coarse.reach_y();
        const double* from = coarse.row(dy);
        double* to = wide.row(dy);
        if (coarse.reach_x() == table.reach_x()) {
            std::copy_n(from - table.reach_x(), 2 * table.reach_x() + 1, to - table.reach_x());
            return;
        }
        for (std::ptrdiff_t dx = -table.reach_x(); dx <= table.reach_x(); ++dx) {
            const std::ptrdiff_t block = block_of(dx);
            const Stencil& weights = weights_of(dx, block);
            const double* b = from + block - stencil_radius;
            to[dx] = weights[0] * b[0] + weights[1] * b[1] + weights[2] * b[2] + weights[3] * b[3] + weights[4] * b[4];
        }
    });
    if (coarse.reach_y() == table.reach_y()) {
        table = std::move(wide);
        return;
    }
    parallel_for(static_cast<std::size_t>(2 * table.reach_y() + 1), [&](std::size_t i) {
        const std::ptrdiff_t dy = static_cast<std::ptrdiff_t>(i) - table.reach_y();
        const std::ptrdiff_t block = block_of(dy);
        const Stencil& weights = weights_of(dy, block);
        const std::ptrdiff_t first = -table.reach_x();
        const double* b0 = wide.row(block - 2) + first;
        const double* b1 = wide.row(block - 1) + first;
        const double* b2 = wide.row(block) + first;
        const double* b3 = wide.row(block + 1) + first;
        const double* b4 = wide.row(block + 2) + first;
        double* to = table.row(dy) + first;
        for (std::ptrdiff_t k = 0; k <= 2 * table.reach_x(); ++k)
            to[k] =
                weights[0] * b0[k] + weights[1] * b1[k] + weights[2] * b2[k] + weights[3] * b3[k] + weights[4] * b4[k];
    });
}

}  // namespace beamspread
