// The fft solver: the direct solver's sums as products of spectra.
#include <algorithm>
#include <cmath>
#include <memory>

#include "base/constants.h"
#include "base/threads.h"
#include "solve/light_terms.h"
#include "solve/loops.h"

namespace beamspread {

namespace {

// Rows of one work item: their pieces of columns fill cache lines.
constexpr std::size_t rows_per_item = 16;
constexpr std::size_t columns_per_item = 8;

// Bytes that the spectra of light terms, and those of the media's luminance, may take at once.
constexpr std::size_t spectra_budget = std::size_t{1} << 30;

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

// A spectrum along the rows, column by column: [column][row], not cleared.
class ColumnSpectrum {
public:
    ColumnSpectrum(std::size_t columns, std::size_t rows)
        : m_rows(rows), m_data(std::make_unique_for_overwrite<Complex[]>(columns * rows))
    {
    }
    Complex* column(std::size_t i) { return m_data.get() + i * m_rows; }

private:
    std::size_t m_rows;
    std::unique_ptr<Complex[]> m_data;
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
                    m_terms.changing.empty() ? fixed_deviation : changing_deviation),
          m_plane(m_spectra.plane()),
          m_columns(m_plane.padded_width / 2 + 1)
    {
    }

    void solve()
    {
        const std::size_t bytes = m_columns * m_plane.height * sizeof(Complex);
        const std::size_t at_once = std::max<std::size_t>(spectra_budget / bytes, 1);
        const std::size_t media = m_group.media.size();
        const std::size_t terms = m_terms.terms.size();
        const std::size_t rounds = ((media + at_once - 1) / at_once) * ((terms + at_once - 1) / at_once);
        // Rows and columns of every round, and the rows of the results.
        m_unit = 1.0 / (static_cast<double>(rounds) + 1.0);
        for (std::size_t first = 0; first < media; first += at_once) {
            const std::size_t last = std::min(media, first + at_once);
            std::vector<ColumnSpectrum> results;
            for (std::size_t k = first; k < last; ++k)
                results.emplace_back(m_columns, m_plane.height);
            std::vector<ColumnSpectrum> light;
            for (std::size_t t = 0; t < std::min(terms, at_once); ++t)
                light.emplace_back(m_columns, m_plane.height);
            for (std::size_t t = 0; t < terms; t += at_once) {
                const std::size_t count = std::min(at_once, terms - t);
                transform_light(t, count, light);
                convolve_columns(t, count, light, first, results);
            }
            light.clear();
            for (std::size_t k = first; k < last; ++k)
                store(k, results[k - first], static_cast<double>(media));
        }
    }

private:
    void transform_light(std::size_t first, std::size_t count, std::vector<ColumnSpectrum>& light)
    {
        const std::size_t stride = m_plane.padded_width;
        const std::size_t items = (m_plane.height + rows_per_item - 1) / rows_per_item;
        parallel_for(items, [&](std::size_t item) {
            const std::size_t y0 = item * rows_per_item;
            const std::size_t rows = std::min(rows_per_item, m_plane.height - y0);
            std::vector<float> values(rows * count * stride, 0.0f);  // [row][term][x]
            std::vector<Complex> half(rows * m_columns);
            for (std::size_t y = 0; y < rows; ++y)
                term_rows(m_terms, first, count, y0 + y, values.data() + y * count * stride, stride);
            std::vector<float> lines(rows * stride);
            for (std::size_t t = 0; t < count; ++t) {
                for (std::size_t y = 0; y < rows; ++y)
                    std::copy_n(values.data() + (y * count + t) * stride, stride, lines.data() + y * stride);
                real_to_half(lines.data(), half.data(), rows, stride);
                for (std::size_t x = 0; x < m_columns; ++x) {
                    Complex* column = light[t].column(x) + y0;
                    for (std::size_t y = 0; y < rows; ++y)
                        column[y] = half[y * m_columns + x];
                }
            }
            m_progress.advance(0.4 * m_unit / static_cast<double>(items));
        });
    }

    void convolve_columns(std::size_t first_term, std::size_t count, std::vector<ColumnSpectrum>& light,
                          std::size_t first_medium, std::vector<ColumnSpectrum>& results)
    {
        const std::size_t height = m_plane.padded_height;
        const std::size_t items = (m_columns + columns_per_item - 1) / columns_per_item;
        parallel_for(items, [&](std::size_t item) {
            std::vector<Complex> lines(count * height);
            std::vector<Complex> sums(2 * results.size() * height);  // [medium][even, odd m][frequency]
            std::vector<float> kernel(height);
            KernelSpectra::Column column;
            const std::size_t last = std::min(m_columns, (item + 1) * columns_per_item);
            for (std::size_t x = item * columns_per_item; x < last; ++x) {
                for (std::size_t t = 0; t < count; ++t) {
                    Complex* line = lines.data() + t * height;
                    std::copy_n(light[t].column(x), m_plane.height, line);
                    std::fill(line + m_plane.height, line + height, Complex());
                }
                complex_in_place(lines.data(), count, height, true);
                std::fill(sums.begin(), sums.end(), Complex());
                m_spectra.start(x, column);
                for (std::size_t t = 0; t < count; ++t)
                    for (std::size_t k = 0; k < results.size(); ++k)
                        add_kernels(m_terms.terms[first_term + t].kernels[first_medium + k], column, kernel,
                                    lines.data() + t * height, sums.data() + 2 * k * height);
                for (std::size_t k = 0; k < results.size(); ++k) {
                    Complex* even = sums.data() + 2 * k * height;
                    const Complex* odd = even + height;
                    for (std::size_t f = 0; f < height; ++f)  // -i times the odd ones
                        even[f] += Complex(odd[f].imag(), -odd[f].real());
                    complex_in_place(even, 1, height, false);
                    Complex* result = results[k].column(x);
                    for (std::size_t y = 0; y < m_plane.height; ++y)
                        result[y] = (first_term > 0 ? result[y] : Complex()) + even[y];
                }
            }
            m_progress.advance(0.6 * m_unit / static_cast<double>(items));
        });
    }

    // Adds the product of a light's spectrum and its kernel's; `sums`: those of even m, then those of odd m.
    void add_kernels(const std::vector<KernelTerm>& terms, const KernelSpectra::Column& column,
                     std::vector<float>& kernel, const Complex* light, Complex* sums) const
    {
        for (std::size_t first = 0; first < terms.size();) {
            const std::size_t parity = terms[first].m % 2;
            std::size_t last = first + 1;
            while (last < terms.size() && terms[last].phase == terms[first].phase && terms[last].m % 2 == parity)
                ++last;
            m_spectra.spectrum(column, terms.data() + first, last - first, kernel.data());
            add_product(sums + parity * kernel.size(), kernel.data(), light, kernel.size());
            first = last;
        }
    }

    void store(std::size_t medium, ColumnSpectrum& result, double media)
    {
        const std::size_t stride = m_plane.padded_width;
        const std::size_t items = (m_plane.height + rows_per_item - 1) / rows_per_item;
        const double factor =
            inv_pi / (static_cast<double>(m_plane.padded_width) * static_cast<double>(m_plane.padded_height));
        parallel_for(items, [&](std::size_t item) {
            const std::size_t y0 = item * rows_per_item;
            const std::size_t rows = std::min(rows_per_item, m_plane.height - y0);
            std::vector<Complex> half(rows * m_columns);
            std::vector<float> lines(rows * stride);
            for (std::size_t x = 0; x < m_columns; ++x) {
                const Complex* column = result.column(x) + y0;
                for (std::size_t y = 0; y < rows; ++y)
                    half[y * m_columns + x] = column[y];
            }
            half_to_real(half.data(), lines.data(), rows, stride);
            for (const Group::Member& member : m_group.members) {
                if (member.medium != medium)
                    continue;
                const auto scaled = static_cast<float>(factor * member.factor);
                for (std::size_t y = 0; y < rows; ++y)
                    for (std::size_t x = 0; x < m_plane.width; ++x)
                        m_luminance[((y0 + y) * m_plane.width + x) * m_channels + member.channel] =
                            scaled * lines[y * stride + x];
            }
            m_progress.advance(m_unit / (media * static_cast<double>(items)));
        });
    }

    const Group& m_group;
    Progress& m_progress;
    float* m_luminance;
    std::size_t m_channels;
    LightTerms m_terms;
    KernelSpectra m_spectra;
    const PaddedPlane& m_plane;
    std::size_t m_columns;
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
