#include "ldf/library/library_format.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>

namespace beamspread::library_format {

namespace {

constexpr std::array<const char*, side_count> side_names = {"reflected", "transmitted"};

// FNV-1a over whole numbers instead of bytes: notices any damage to a part, be it to a single attribute.
class Hash {
public:
    void add(std::uint64_t word) { m_hash = (m_hash ^ word) * 0x100000001b3ULL; }
    void add(int value) { add(static_cast<std::uint64_t>(value)); }
    void add(double value) { add(std::bit_cast<std::uint64_t>(value)); }
    void add(const std::string& text)
    {
        for (char c : text)
            add(static_cast<std::uint64_t>(c));
        add(text.size());
    }
    void add(const std::vector<float>& values)
    {
        // Hash two values at a time. A value is finite unless all bits of its exponent are ones.
        std::size_t i = 0;
        for (; i + 1 < values.size(); i += 2)
            add(bits(values[i]) | bits(values[i + 1]) << 32);
        if (i < values.size())
            add(bits(values[i]));
        add(values.size());
    }
    bool is_finite() const { return m_finite; }
    std::string text() const { return std::to_string(m_hash); }

private:
    std::uint64_t bits(float x)
    {
        constexpr std::uint32_t exponent = 0x7f800000;
        const auto word = std::bit_cast<std::uint32_t>(x);
        m_finite = m_finite && (word & exponent) != exponent;
        return word;
    }

    std::uint64_t m_hash = 0xcbf29ce484222325ULL;
    bool m_finite = true;
};

}  // namespace

std::string part_name(std::size_t side, std::size_t angle)
{
    return std::string(side_names[side]) + "." + std::to_string(angle);
}

std::string curved_name(std::size_t i)
{
    return "curved." + std::to_string(i);
}

std::vector<float> with_columns(const std::vector<float>& values, std::size_t from_columns, std::size_t columns)
{
    const std::size_t lines = values.size() / from_columns;
    std::vector<float> result(lines * columns, 0.0F);
    for (std::size_t i = 0; i < lines; ++i)
        std::copy_n(values.begin() + static_cast<std::ptrdiff_t>(i * from_columns), std::min(from_columns, columns),
                    result.begin() + static_cast<std::ptrdiff_t>(i * columns));
    return result;
}

Checksum checksum(const ExrPart& part)
{
    Hash sum;
    sum.add(part.name);
    for (const auto& [name, value] : part.attributes) {
        if (name == "checksum")
            continue;
        sum.add(name);
        std::visit([&sum](const auto& x) { sum.add(x); }, value);
    }
    sum.add(part.pixels);
    return {sum.text(), sum.is_finite()};
}

}  // namespace beamspread::library_format
