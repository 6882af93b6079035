#include "base/sobol.h"

#include <algorithm>
#include <bit>

#include "simd/loops.h"

namespace beamspread {

namespace {

using Numbers = std::array<std::array<std::uint32_t, 32>, GridSobol::dimensions>;

constexpr Numbers make_direction_numbers()
{
    // Primitive polynomial of a dimension after the first.
    struct Polynomial {
        std::size_t degree;
        std::uint32_t coefficients;
        std::array<std::uint32_t, 3> first;
    };
    constexpr std::array<Polynomial, GridSobol::dimensions - 1> polynomials = {
        Polynomial{1, 0, {1, 0, 0}}, Polynomial{2, 1, {1, 3, 0}}, Polynomial{3, 1, {1, 3, 1}}};
    Numbers numbers{};
    for (std::size_t bit = 0; bit < 32; ++bit)
        numbers[0][bit] = 1u << (31 - bit);
    for (std::size_t d = 1; d < GridSobol::dimensions; ++d) {
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

constexpr Numbers direction_numbers = make_direction_numbers();

// Points whose index has one byte that is not 0, with the lowest bit as the first digit: the points are linear over GF(2).
using BytePoints = std::array<std::array<std::array<std::uint32_t, GridSobol::dimensions>, 256>, 4>;

BytePoints make_byte_points() noexcept
{
    BytePoints points{};
    for (std::size_t byte = 0; byte < points.size(); ++byte)
        for (std::size_t value = 0; value < points[byte].size(); ++value)
            for (std::size_t d = 0; d < GridSobol::dimensions; ++d) {
                std::uint32_t digits = 0;
                for (std::size_t bit = 0; bit < 8; ++bit)
                    if (value >> bit & 1u)
                        digits ^= direction_numbers[d][8 * byte + bit];
                points[byte][value][d] = reverse_bits(digits);
            }
    return points;
}

const BytePoints byte_points = make_byte_points();

std::uint64_t spread_bits(std::uint64_t value)
{
    value = (value | value << 16) & 0x0000ffff0000ffffULL;
    value = (value | value << 8) & 0x00ff00ff00ff00ffULL;
    value = (value | value << 4) & 0x0f0f0f0f0f0f0f0fULL;
    value = (value | value << 2) & 0x3333333333333333ULL;
    return (value | value << 1) & 0x5555555555555555ULL;
}

// Integer hash with full avalanche, after T. Mueller.
std::uint32_t hash(std::uint32_t value)
{
    value = (value ^ value >> 16) * 0x45d9f3bu;
    value = (value ^ value >> 16) * 0x45d9f3bu;
    return value ^ value >> 16;
}

std::uint32_t scramble(std::uint32_t digits, std::uint32_t seed)
{
    return reverse_bits(flip_upwards(reverse_bits(digits), seed));
}

}  // namespace

GridSobol::GridSobol(std::size_t points_per_cell, std::uint32_t seed)
    : m_seed(seed), m_bits(std::countr_zero(std::bit_ceil(points_per_cell)))
{
    for (std::size_t i = 0; i < points_per_cell; ++i) {
        const Bits point = sequence(static_cast<std::uint32_t>(i));
        for (std::size_t d = 0; d < dimensions; ++d)
            m_offsets[d].push_back(point[d]);
    }
}

void GridSobol::points(std::size_t x, std::size_t y, std::size_t first, std::size_t count, Vec2* front,
                       Vec2* back) const
{
    // Tile grids of more than 2^32 points by sequences with different seeds.
    const std::uint64_t cell = spread_bits(x) | spread_bits(y) << 1;
    const int cell_bits = 32 - m_bits;
    const std::uint32_t seed = hash(m_seed ^ hash(static_cast<std::uint32_t>(cell >> cell_bits) + 1));
    const auto within = static_cast<std::uint32_t>(cell & ((std::uint64_t{1} << cell_bits) - 1));
    const std::uint32_t shuffled = shuffle(within, hash(seed));
    const Bits block = sequence(shuffled << m_bits | start(shuffled));
    for (std::size_t d = 0; d < dimensions; ++d) {
        // Sobol's points are linear over GF(2): a block is its first point plus (xor) the points of block 0.
        double* const into = &(d < 2 ? front : back)->x + d % 2;
        scatter_bits(into, m_offsets[d].data() + first, block[d],
                     hash(seed + 0x9e3779b9u * static_cast<std::uint32_t>(d + 1)), count);
    }
}

// The point with which a cell begins; its others follow as i xor this one, and the first 2^k of them stay evenly spread.
// Cells that take only a part of their points then take all points equally often: none is left out everywhere.
std::uint32_t GridSobol::start(std::uint32_t shuffled) const
{
    return m_bits == 0 ? 0 : hash(shuffled ^ 0x68bc21ebu) & ((1u << m_bits) - 1u);
}

// Permutes the cell numbers so that aligned blocks of 4^k cells stay together.
std::uint32_t GridSobol::shuffle(std::uint32_t cell, std::uint32_t seed) const
{
    const int unused = m_bits;  // of 32
    return unused == 0 ? scramble(cell, seed) : scramble(cell << unused, seed) >> unused;
}

GridSobol::Bits GridSobol::sequence(std::uint32_t index)
{
    Bits point{};
    for (std::size_t byte = 0; byte < byte_points.size(); ++byte)
        for (std::size_t d = 0; d < dimensions; ++d)
            point[d] ^= byte_points[byte][index >> 8 * byte & 255u][d];
    return point;
}

}  // namespace beamspread
