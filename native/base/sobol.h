// A scrambled Sobol sequence whose blocks go to the cells of a grid.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <vector>

namespace beamspread {

// The first four dimensions of Sobol's sequence, with the direction numbers of Joe and Kuo 2008 ("Constructing Sobol
// sequences with better two-dimensional projections"), scrambled after Owen by a hash (Burley 2020, "Practical
// hash-based Owen scrambling"). Every cell of the grid has a block of the sequence, and those of neighbours follow each
// other along a Morton curve whose quarters are shuffled (Ahmed, Wonka 2020, "Screen-space blue-noise diffusion of
// Monte Carlo sampling error via hierarchical ordering of pixels"): the points of a cell are well spread, and so are
// those of all cells of a neighbourhood together, so that errors average out between neighbours.
class GridSobol {
public:
    static constexpr std::size_t dimensions = 4;
    using Point = std::array<double, dimensions>;  // in (0, 1)

    GridSobol(std::size_t points_per_cell, std::uint32_t seed)
        : m_seed(seed), m_bits(std::countr_zero(std::bit_ceil(points_per_cell))), m_offsets(points_per_cell)
    {
        for (std::size_t i = 0; i < points_per_cell; ++i)
            m_offsets[i] = sequence(static_cast<std::uint32_t>(i));
    }

    // Writes points [first, first + count) of a cell.
    void points(std::size_t x, std::size_t y, std::size_t first, std::size_t count, Point* result) const
    {
        // Where the whole grid has more than 2^32 points, it is tiled by sequences with seeds of their own.
        const std::uint64_t cell = spread_bits(x) | spread_bits(y) << 1;
        const int cell_bits = 32 - m_bits;
        const std::uint32_t seed = hash(m_seed ^ hash(static_cast<std::uint32_t>(cell >> cell_bits) + 1));
        const auto within = static_cast<std::uint32_t>(cell & ((std::uint64_t{1} << cell_bits) - 1));
        const Bits block = sequence(shuffle(within, hash(seed)) << m_bits);
        std::array<std::uint32_t, dimensions> seeds;
        for (std::size_t d = 0; d < dimensions; ++d)
            seeds[d] = hash(seed + 0x9e3779b9u * static_cast<std::uint32_t>(d + 1));
        for (std::size_t i = 0; i < count; ++i) {
            for (std::size_t d = 0; d < dimensions; ++d) {
                // Sobol's points are linear over bits: those of a block are the block's first one plus the first ones.
                const std::uint32_t scrambled = scramble(block[d] ^ m_offsets[first + i][d], seeds[d]);
                result[i][d] = (scrambled + 0.5) * 0x1.0p-32;
            }
        }
    }

private:
    using Bits = std::array<std::uint32_t, dimensions>;  // the first binary digit is the highest bit

    static std::uint64_t spread_bits(std::uint64_t value)
    {
        value = (value | value << 16) & 0x0000ffff0000ffffULL;
        value = (value | value << 8) & 0x00ff00ff00ff00ffULL;
        value = (value | value << 4) & 0x0f0f0f0f0f0f0f0fULL;
        value = (value | value << 2) & 0x3333333333333333ULL;
        return (value | value << 1) & 0x5555555555555555ULL;
    }

    static std::uint32_t reverse_bits(std::uint32_t value)
    {
        value = value >> 16 | value << 16;
        value = (value & 0xff00ff00u) >> 8 | (value & 0x00ff00ffu) << 8;
        value = (value & 0xf0f0f0f0u) >> 4 | (value & 0x0f0f0f0fu) << 4;
        value = (value & 0xccccccccu) >> 2 | (value & 0x33333333u) << 2;
        return (value & 0xaaaaaaaau) >> 1 | (value & 0x55555555u) << 1;
    }

    // Wang's and Mueller's mixers, as good as random for seeds.
    static std::uint32_t hash(std::uint32_t value)
    {
        value = (value ^ value >> 16) * 0x45d9f3bu;
        value = (value ^ value >> 16) * 0x45d9f3bu;
        return value ^ value >> 16;
    }

    // Every bit is flipped or not by those below it (Laine, Karras 2011, with Burley's constants).
    static std::uint32_t flip_upwards(std::uint32_t value, std::uint32_t seed)
    {
        value ^= value * 0x3d20adeau;
        value += seed;
        value *= (seed >> 16) | 1u;
        value ^= value * 0x05526c56u;
        return value ^ value * 0x53a22864u;
    }

    static std::uint32_t scramble(std::uint32_t digits, std::uint32_t seed)
    {
        return reverse_bits(flip_upwards(reverse_bits(digits), seed));
    }

    // A permutation of all numbers of so many bits that keeps aligned blocks together.
    std::uint32_t shuffle(std::uint32_t cell, std::uint32_t seed) const
    {
        const int unused = m_bits;  // of 32
        return unused == 0 ? scramble(cell, seed) : scramble(cell << unused, seed) >> unused;
    }

    static Bits sequence(std::uint32_t index)
    {
        Bits point{};
        for (std::size_t bit = 0; index != 0; ++bit, index >>= 1) {
            if (index & 1u)
                for (std::size_t d = 0; d < dimensions; ++d)
                    point[d] ^= direction_numbers[d][bit];
        }
        return point;
    }

    static constexpr std::array<std::array<std::uint32_t, 32>, dimensions> make_direction_numbers()
    {
        // Degree, coefficients and first numbers of each dimension's polynomial; the first dimension has none.
        struct Polynomial {
            std::size_t degree;
            std::uint32_t coefficients;
            std::array<std::uint32_t, 3> first;
        };
        constexpr std::array<Polynomial, dimensions - 1> polynomials = {
            Polynomial{1, 0, {1, 0, 0}}, Polynomial{2, 1, {1, 3, 0}}, Polynomial{3, 1, {1, 3, 1}}};
        std::array<std::array<std::uint32_t, 32>, dimensions> numbers{};
        for (std::size_t bit = 0; bit < 32; ++bit)
            numbers[0][bit] = 1u << (31 - bit);
        for (std::size_t d = 1; d < dimensions; ++d) {
            const auto& [degree, coefficients, first] = polynomials[d - 1];
            auto& v = numbers[d];
            for (std::size_t bit = 0; bit < 32; ++bit) {
                if (bit < degree) {
                    v[bit] = first[bit] << (31 - bit);
                    continue;
                }
                v[bit] = v[bit - degree] ^ (v[bit - degree] >> degree);
                for (std::size_t k = 1; k < degree; ++k)
                    v[bit] ^= (coefficients >> (degree - 1 - k) & 1u) * v[bit - k];
            }
        }
        return numbers;
    }

    static const std::array<std::array<std::uint32_t, 32>, dimensions> direction_numbers;

    std::uint32_t m_seed;
    int m_bits;
    std::vector<Bits> m_offsets;
};

inline constexpr std::array<std::array<std::uint32_t, 32>, GridSobol::dimensions> GridSobol::direction_numbers =
    GridSobol::make_direction_numbers();

}  // namespace beamspread
