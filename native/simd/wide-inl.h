// Vectors of more values than the target's. Compiled once per target, hence the toggled include guard (Highway's
// documentation, "foreach_target").
#if defined(BEAMSPREAD_SIMD_WIDE_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef BEAMSPREAD_SIMD_WIDE_INL_H
#undef BEAMSPREAD_SIMD_WIDE_INL_H
#else
#define BEAMSPREAD_SIMD_WIDE_INL_H
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>

HWY_BEFORE_NAMESPACE();
namespace beamspread {
namespace HWY_NAMESPACE {

// `count` floats, in vectors of the target's size. GCC keeps a larger vector in memory, and copies it in pieces of 16
// bytes, for which wider loads then wait.
template <std::size_t count>
struct Wide {
    static constexpr std::size_t part_bytes = std::max<std::size_t>(HWY_MAX_BYTES, 16);
    static constexpr std::size_t part_values = part_bytes / sizeof(float);
    static constexpr std::size_t part_count = count / part_values;
    static_assert(part_count * part_values == count);

    using Values = float __attribute__((vector_size(part_bytes)));

    std::array<Values, part_count> parts{};

    Wide() = default;

    [[gnu::always_inline]] Wide(float value)
    {
        each([&](std::size_t p) { parts[p] = value - Values{}; });
    }

    [[gnu::always_inline]] void load(const float* values)
    {
        each([&](std::size_t p) { std::memcpy(&parts[p], values + p * part_values, part_bytes); });
    }

    [[gnu::always_inline]] void store(float* values) const
    {
        each([&](std::size_t p) { std::memcpy(values + p * part_values, &parts[p], part_bytes); });
    }

    [[gnu::always_inline]] Wide& operator+=(const Wide& other)
    {
        each([&](std::size_t p) { parts[p] += other.parts[p]; });
        return *this;
    }

    [[gnu::always_inline]] Wide& operator-=(const Wide& other)
    {
        each([&](std::size_t p) { parts[p] -= other.parts[p]; });
        return *this;
    }

    [[gnu::always_inline]] Wide& operator*=(const Wide& other)
    {
        each([&](std::size_t p) { parts[p] *= other.parts[p]; });
        return *this;
    }

    [[gnu::always_inline]] friend Wide operator+(Wide a, const Wide& b) { return a += b; }
    [[gnu::always_inline]] friend Wide operator-(Wide a, const Wide& b) { return a -= b; }
    [[gnu::always_inline]] friend Wide operator*(Wide a, const Wide& b) { return a *= b; }

private:
    template <class Function>
    [[gnu::always_inline]] static void each(const Function& function)
    {
#pragma GCC unroll 4
        for (std::size_t p = 0; p < part_count; ++p)
            function(p);
    }
};

}  // namespace HWY_NAMESPACE
}  // namespace beamspread
HWY_AFTER_NAMESPACE();

#endif
