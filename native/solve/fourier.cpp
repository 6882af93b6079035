// The fft solver: the direct solver's sums as products of spectra.
#include <algorithm>
#include <cmath>

#include "base/constants.h"
#include "base/pool.h"
#include "base/threads.h"
#include "solve/column_spectrum.h"
#include "solve/light_terms.h"
#include "solve/loops.h"

namespace beamspread {

namespace {

// Rows of one work item: their pieces of columns fill cache lines.
constexpr std::size_t rows_per_item = 16;
constexpr std::size_t columns_per_item = 8;

// Light terms whose columns are in the cache at once; a multiple of what the transforms do side by side.
constexpr std::size_t terms_per_batch = 16;

// Borders of the kernels' windows, texels: errors of some 1e-6 of the brightest texel, and of some 1e-5 where a basis
// makes larger ones and sums its many kernels.
constexpr double fixed_deviation = 3.0;
constexpr double changing_deviation = 1.5;

// Channels whose light is the same but for a factor.
struct Group {
    std::vector<LightField> lights;
    std::vector<KernelMedium> media;
    struct Member {
        std::size_t channel;
        std::size_t medium;
        double factor;
    };
    std::vector<Member> members;
};

// Texels [first, first + count) along one axis.
struct Span {
    std::size_t first;
    std::size_t count;
};

class GroupSolver {
public:
    GroupSolver(const Group& group, const Problem& plane, Progress& progress, float* luminance)
        : m_group(group),
          m_progress(progress),
          m_luminance(luminance),
          m_channels(plane.channels.size()),
          m_terms(light_terms(group.lights, group.media, std::max(plane.pitch_x, plane.pitch_y), plane.tolerance)),
          m_spectra(plane.width, plane.height, plane.pitch_x, plane.pitch_y, m_terms.profiles,
                    m_terms.changing.empty() ? fixed_deviation : changing_deviation, plane.memory / 2,
                    std::min(m_terms.terms.size(), terms_per_batch / 2)),
          m_plane(m_spectra.plane()),
          m_budget(plane.memory / 2)
    {
    }

    void solve()
    {
        if (m_terms.terms.empty()) {  // nothing is lit
            for (const Group::Member& member : m_group.members)
                for (std::size_t i = 0; i < m_plane.width * m_plane.height; ++i)
                    m_luminance[i * m_channels + member.channel] = 0.0f;
            return;
        }
        const std::size_t bytes = m_plane.columns() * m_plane.rows() * sizeof(Complex);
        const std::size_t at_once = std::max<std::size_t>(m_budget / bytes, 1);
        const std::size_t media = m_group.media.size();
        const std::size_t rounds = ((media + at_once - 1) / at_once) * ((m_terms.terms.size() + at_once - 1) / at_once);
        const std::vector<Span> across = tiles(m_plane.width, m_plane.tile_width);
        const std::vector<Span> up = tiles(m_plane.height, m_plane.tile_height);
        // Rows and columns of every round, and the rows of the results.
        m_unit = 1.0 / ((static_cast<double>(rounds) + 1.0) * static_cast<double>(across.size() * up.size()));
        for (const Span& y : up) {
            for (const Span& x : across) {
                m_tile_x = x;
                m_tile_y = y;
                m_window_x = with_halo(x, m_plane.halo_x, m_plane.width);
                m_window_y = with_halo(y, m_plane.halo_y, m_plane.height);
                solve_tile(at_once);
            }
        }
    }

private:
    static std::vector<Span> tiles(std::size_t size, std::size_t tile)
    {
        std::vector<Span> spans;
        for (std::size_t first = 0; first < size; first += tile)
            spans.push_back({first, std::min(tile, size - first)});
        return spans;
    }

    // The texels whose light reaches a tile.
    static Span with_halo(const Span& tile, std::size_t halo, std::size_t size)
    {
        const std::size_t first = tile.first - std::min(tile.first, halo);
        return {first, std::min(size, tile.first + tile.count + halo) - first};
    }

    void solve_tile(std::size_t at_once)
    {
        const std::size_t media = m_group.media.size();
        const std::size_t terms = m_terms.terms.size();
        std::vector<ColumnSpectrum> light;
        for (std::size_t t = 0; t < std::min(terms, at_once); ++t)
            light.emplace_back(m_plane.columns(), m_window_y.count);
        for (std::size_t first = 0; first < media; first += at_once) {
            const std::size_t last = std::min(media, first + at_once);
            std::vector<ColumnSpectrum> results;
            for (std::size_t k = first; k < last; ++k)
                results.emplace_back(m_plane.columns(), m_tile_y.count);
            for (std::size_t t = 0; t < terms; t += at_once) {
                const std::size_t count = std::min(at_once, terms - t);
                if (first == 0 || terms > at_once)
                    transform_light(t, count, light);
                convolve_columns(t, count, light, first, results);
            }
            for (std::size_t k = first; k < last; ++k)
                store(k, results[k - first]);
        }
    }

    // The terms' light in the window, padded and transformed along x.
    void transform_light(std::size_t first, std::size_t count, std::vector<ColumnSpectrum>& light)
    {
        const std::size_t stride = m_plane.padded_width;
        const std::size_t columns = m_plane.columns();
        const std::size_t items = (m_window_y.count + rows_per_item - 1) / rows_per_item;
        parallel_for(items, [&](std::size_t item) {
            const std::size_t y0 = item * rows_per_item;
            const std::size_t rows = std::min(rows_per_item, m_window_y.count - y0);
            const auto lease = m_row_scratch.lend();
            RowScratch& scratch = *lease;
            scratch.terms.resize(rows_per_item);
            scratch.lines.resize(rows_per_item * stride);
            scratch.half.resize(rows_per_item * columns);
            for (std::size_t y = 0; y < rows; ++y)
                scratch.terms[y].start(m_terms, {m_window_y.first + y0 + y, m_window_x.first, m_window_x.count});
            for (std::size_t t = 0; t < count; ++t) {
                for (std::size_t y = 0; y < rows; ++y) {
                    float* line = scratch.lines.data() + y * stride;
                    scratch.terms[y].evaluate(m_terms, first + t, line);
                    std::fill(line + m_window_x.count, line + stride, 0.0f);
                }
                real_to_half(scratch.lines.data(), scratch.half.data(), rows, stride);
                for (std::size_t x = 0; x < columns; ++x) {
                    Complex* column = light[t].column(x) + y0;
                    for (std::size_t y = 0; y < rows; ++y)
                        column[y] = scratch.half[y * columns + x];
                }
            }
            m_progress.advance(0.4 * m_unit / static_cast<double>(items));
        });
    }

    // Transforms the light along y, multiplies it by the kernels' spectra, and transforms the sums back along y.
    void convolve_columns(std::size_t first_term, std::size_t count, std::vector<ColumnSpectrum>& light,
                          std::size_t first_medium, std::vector<ColumnSpectrum>& results)
    {
        const std::size_t height = m_plane.padded_height;
        const std::size_t columns = m_plane.columns();
        const std::size_t offset = m_tile_y.first - m_window_y.first;
        const std::size_t items = (columns + columns_per_item - 1) / columns_per_item;
        parallel_for(items, [&](std::size_t item) {
            const auto lease = m_column_scratch.lend();
            ColumnScratch& scratch = *lease;
            scratch.lines.resize(terms_per_batch * height);
            scratch.sums.resize(2 * results.size() * height);
            scratch.kernel.resize(height);
            const std::size_t last = std::min(columns, (item + 1) * columns_per_item);
            for (std::size_t x = item * columns_per_item; x < last; ++x) {
                std::fill(scratch.sums.begin(), scratch.sums.end(), Complex());
                m_spectra.start(x, scratch.column);
                for (std::size_t first = 0; first < count; first += terms_per_batch) {
                    const std::size_t batch = std::min(terms_per_batch, count - first);
                    for (std::size_t t = 0; t < batch; ++t) {
                        Complex* line = scratch.lines.data() + t * height;
                        std::copy_n(light[first + t].column(x), m_window_y.count, line);
                        std::fill(line + m_window_y.count, line + height, Complex());
                    }
                    complex_in_place(scratch.lines.data(), batch, height, true);
                    for (std::size_t t = 0; t < batch; ++t)
                        for (std::size_t k = 0; k < results.size(); ++k)
                            add_kernels(m_terms.terms[first_term + first + t].kernels[first_medium + k], scratch,
                                        scratch.lines.data() + t * height, scratch.sums.data() + 2 * k * height);
                }
                for (std::size_t k = 0; k < results.size(); ++k) {
                    Complex* even = scratch.sums.data() + 2 * k * height;
                    const Complex* odd = even + height;
                    for (std::size_t f = 0; f < height; ++f)  // -i times the odd ones
                        even[f] += Complex(odd[f].imag(), -odd[f].real());
                    complex_in_place(even, 1, height, false);
                    Complex* result = results[k].column(x);
                    for (std::size_t y = 0; y < m_tile_y.count; ++y)
                        result[y] = (first_term > 0 ? result[y] : Complex()) + even[offset + y];
                }
            }
            m_progress.advance(0.6 * m_unit / static_cast<double>(items));
        });
    }

    struct RowScratch {
        std::vector<TermRow> terms;
        std::vector<float> lines;
        std::vector<Complex> half;
    };

    struct ColumnScratch {
        std::vector<Complex> lines;
        std::vector<Complex> sums;  // [medium][even, odd m][frequency]
        std::vector<float> kernel;
        KernelSpectra::Column column;
    };

    // Adds the product of a light's spectrum and its kernel's to those of even m and to those of odd m.
    void add_kernels(const std::vector<KernelTerm>& terms, ColumnScratch& scratch, const Complex* light,
                     Complex* sums) const
    {
        const std::size_t height = m_plane.padded_height;
        for (std::size_t first = 0; first < terms.size();) {
            const std::size_t parity = terms[first].m % 2;
            std::size_t last = first + 1;
            while (last < terms.size() && terms[last].phase == terms[first].phase && terms[last].m % 2 == parity)
                ++last;
            m_spectra.spectrum(scratch.column, terms.data() + first, last - first, scratch.kernel.data());
            add_product(sums + parity * height, scratch.kernel.data(), light, height);
            first = last;
        }
    }

    // Transforms a tile's luminance back along x.
    void store(std::size_t medium, ColumnSpectrum& result)
    {
        const std::size_t stride = m_plane.padded_width;
        const std::size_t columns = m_plane.columns();
        const std::size_t offset = m_tile_x.first - m_window_x.first;
        const std::size_t items = (m_tile_y.count + rows_per_item - 1) / rows_per_item;
        const double factor = inv_pi / (static_cast<double>(stride) * static_cast<double>(m_plane.padded_height));
        parallel_for(items, [&](std::size_t item) {
            const std::size_t y0 = item * rows_per_item;
            const std::size_t rows = std::min(rows_per_item, m_tile_y.count - y0);
            const auto lease = m_row_scratch.lend();
            RowScratch& scratch = *lease;
            scratch.lines.resize(rows_per_item * stride);
            scratch.half.resize(rows_per_item * columns);
            for (std::size_t x = 0; x < columns; ++x) {
                const Complex* column = result.column(x) + y0;
                for (std::size_t y = 0; y < rows; ++y)
                    scratch.half[y * columns + x] = column[y];
            }
            half_to_real(scratch.half.data(), scratch.lines.data(), rows, stride);
            for (const Group::Member& member : m_group.members) {
                if (member.medium != medium)
                    continue;
                const auto scaled = static_cast<float>(factor * member.factor);
                for (std::size_t y = 0; y < rows; ++y) {
                    const float* line = scratch.lines.data() + y * stride + offset;
                    const std::size_t texel = (m_tile_y.first + y0 + y) * m_plane.width + m_tile_x.first;
                    float* out = m_luminance + texel * m_channels + member.channel;
                    for (std::size_t x = 0; x < m_tile_x.count; ++x)
                        out[x * m_channels] = scaled * line[x];
                }
            }
            m_progress.advance(m_unit / static_cast<double>(m_group.media.size() * items));
        });
    }

    const Group& m_group;
    Progress& m_progress;
    float* m_luminance;
    std::size_t m_channels;
    LightTerms m_terms;
    KernelSpectra m_spectra;
    const PaddedPlane& m_plane;
    std::size_t m_budget;  // bytes, for the light and for the results each
    Span m_tile_x{};
    Span m_tile_y{};
    Span m_window_x{};
    Span m_window_y{};
    Pool<RowScratch> m_row_scratch;
    Pool<ColumnScratch> m_column_scratch;
    double m_unit = 1.0;
};

// The factor between the light of two channels, if that is all they differ by; else 0.
double common_factor(const std::vector<Problem>& lights, std::size_t channel, std::size_t reference)
{
    double factor = 0.0;
    for (const Problem& light : lights) {
        const View2D<const float>& a = light.channels[channel].irradiance;
        const View2D<const float>& b = light.channels[reference].irradiance;
        if (a.data == b.data && (factor == 0.0 || factor == 1.0)) {
            factor = 1.0;
            continue;
        }
        for (std::size_t y = 0; y < a.height; ++y) {
            for (std::size_t x = 0; x < a.width; ++x) {
                const auto value = static_cast<double>(a(y, x));
                const auto other = static_cast<double>(b(y, x));
                if (factor == 0.0 && other > 0.0)
                    factor = value / other;
                // Products of single-precision numbers are off by less.
                if (std::abs(value - factor * other) > 3e-7 * value)
                    return 0.0;
            }
        }
    }
    return factor;
}

std::vector<Group> group_channels(const std::vector<Problem>& lights)
{
    std::vector<Group> groups;
    for (std::size_t c = 0; c < lights.front().channels.size(); ++c) {
        const Channel& channel = lights.front().channels[c];
        double factor = 0.0;
        Group* found = nullptr;
        for (Group& group : groups) {
            factor = common_factor(lights, c, group.members.front().channel);
            found = factor > 0.0 ? &group : nullptr;
            if (found != nullptr)
                break;
        }
        if (found == nullptr) {
            factor = 1.0;
            found = &groups.emplace_back();
            for (const Problem& light : lights)
                found->lights.push_back({light.channels[c].irradiance, light.directions});
        }
        const KernelMedium medium{channel.library, channel.albedo, channel.mean_free_path};
        const auto known = std::find(found->media.begin(), found->media.end(), medium);
        found->members.push_back({c, static_cast<std::size_t>(known - found->media.begin()), factor});
        if (known == found->media.end())
            found->media.push_back(medium);
    }
    return groups;
}

}  // namespace

void solve_fft(const std::vector<Problem>& lights, Progress& progress, float* luminance)
{
    for (const Problem& light : lights)
        validate(light);
    with_threads(lights.front().threads, [&] {
        const std::vector<Group> groups = group_channels(lights);
        progress.set_total(static_cast<double>(groups.size()));
        for (const Group& group : groups)
            GroupSolver(group, lights.front(), progress, luminance).solve();
    });
    progress.finish();
}

}  // namespace beamspread
