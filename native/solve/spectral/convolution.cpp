#include "solve/spectral/convolution.h"

#include <algorithm>
#include <array>

#include "base/threads.h"
#include "simd/loops.h"

namespace beamspread {

namespace {

// Columns of one work item, whose pieces of rows fill cache lines. More: fewer items for threads to share.
constexpr std::size_t columns_per_item = 8;

std::size_t rounds_of(std::size_t count, std::size_t at_once)
{
    return (count + at_once - 1) / at_once;
}

HarmonicRange harmonic_range(std::span<const LightTerm> terms)
{
    HarmonicRange range{harmonic_count, 0};
    for (const LightTerm& term : terms)
        for (const std::vector<KernelTerm>& kernel : term.kernels)
            for (const KernelTerm& part : kernel)
                range = {std::min(range.first, part.m), std::max(range.end, part.m + 1)};
    return range.end == 0 ? HarmonicRange{} : range;  // empty without kernels
}

}  // namespace

Convolution::Convolution(const KernelSpectra& spectra, std::span<const LightTerm> terms, std::size_t media,
                         std::size_t budget)
    : m_spectra(spectra),
      m_plane(spectra.plane()),
      m_terms(terms),
      m_media(media),
      m_at_once(spectra_at_once(m_plane, terms.size(), media, budget))
{
    m_at_once = {std::max<std::size_t>(m_at_once.terms, 1), std::max<std::size_t>(m_at_once.media, 1)};
    for (const LightTerm& term : terms) {
        m_kernels.emplace_back();
        for (const std::vector<KernelTerm>& kernel : term.kernels)
            m_kernels.back().push_back(spectra.parts(kernel));
    }
}

void Convolution::solve(const MakeLightRow& light, const StoreRow& store, Progress& progress, double work)
{
    const std::vector<Span> across = tiles(m_plane.width, m_plane.tile_width);
    const std::vector<Span> up = tiles(m_plane.height, m_plane.tile_height);
    // Compute the progress of one round's rows and columns; the rows of the results count as one more round.
    const std::size_t rounds = rounds_of(m_media, m_at_once.media) * rounds_of(m_terms.size(), m_at_once.terms);
    const double unit = work / ((static_cast<double>(rounds) + 1.0) * static_cast<double>(across.size() * up.size()));
    for (const Span& y : up)
        for (const Span& x : across)
            solve_tile({x, y, with_halo(x, m_plane.halo_x, m_plane.width), with_halo(y, m_plane.halo_y, m_plane.height),
                        light, store, progress, unit});
}

std::vector<Convolution::Span> Convolution::tiles(std::size_t size, std::size_t tile)
{
    std::vector<Span> spans;
    for (std::size_t first = 0; first < size; first += tile)
        spans.push_back({first, std::min(tile, size - first)});
    return spans;
}

Convolution::Span Convolution::with_halo(const Span& tile, std::size_t halo, std::size_t size)
{
    const std::size_t first = tile.first - std::min(tile.first, halo);
    return {first, std::min(size, tile.first + tile.count + halo) - first};
}

void Convolution::solve_tile(const Tile& tile)
{
    const std::size_t terms = m_terms.size();
    ColumnSpectra light(m_at_once.terms, m_plane.columns(), tile.window_y.count);
    for (std::size_t first = 0; first < m_media; first += m_at_once.media) {
        const std::size_t last = std::min(m_media, first + m_at_once.media);
        ColumnSpectra results(last - first, m_plane.columns(), tile.y.count);
        for (std::size_t t = 0; t < terms; t += m_at_once.terms) {
            const std::size_t count = std::min(m_at_once.terms, terms - t);
            if (first == 0 || terms > m_at_once.terms)
                transform_light(tile, t, count, light);
            convolve_columns(tile, t, count, light, first, results);
        }
        for (std::size_t k = first; k < last; ++k)
            store_result(tile, k, results, k - first);
    }
}

// Pads the terms' light in the window and transforms it along x.
void Convolution::transform_light(const Tile& tile, std::size_t first, std::size_t count, ColumnSpectra& light)
{
    const std::size_t stride = m_plane.padded_width;
    const std::size_t columns = m_plane.columns();
    const std::size_t items = rounds_of(tile.window_y.count, lines_at_once);
    parallel_for(items, [&](std::size_t item) {
        const std::size_t y0 = item * lines_at_once;
        const std::size_t rows = std::min(lines_at_once, tile.window_y.count - y0);
        RowScratch& scratch = m_row_scratch.local();
        while (scratch.rows.size() < rows)
            scratch.rows.push_back(tile.light());
        scratch.lines.resize(lines_at_once * stride);
        scratch.half.resize(lines_at_once * columns);
        std::array<TermValues, lines_at_once> light_rows{};
        for (std::size_t y = 0; y < rows; ++y)
            light_rows[y] =
                scratch.rows[y]({tile.window_y.first + y0 + y, tile.window_x.first, tile.window_x.count}, first, count);
        for (std::size_t t = 0; t < count; ++t) {
            for (std::size_t y = 0; y < rows; ++y) {
                float* line = scratch.lines.data() + y * stride;
                std::copy_n(light_rows[y].values + t * light_rows[y].stride, tile.window_x.count, line);
                std::fill(line + tile.window_x.count, line + stride, 0.0f);
            }
            fft().real_to_half(scratch.lines.data(), scratch.half.data(), rows, stride);
            for (std::size_t x = 0; x < columns; ++x) {
                Complex* column = light.column(t, x) + y0;
                for (std::size_t y = 0; y < rows; ++y)
                    column[y] = scratch.half[y * columns + x];
            }
        }
        tile.progress.advance(0.4 * tile.work / static_cast<double>(items));
    });
}

// Transforms the light along y, multiplies it by the kernels' spectra, and transforms the sums back along y.
void Convolution::convolve_columns(const Tile& tile, std::size_t first_term, std::size_t count, ColumnSpectra& light,
                                   std::size_t first_medium, ColumnSpectra& results)
{
    const std::size_t height = m_plane.padded_height;
    const std::size_t columns = m_plane.columns();
    const std::size_t offset = tile.y.first - tile.window_y.first;
    const std::size_t items = rounds_of(columns, columns_per_item);
    const HarmonicRange harmonics = harmonic_range(m_terms.subspan(first_term, count));
    std::vector<const KernelSpectra::Part*> parts;  // of all terms, each for all media
    std::vector<std::size_t> first_part;            // [term * media + medium]
    for (std::size_t t = 0; t < count; ++t)
        for (std::size_t k = 0; k < results.count(); ++k) {
            first_part.push_back(parts.size());
            for (const KernelSpectra::Part& part : m_kernels[first_term + t][first_medium + k])
                parts.push_back(&part);
        }
    first_part.push_back(parts.size());
    parallel_for(items, [&](std::size_t item) {
        ColumnScratch& scratch = m_column_scratch.local();
        scratch.lines.resize(lines_at_once * height);
        scratch.sums.resize(2 * results.count() * height);
        scratch.kernel.resize(height);
        const std::size_t last = std::min(columns, (item + 1) * columns_per_item);
        m_spectra.start(item * columns_per_item, last - item * columns_per_item, parts, scratch.centres);
        for (std::size_t x = item * columns_per_item; x < last; ++x) {
            std::fill(scratch.sums.begin(), scratch.sums.end(), Complex());
            m_spectra.start(x, harmonics, scratch.column);
            for (std::size_t first = 0; first < count; first += lines_at_once) {
                const std::size_t batch = std::min(lines_at_once, count - first);
                for (std::size_t t = 0; t < batch; ++t) {
                    Complex* line = scratch.lines.data() + t * height;
                    std::copy_n(light.column(first + t, x), tile.window_y.count, line);
                    std::fill(line + tile.window_y.count, line + height, Complex());
                }
                fft().complex_in_place(scratch.lines.data(), batch, height, true);
                const std::size_t begin = first_part[first * results.count()];
                const std::size_t end = first_part[(first + batch) * results.count()];
                m_spectra.select(x - item * columns_per_item, begin, end - begin, scratch.centres);
                for (std::size_t t = 0; t < batch; ++t)
                    for (std::size_t k = 0; k < results.count(); ++k) {
                        const std::size_t pair = (first + t) * results.count() + k;
                        for (std::size_t i = first_part[pair]; i < first_part[pair + 1]; ++i) {
                            m_spectra.spectrum(scratch.column, scratch.centres, i, *parts[i], scratch.kernel.data());
                            add_product(scratch.sums.data() + (2 * k + (parts[i]->odd_m() ? 1 : 0)) * height,
                                        scratch.kernel.data(), scratch.lines.data() + t * height, height);
                        }
                    }
            }
            for (std::size_t k = 0; k < results.count(); ++k) {
                Complex* even = scratch.sums.data() + 2 * k * height;
                const Complex* odd = even + height;
                for (std::size_t f = 0; f < height; ++f)  // add -i times the odd sums
                    even[f] += Complex(odd[f].imag(), -odd[f].real());
                fft().complex_in_place(even, 1, height, false);
                Complex* result = results.column(k, x);
                for (std::size_t y = 0; y < tile.y.count; ++y)
                    result[y] = (first_term > 0 ? result[y] : Complex()) + even[offset + y];
            }
        }
        tile.progress.advance(0.6 * tile.work / static_cast<double>(items));
    });
}

// Transforms a tile's result back along x.
void Convolution::store_result(const Tile& tile, std::size_t medium, ColumnSpectra& results, std::size_t plane)
{
    const std::size_t stride = m_plane.padded_width;
    const std::size_t columns = m_plane.columns();
    const std::size_t offset = tile.x.first - tile.window_x.first;
    const std::size_t items = rounds_of(tile.y.count, lines_at_once);
    const double factor = 1.0 / (static_cast<double>(stride) * static_cast<double>(m_plane.padded_height));
    parallel_for(items, [&](std::size_t item) {
        const std::size_t y0 = item * lines_at_once;
        const std::size_t rows = std::min(lines_at_once, tile.y.count - y0);
        RowScratch& scratch = m_row_scratch.local();
        scratch.lines.resize(lines_at_once * stride);
        scratch.half.resize(lines_at_once * columns);
        for (std::size_t x = 0; x < columns; ++x) {
            const Complex* column = results.column(plane, x) + y0;
            for (std::size_t y = 0; y < rows; ++y)
                scratch.half[y * columns + x] = column[y];
        }
        fft().half_to_real(scratch.half.data(), scratch.lines.data(), rows, stride);
        for (std::size_t y = 0; y < rows; ++y)
            tile.store(medium, {tile.y.first + y0 + y, tile.x.first, tile.x.count},
                       scratch.lines.data() + y * stride + offset, factor);
        tile.progress.advance(tile.work / static_cast<double>(m_media * items));
    });
}

}  // namespace beamspread
