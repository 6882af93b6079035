// Convolution of light terms with their kernels on the parts of a divided plane, each as if it were alone.
#pragma once

#include <cstddef>
#include <vector>

#include "base/progress.h"
#include "base/threads.h"
#include "fft/fft.h"
#include "solve/separable/light_terms.h"
#include "solve/spectral/convolution.h"
#include "solve/spectral/kernel_spectra.h"

namespace beamspread {

// Parts share the spectra of the kernels, on a grid that holds the largest part and padding. These spectra are those of
// kernels cut at the distance of two texels of a part along each axis: the padding is at most as wide as the part, and
// kernels without a taper ring no more than on one plane.
class PartConvolution {
public:
    // At most about `budget` bytes for spectra.
    PartConvolution(const LightTerms& terms, std::size_t budget);

    // Stores the rows of each part, several times if spectra of all terms exceed the budget: their sum is the result.
    // Advances the progress by at most `work`.
    void solve(const MakeLightRow& light, const StoreRow& store, Progress& progress, double work);

private:
    // Real spectrum of the harmonics of one parity of m, divided by -i for odd m.
    struct Kernel {
        std::size_t term;    // of the round
        std::size_t result;
        bool odd_m;
        std::vector<float> values;  // [kx][ky]
    };

    // Terms [first, first + count), whose spectra fit into the budget.
    struct Round {
        std::size_t first;
        std::size_t count;
        std::vector<Kernel> kernels;
    };

    struct Scratch {
        std::vector<LightRow> rows;
        std::vector<float> lines;
        std::vector<Complex> half;
        std::vector<Complex> columns;
        std::vector<Complex> sums;  // [result][even, odd m][frequency]
    };

    std::size_t columns() const { return m_width / 2 + 1; }
    std::vector<Kernel> kernels(const Round& round) const;
    std::vector<std::vector<float>> kernels_in_space(const KernelSpectra& spectra, const Round& round) const;
    void solve(const Round& round, std::size_t first_part, std::size_t count, const MakeLightRow& light,
               const StoreRow& store);

    const LightTerms& m_terms;
    const std::vector<PlanePart>& m_parts;
    std::size_t m_budget;
    Levels m_levels;
    std::size_t m_reach_x;  // texels beyond which no kernel spreads light
    std::size_t m_reach_y;
    std::size_t m_width;  // padded, even
    std::size_t m_height;
    PerThread<Scratch> m_scratch;
};

}  // namespace beamspread
