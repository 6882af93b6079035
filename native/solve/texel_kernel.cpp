#include "solve/texel_kernel.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/threads.h"
#include "ldf/texel_integral.h"

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

// Blocks of factor^level texels along one axis, as many as the finer level needs.
struct Axis {
    std::ptrdiff_t reach = 0;
    double side = 0.0;  // mean free paths
    bool split = false;  // the next level's blocks are three times as large

    Axis coarser() const
    {
        if (!split)
            return *this;
        return {(reach + 1) / factor + stencil_radius, side * factor, false};
    }
};

// Offsets -> (block, third) of the coarser level.
std::ptrdiff_t block_of(std::ptrdiff_t i)
{
    return i >= 0 ? (i + 1) / factor : -((1 - i) / factor);
}

class Builder {
public:
    Builder(const RadialProfile& profile, const HarmonicSum& harmonics, std::ptrdiff_t near_y, std::ptrdiff_t near_x)
        : m_profile(profile), m_harmonics(harmonics), m_near_y(near_y), m_near_x(near_x), m_thirds(third_weights())
    {
    }

    KernelTable build(Axis y, Axis x) const
    {
        y.split = y.reach > m_near_y;
        x.split = x.reach > m_near_x;
        KernelTable table(y.reach, x.reach);
        if (y.split || x.split)
            refine(build(y.coarser(), x.coarser()), y.split, x.split, table);
        integrate(y, x, table);
        return table;
    }

private:
    void refine(const KernelTable& coarse, bool split_y, bool split_x, KernelTable& table) const
    {
        KernelTable wide(coarse.reach_y(), table.reach_x());  // split along x
        parallel_for(static_cast<std::size_t>(2 * coarse.reach_y() + 1), [&](std::size_t i) {
            const std::ptrdiff_t dy = static_cast<std::ptrdiff_t>(i) - coarse.reach_y();
            const double* from = coarse.row(dy);
            double* to = wide.row(dy);
            for (std::ptrdiff_t dx = -table.reach_x(); dx <= table.reach_x(); ++dx) {
                if (!split_x) {
                    to[dx] = from[dx];
                    continue;
                }
                const std::ptrdiff_t block = block_of(dx);
                const Stencil& weights = m_thirds[static_cast<std::size_t>(dx - factor * block + 1)];
                const double* b = from + block - stencil_radius;
                to[dx] =
                    weights[0] * b[0] + weights[1] * b[1] + weights[2] * b[2] + weights[3] * b[3] + weights[4] * b[4];
            }
        });
        parallel_for(static_cast<std::size_t>(2 * table.reach_y() + 1), [&](std::size_t i) {
            const std::ptrdiff_t dy = static_cast<std::ptrdiff_t>(i) - table.reach_y();
            const std::ptrdiff_t first = -table.reach_x();
            const auto count = static_cast<std::size_t>(2 * table.reach_x() + 1);
            double* to = table.row(dy) + first;
            if (!split_y) {
                std::copy_n(wide.row(dy) + first, count, to);
                return;
            }
            const std::ptrdiff_t block = block_of(dy);
            const Stencil& weights = m_thirds[static_cast<std::size_t>(dy - factor * block + 1)];
            const double* b0 = wide.row(block - 2) + first;
            const double* b1 = wide.row(block - 1) + first;
            const double* b2 = wide.row(block) + first;
            const double* b3 = wide.row(block + 1) + first;
            const double* b4 = wide.row(block + 2) + first;
            for (std::size_t k = 0; k < count; ++k)
                to[k] = weights[0] * b0[k] + weights[1] * b1[k] + weights[2] * b2[k] + weights[3] * b3[k] +
                        weights[4] * b4[k];
        });
    }

    // Overwrites the blocks near the pole by exact integrals; the other quadrants follow by symmetry.
    void integrate(const Axis& y, const Axis& x, KernelTable& table) const
    {
        const std::ptrdiff_t reach_y = std::min(y.reach, m_near_y);
        const std::ptrdiff_t reach_x = std::min(x.reach, m_near_x);
        const auto width = static_cast<std::size_t>(reach_x + 1);
        const auto height = static_cast<std::size_t>(reach_y + 1);
        const TexelIntegrals integrals =
            integrate_texels(m_profile, {-0.5 * x.side, -0.5 * y.side, x.side, y.side, width, height});
        const std::size_t blocks = width * height;
        for (std::size_t i = 0; i < height; ++i) {
            const auto dy = static_cast<std::ptrdiff_t>(i);
            for (std::size_t j = 0; j < width; ++j) {
                // By parity of m: phi -> -phi for dy < 0, and phi -> pi - phi for dx < 0.
                std::array<double, 2> cosine{};
                std::array<double, 2> sine{};
                for (std::size_t m = 0; m < harmonic_count; ++m) {
                    const std::size_t at = m * blocks + i * width + j;
                    cosine[m % 2] += m_harmonics.cosine[m] * integrals.cosine[at];
                    sine[m % 2] += m_harmonics.sine[m] * integrals.sine[at];
                }
                const auto dx = static_cast<std::ptrdiff_t>(j);
                table.row(dy)[dx] = cosine[0] + cosine[1] + sine[0] + sine[1];
                table.row(dy)[-dx] = cosine[0] - cosine[1] - sine[0] + sine[1];
                table.row(-dy)[dx] = cosine[0] + cosine[1] - sine[0] - sine[1];
                table.row(-dy)[-dx] = cosine[0] - cosine[1] + sine[0] - sine[1];
            }
        }
    }

    const RadialProfile& m_profile;
    const HarmonicSum& m_harmonics;
    std::ptrdiff_t m_near_y;
    std::ptrdiff_t m_near_x;
    std::array<Stencil, 3> m_thirds;
};

}  // namespace

KernelTable::KernelTable(std::ptrdiff_t reach_y, std::ptrdiff_t reach_x)
    : m_reach_y(reach_y), m_reach_x(reach_x), m_values(static_cast<std::size_t>((2 * reach_y + 1) * (2 * reach_x + 1)))
{
}

KernelTable texel_kernel(const RadialProfile& profile, const HarmonicSum& harmonics, double pitch_x, double pitch_y,
                         std::ptrdiff_t reach_y, std::ptrdiff_t reach_x, std::ptrdiff_t near)
{
    // As near in length along both axes where texels are not square.
    const auto texels = [&](double pitch, std::ptrdiff_t reach) {
        const double wanted = static_cast<double>(near) * std::max(1.0, std::max(pitch_x, pitch_y) / pitch);
        return wanted < static_cast<double>(reach) ? static_cast<std::ptrdiff_t>(std::ceil(wanted)) : reach;
    };
    const Builder builder(profile, harmonics, texels(pitch_y, reach_y), texels(pitch_x, reach_x));
    return builder.build({reach_y, pitch_y}, {reach_x, pitch_x});
}

}  // namespace beamspread
