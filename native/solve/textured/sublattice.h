// Planes of texels dealt to sublattices: texels whose coordinates agree modulo the number of sublattices lie side by side.
#pragma once

#include <cstddef>
#include <span>

#include "base/threads.h"
#include "base/view.h"
#include "solve/textured/path_products.h"
#include "solve/textured/shared_paths.h"

namespace beamspread {

class Sublattices {
public:
    // `side`: sublattices along each axis. `reach`: largest offset of a place, texels; farther ones count as at the same
    // distance along each axis.
    Sublattices(std::size_t width, std::size_t height, std::size_t side, std::size_t reach);

    std::size_t width() const { return m_width; }
    std::size_t height() const { return m_height; }
    std::size_t side() const { return m_side; }
    std::size_t count() const { return m_side * m_side; }
    std::size_t reach() const { return m_reach; }
    // Rows of a sublattice, and runs of `texels_per_run` texels in each.
    std::size_t rows() const { return m_rows; }
    std::size_t runs() const { return m_runs; }

    // Index in a plane of the first texel of a run of a sublattice.
    std::size_t run(std::size_t row, std::size_t number) const;

    // The index of a place, less that of the run of texels that light leaves, which are of this sublattice.
    std::ptrdiff_t offset(std::size_t sublattice, const PathPlace& place) const;
    bool is_within(const PathPlace& place) const;

    // A plane of these sublattices. Beyond the border values continue, or they are 0.
    AlignedVector<float> dealt(const View2D<const float>& values, float factor, bool goes_on) const;

    // Calls set(y, x, index in a plane without borders of this sublattice) for each texel.
    template <class Set>
    void for_texels(std::size_t sublattice, const Set& set) const
    {
        for (std::size_t row = 0; row < m_rows; ++row) {
            const std::size_t y = row * m_side + sublattice / m_side;
            for (std::size_t column = 0; y < m_height && column < m_runs * texels_per_run; ++column) {
                const std::size_t x = column * m_side + sublattice % m_side;
                if (x < m_width)
                    set(y, x, row * m_runs * texels_per_run + column);
            }
        }
    }

private:
    std::size_t m_width;
    std::size_t m_height;
    std::size_t m_side;  // sublattices along each axis
    std::size_t m_rows;
    std::size_t m_runs;
    std::size_t m_border;  // around each sublattice, its texels
    std::size_t m_reach;
};

}  // namespace beamspread
