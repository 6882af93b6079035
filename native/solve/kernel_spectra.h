// Fourier transforms of kernels, without transforming kernels.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "ldf/radial_profile.h"

namespace beamspread {

enum class Phase { cosine, sine };

// Part of a kernel: `weight` times the harmonic m of a profile.
struct KernelTerm {
    std::size_t profile;
    std::size_t m;
    Phase phase;
    double weight;
};

struct ScaledProfile {
    RadialProfile profile;
    double mean_free_path = 1.0;  // metres
    double reach = 0.0;           // metres: what the profile holds farther out is left out
};

// Radius in metres outside which the profile holds no more than this fraction of its power.
double reach(const RadialProfile& profile, double mean_free_path, double fraction);

// The texels of a plane, the tiles that it is solved in, and the size that each is padded to.
struct PaddedPlane {
    std::size_t width = 0;
    std::size_t height = 0;
    double pitch_x = 1.0;  // metres
    double pitch_y = 1.0;
    std::size_t halo_x = 0;  // texels that light may spread along x: no kernel holds anything beyond
    std::size_t halo_y = 0;
    std::size_t tile_width = 0;
    std::size_t tile_height = 0;
    std::size_t padded_width = 0;  // even
    std::size_t padded_height = 0;

    // Of the half-transformed rows of a tile's light.
    std::size_t columns() const { return padded_width / 2 + 1; }
    std::size_t rows() const { return std::min(height, tile_height + 2 * halo_y); }
};

// The spectra of texel integrals of c_m(r) cos(m phi) and c_m(r) sin(m phi), on the frequencies of a padded plane.
//
// A kernel is cut in two by a smooth window a few texels wide. What is outside has no detail finer than texels: its
// spectrum is i^-m cos(m psi) H_m(k), a table of one Hankel transform in |k|, times the sinc of the texel. What is
// inside are few texels, integrated exactly (ldf/texel_integral.h) and transformed by a sum.
class KernelSpectra {
public:
    // Chooses the padding: the least where nothing that the kernels hold within reach comes back on the other side;
    // and as few tiles as keep rows() x columns() frequencies within `budget` bytes, if any do: for `terms` at once, if
    // that costs little, else for one.
    // `window_deviation`: width of the window's border, texels. The wider, the less detail beyond what texels resolve is
    // left outside, and the longer the sums.
    KernelSpectra(std::size_t width, std::size_t height, double pitch_x, double pitch_y,
                  std::vector<ScaledProfile> profiles, double window_deviation, std::size_t budget, std::size_t terms);

    const PaddedPlane& plane() const { return m_plane; }

    // What one column of frequencies needs for all kernels; use it again for the next one.
    struct Column {
        std::vector<float> trig;      // [2 m + phase][frequency]: cos, sin (m psi) times the sinc of the texel
        std::vector<float> hankel;    // [column of the table][frequency]
        std::vector<double> near_cosine;  // [column of the window]: 1, then 2 cos
        std::vector<double> near_sine;
        std::vector<float> values;  // of one frequency
        std::vector<double> k;      // of each frequency, per texel
        std::vector<float> cos_psi;
        std::vector<float> sin_psi;
        std::vector<float> cosine;  // of m psi
        std::vector<float> sine;
    };

    // For kx = 2 pi frequency / padded_width.
    void start(std::size_t frequency, Column& column) const;

    // The sum of terms that share their phase and whether m is even, for all padded_height frequencies ky; for odd m
    // divided by -i, hence real.
    void spectrum(const Column& column, const KernelTerm* terms, std::size_t count, float* values) const;

private:
    void choose_window();
    void choose_tiles(std::size_t budget, std::size_t terms);
    void tabulate_hankel();
    void integrate_near();

    PaddedPlane m_plane;
    std::vector<ScaledProfile> m_profiles;
    std::size_t m_harmonics = 0;  // that any of them uses
    double m_texel = 1.0;       // metres: the unit of length here
    double m_deviation = 1.0;
    double m_cut = 0.0;         // where the kernels end, texels
    double m_taper = 0.0;       // over which they fall to zero beyond that
    bool m_far = true;          // whether there is anything outside the window
    std::size_t m_near_x = 0;   // half-width of the window
    std::size_t m_near_y = 0;
    double m_k_step = 1.0;
    std::size_t m_table_rows = 0;
    std::size_t m_table_columns = 0;
    std::vector<std::size_t> m_column;   // [profile * harmonics + m]: place in a row of the table
    std::vector<float> m_table;          // [k][column], first row for -m_k_step
    std::vector<float> m_near;           // [profile][m][phase][y][x], quadrant
    std::vector<float> m_sinc_y;         // of each frequency
    std::vector<float> m_near_trig;      // [cos, sin][y][frequency]
};

}  // namespace beamspread
