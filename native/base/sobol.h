// Scrambled Sobol points for the cells of a grid.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/vec.h"

namespace beamspread {

// The first four dimensions of Sobol's sequence, with the direction numbers of Joe and Kuo 2008 ("Constructing Sobol
// sequences with better two-dimensional projections", doi:10.1137/070709359) and Owen scrambling by a hash (Burley
// 2020, "Practical hash-based Owen scrambling", JCGT 9(4)).
//
// Each cell of the grid has one block of the sequence. Blocks follow a Morton curve with shuffled quarters (Ahmed,
// Wonka 2020, "Screen-space blue-noise diffusion of Monte Carlo sampling error via hierarchical ordering of pixels",
// doi:10.1145/3414685.3417881). The points of a cell are well spread, and so are the points of a neighbourhood of
// cells: errors average out between neighbours.
class GridSobol {
public:
    static constexpr std::size_t dimensions = 4;

    GridSobol(std::size_t points_per_cell, std::uint32_t seed);

    // Writes points [first, first + count) of a cell: coordinates 0 and 1 to `front`, 2 and 3 to `back`, all in (0, 1).
    void points(std::size_t x, std::size_t y, std::size_t first, std::size_t count, Vec2* front, Vec2* back) const;

private:
    using Bits = std::array<std::uint32_t, dimensions>;  // binary fractions; the lowest bit is the first digit

    static Bits sequence(std::uint32_t index);
    std::uint32_t start(std::uint32_t shuffled) const;
    std::uint32_t shuffle(std::uint32_t cell, std::uint32_t seed) const;

    std::uint32_t m_seed;
    int m_bits;
    std::array<std::vector<std::uint32_t>, dimensions> m_offsets;  // [point] of the sequence's first block, as Bits
};

}  // namespace beamspread
