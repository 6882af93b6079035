// Margin of a texture: rings of texels around the known ones, which continue these.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace beamspread {

struct Texture {
    float* values = nullptr;  // [row][column][channel]
    std::size_t height = 0;
    std::size_t width = 0;
    std::size_t channels = 0;

    std::size_t texels() const { return height * width; }
};

// Fills rings of unknown texels with the mean of the known texels of one island beside each: the island of the texel
// itself, else the lowest that is known straight beside it, else diagonally.
class Rings {
public:
    // `islands`: [texel] number of the island, below 0 for none; null: all belong to the same. Both must outlive this.
    Rings(const Texture& texture, const std::int32_t* islands);

    struct Filled {
        std::vector<std::size_t> texels;
        std::vector<float> before;  // [texel][channel]
    };

    // Fills `count` rings around the texels whose `known` is 1, not 0, and lists the filled texels; null: does not.
    void add(const std::uint8_t* known, std::size_t count, Filled* all = nullptr);

private:
    // A texel's number among all with a frame of unknown texels, which makes checks at borders unnecessary.
    using Framed = std::size_t;

    std::size_t texel(Framed framed) const { return (framed / m_stride - 1) * m_texture.width + framed % m_stride - 1; }
    void start(const std::uint8_t* known);
    std::vector<Framed> first_ring() const;
    std::vector<Framed> beside(const std::vector<Framed>& ring);
    std::int32_t island_to_continue(Framed framed) const;
    bool add_up(Framed framed, std::int32_t island, float* mean) const;

    Texture m_texture;
    const std::int32_t* m_islands;
    std::size_t m_stride;  // of rows with their frame
    std::array<std::ptrdiff_t, 8> m_neighbors;  // differences of framed numbers, row by row
    std::array<std::ptrdiff_t, 8> m_texels;     // the same of texels
    std::vector<std::uint8_t> m_states;         // [framed]
    std::vector<std::int32_t> m_continued;      // [framed] island; empty if all belong to the same
};

// Fills `margin` rings around the texels with a coverage above 0, which stay as they are. Texels with a coverage up to
// `whole` hold the light of a part alone: rings continue those with more, if there are any within `border` texels.
void extend_margin(const Texture& texture, const float* coverage, const std::int32_t* islands, std::size_t margin,
                   float whole, std::size_t border);

}  // namespace beamspread
