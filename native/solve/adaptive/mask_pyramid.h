// Squares of a lit plane that one beam each can light (Manabe et al. 2012, section 3.3, Fig. 5).
#pragma once

#include <cstddef>
#include <vector>

#include "solve/problem/problem.h"

namespace beamspread {

// Texels y .. y + size - 1, x .. x + size - 1, lit by one beam of that width.
struct Square {
    std::size_t y = 0;
    std::size_t x = 0;
    std::size_t size = 1;
    double irradiance = 0.0;  // mean of its texels, W/m^2
};

// Mipmap of the least and the greatest irradiance and direction in each square of 2^level texels. Beyond the
// plane's border it is dark, so that a square across the border is never wholly lit.
class MaskPyramid {
public:
    MaskPyramid(const Plane& plane, const PlaneLight& light);

    // The largest squares, searched from the top, that are wholly lit and even: no texel's irradiance is farther
    // from the square's mean than `tolerance` times its own, and no two directions in it differ by more than
    // 1/20 of that: kernels of up to eight azimuthal harmonics then differ by less than the tolerance (with
    // 1/10 and 1/40 errors over a lamp are the same). The paper
    // takes binary masks; evenness is added for light that varies. Texels that are in no larger square are
    // squares of size one; dark ones are in none.
    std::vector<Square> squares(double tolerance) const;

private:
    struct Cell {
        float least = 0.0f;
        float greatest = 0.0f;
        double sum = 0.0;
        Vec3f least_direction{0.0f};
        Vec3f greatest_direction{0.0f};
    };
    struct Level {
        std::size_t height = 0;
        std::size_t width = 0;
        std::vector<Cell> cells;
    };

    static Cell merge(const Cell& a, const Cell& b);
    void search(std::size_t level, std::size_t y, std::size_t x, double tolerance, std::vector<Square>& found) const;

    std::size_t m_height;
    std::size_t m_width;
    std::vector<Level> m_levels;  // 0: texels
};

// The beams of the adaptive solver, which may use up a share of the tolerance.
std::vector<Square> even_squares(const Plane& plane, const PlaneLight& light, double tolerance);

}  // namespace beamspread
