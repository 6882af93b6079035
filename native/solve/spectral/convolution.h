// Convolution of light terms with their kernels on one grid, by FFT with overlap-save tiles.
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include "base/progress.h"
#include "base/threads.h"
#include "fft/column_spectra.h"
#include "solve/separable/light_terms.h"
#include "solve/spectral/kernel_spectra.h"

namespace beamspread {

// The light of some nodes of a row, term after term, `stride` values apart.
struct TermValues {
    const float* values;
    std::size_t stride;
};

// Returns terms [first, first + count) of a row's light, which stay valid until the next call.
using LightRow = std::function<TermValues(const RowSpan& span, std::size_t first, std::size_t count)>;
using MakeLightRow = std::function<LightRow()>;

// Takes a row of a result: `values` times `factor`. May change the values. Called from several threads at once.
using StoreRow = std::function<void(std::size_t result, const RowSpan& span, float* values, double factor)>;

// Solves the plane of `spectra` tile by tile, with at most `budget` bytes for the spectra of the light and of the
// results (or one of each if that is more).
class Convolution {
public:
    Convolution(const KernelSpectra& spectra, std::span<const LightTerm> terms, std::size_t media, std::size_t budget);

    // Advances the progress by at most `work`.
    void solve(const MakeLightRow& light, const StoreRow& store, Progress& progress, double work);

private:
    // Nodes [first, first + count) along one axis.
    struct Span {
        std::size_t first;
        std::size_t count;
    };

    // Values that the steps of a tile share.
    struct Tile {
        Span x;
        Span y;
        Span window_x;  // nodes with light that reaches the tile
        Span window_y;
        const MakeLightRow& light;
        const StoreRow& store;
        Progress& progress;
        double work;  // of each round and of the results
    };

    struct RowScratch {
        std::vector<LightRow> rows;
        std::vector<float> lines;
        std::vector<Complex> half;
    };

    struct ColumnScratch {
        std::vector<Complex> lines;
        std::vector<Complex> sums;  // [medium][even, odd m][frequency]
        std::vector<float> kernel;
        KernelSpectra::Column column;
        KernelSpectra::Centres centres;
    };

    static std::vector<Span> tiles(std::size_t size, std::size_t tile);
    static Span with_halo(const Span& tile, std::size_t halo, std::size_t size);
    void solve_tile(const Tile& tile);
    void transform_light(const Tile& tile, std::size_t first, std::size_t count, ColumnSpectra& light);
    void convolve_columns(const Tile& tile, std::size_t first_term, std::size_t count, ColumnSpectra& light,
                          std::size_t first_medium, ColumnSpectra& results);
    void store_result(const Tile& tile, std::size_t medium, ColumnSpectra& results, std::size_t plane);

    const KernelSpectra& m_spectra;
    const PaddedPlane& m_plane;
    std::span<const LightTerm> m_terms;
    std::vector<std::vector<std::vector<KernelSpectra::Part>>> m_kernels;  // [term][medium]
    std::size_t m_media;
    SpectraAtOnce m_at_once;
    PerThread<RowScratch> m_row_scratch;
    PerThread<ColumnScratch> m_column_scratch;
};

}  // namespace beamspread
