// Convolution of light terms with their kernels by FFT, with overlap-save tiles; and the coarse grid for wide kernels.
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include "base/progress.h"
#include "base/threads.h"
#include "fft/fft.h"
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

// Solves the plane of `spectra` tile by tile by overlap-save (Oppenheim, Schafer 2009, Sec. 8.7), with at most `budget`
// bytes for the spectra of the light and of the results (or one of each if that is more).
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

// Order of the splines: one more than their polynomials' degree. Larger: smaller errors, more time.
inline constexpr std::size_t spline_order = 8;

// Texels along one axis, and nodes `step` texels apart. Cardinal B-splines (Schoenberg 1973,
// doi:10.1137/1.9781611970555) around the nodes take values from texels to nodes and back. The first node lies
// spline_order / 2 - 1 steps before the first texel. A detail of wave number k gets aliases of relative size
//   (k / (2 pi / step - k))^spline_order.
class SplineAxis {
public:
    SplineAxis(std::size_t size, std::size_t step);

    std::size_t nodes() const { return m_nodes; }
    std::size_t step() const { return m_step; }

    // A texel's weights at the spline_order nodes from node texel / step().
    const float* weights(std::size_t texel) const { return m_weights.data() + texel % m_step * spline_order; }

    // Fourier transform of a spline at `turns` per step: the factor between spectra on the nodes and on the texels.
    static double response(double turns);

    // Sets the nodes to the weighted sums of all texels. `scratch` is resized as needed.
    void spread(const float* texels, float* nodes, std::vector<float>& scratch) const;

    // Adds the interpolated values of texels [first, first + count).
    void add_interpolated(const float* nodes, std::size_t first, std::size_t count, float* texels,
                          std::vector<float>& scratch) const;

private:
    std::size_t m_size;
    std::size_t m_step;
    std::size_t m_nodes;
    std::vector<float> m_weights;  // [texel % step][node]
};

// Spreads light from the texels of a plane to the nodes of a coarse grid, and interpolates luminance from them.
class CoarseGrid {
public:
    // `nodes` is the coarse grid of a plane of (height, width) texels.
    CoarseGrid(const PaddedPlane& nodes, std::size_t width, std::size_t height)
        : m_width(width), m_height(height), m_x(width, nodes.texels_x), m_y(height, nodes.texels_y)
    {
    }

    std::size_t nodes() const { return m_x.nodes() * m_y.nodes(); }

    // Light of terms [first, first + count) on the nodes, [term][node]. Advances the progress by `work`.
    std::vector<float> spread(const MakeLightRow& light, std::size_t first, std::size_t count, Progress& progress,
                              double work) const;

    struct Scratch {
        std::vector<float> nodes;
        std::vector<float> line;
    };

    // Adds the interpolated values of a row of texels.
    void add_interpolated(const std::vector<float>& nodes, const RowSpan& span, float* texels, Scratch& scratch) const;

private:
    std::size_t m_width;
    std::size_t m_height;
    SplineAxis m_x;
    SplineAxis m_y;
};

}  // namespace beamspread
