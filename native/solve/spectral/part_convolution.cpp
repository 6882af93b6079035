#include "solve/spectral/part_convolution.h"

#include <algorithm>
#include <array>

#include "simd/loops.h"

namespace beamspread {

namespace {

// Columns of one work item, whose pieces of rows fill cache lines. More: fewer items for threads to share.
constexpr std::size_t columns_per_item = 8;

// Fraction of the work of a round that its kernels take.
constexpr double kernel_share = 0.2;

std::size_t items_of(std::size_t count, std::size_t each)
{
    return (count + each - 1) / each;
}

Levels levels_of_largest(const LightTerms& terms)
{
    Plane largest{.pitch_x = terms.plane.pitch_x, .pitch_y = terms.plane.pitch_y, .extent = terms.plane.extent};
    for (const PlanePart& part : terms.plane.parts) {
        largest.width = std::max(largest.width, part.width);
        largest.height = std::max(largest.height, part.height);
    }
    return choose_levels(largest, terms.profiles, {.media = terms.sets.results.size(), .one_tile = true});
}

// Harmonics below the end, as kernels of any term may have.
HarmonicRange all_harmonics(const LightTerms& terms)
{
    HarmonicRange range;
    for (const LightTerm& term : terms.terms)
        for (const std::vector<KernelTerm>& kernel : term.kernels)
            for (const KernelTerm& part : kernel)
                range.end = std::max(range.end, part.m + 1);
    return range;
}

}  // namespace

PartConvolution::PartConvolution(const LightTerms& terms, std::size_t budget)
    : m_terms(terms), m_parts(terms.plane.parts), m_budget(budget), m_levels(levels_of_largest(terms))
{
    const PaddedPlane& plane = m_levels.texels.plane;
    m_reach_x = std::min(plane.halo_x, plane.width - 1);
    m_reach_y = std::min(plane.halo_y, plane.height - 1);
    m_width = fast_even_size(plane.width + m_reach_x);
    m_height = fast_even_size(plane.height + m_reach_y);
}

void PartConvolution::solve(const MakeLightRow& light, const StoreRow& store, Progress& progress, double work)
{
    const PaddedPlane& plane = m_levels.texels.plane;
    const std::size_t terms = m_terms.terms.size();
    const std::size_t results = m_terms.sets.results.size();
    const std::size_t kernel_bytes =
        results * (plane.columns() * (2 * m_reach_y + 1) * sizeof(Complex) + 2 * columns() * m_height * sizeof(float));
    const std::size_t at_once = std::clamp<std::size_t>(m_budget / 2 / kernel_bytes, 1, terms);
    for (std::size_t first = 0; first < terms; first += at_once) {
        Round round{first, std::min(at_once, terms - first), {}};
        const double part = work * static_cast<double>(round.count) / static_cast<double>(terms);
        round.kernels = kernels(round);
        progress.advance(kernel_share * part);
        const std::size_t part_bytes = (round.count + results) * columns() * (plane.height + 16) * sizeof(Complex);
        const std::size_t group = std::clamp<std::size_t>(m_budget / 2 / part_bytes, 1, m_parts.size());
        for (std::size_t i = 0; i < m_parts.size(); i += group) {
            const std::size_t count = std::min(group, m_parts.size() - i);
            solve(round, i, count, light, store);
            progress.advance((1.0 - kernel_share) * part * static_cast<double>(count) /
                             static_cast<double>(m_parts.size()));
        }
    }
}

// Cuts the kernels in space, and transforms them on the grid of the parts.
std::vector<PartConvolution::Kernel> PartConvolution::kernels(const Round& round) const
{
    const KernelSpectra spectra(m_levels.texels, m_terms.profiles, m_levels.outside_centre);
    const std::vector<std::vector<float>> in_space = kernels_in_space(spectra, round);
    const std::size_t results = m_terms.sets.results.size();
    std::vector<std::array<Kernel, 2>> both(in_space.size());  // of even and odd m
    parallel_for(in_space.size(), [&](std::size_t i) {
        if (in_space[i].empty())
            return;
        std::vector<Complex> half(m_height * columns());
        real_to_half_2d(fft(), in_space[i].data(), half.data(), m_height, m_width, 1);
        const LightTerm& term = m_terms.terms[round.first + i / results];
        for (const KernelTerm& part : term.kernels[i % results]) {
            const bool odd_m = part.m % 2 == 1;
            Kernel& kernel = both[i][odd_m ? 1 : 0];
            if (!kernel.values.empty())
                continue;
            kernel = {i / results, i % results, odd_m, std::vector<float>(columns() * m_height)};
            for (std::size_t y = 0; y < m_height; ++y)
                for (std::size_t x = 0; x < columns(); ++x) {
                    const Complex& value = half[y * columns() + x];
                    kernel.values[x * m_height + y] = odd_m ? -value.imag() : value.real();
                }
        }
    });
    std::vector<Kernel> all;
    for (std::array<Kernel, 2>& of_pair : both)
        for (Kernel& kernel : of_pair)
            if (!kernel.values.empty())
                all.push_back(std::move(kernel));
    return all;
}

// Kernels on the padded grid of the parts, the pole at its first texel, [term * results + result]; empty: none.
std::vector<std::vector<float>> PartConvolution::kernels_in_space(const KernelSpectra& spectra,
                                                                  const Round& round) const
{
    const PaddedPlane& plane = spectra.plane();
    const std::size_t results = m_terms.sets.results.size();
    const std::size_t rows = 2 * m_reach_y + 1;
    const std::size_t height = plane.padded_height;
    std::vector<std::vector<KernelSpectra::Part>> by_pair;
    std::vector<const KernelSpectra::Part*> parts;
    for (std::size_t t = 0; t < round.count; ++t)
        for (std::size_t k = 0; k < results; ++k)
            by_pair.push_back(spectra.parts(m_terms.terms[round.first + t].kernels[k]));
    for (const std::vector<KernelSpectra::Part>& of_pair : by_pair)
        for (const KernelSpectra::Part& part : of_pair)
            parts.push_back(&part);
    ColumnSpectra half(by_pair.size(), plane.columns(), rows);
    const HarmonicRange harmonics = all_harmonics(m_terms);
    PerThread<std::pair<KernelSpectra::Column, KernelSpectra::Centres>> scratch;
    parallel_for(items_of(plane.columns(), columns_per_item), [&](std::size_t item) {
        auto& [column, centres] = scratch.local();
        const std::size_t first = item * columns_per_item;
        const std::size_t last = std::min(plane.columns(), first + columns_per_item);
        std::vector<float> values(height);
        std::vector<Complex> line(height);
        spectra.start(first, last - first, parts, centres);
        for (std::size_t x = first; x < last; ++x) {
            spectra.start(x, harmonics, column);
            std::size_t i = 0;  // part
            for (std::size_t pair = 0; pair < by_pair.size(); ++pair) {
                std::ranges::fill(line, Complex());
                spectra.select(x - first, i, by_pair[pair].size(), centres);
                for (const KernelSpectra::Part& part : by_pair[pair]) {
                    spectra.spectrum(column, centres, i++, part, values.data());
                    for (std::size_t f = 0; f < height; ++f)
                        line[f] += part.odd_m() ? Complex(0.0f, -values[f]) : Complex(values[f], 0.0f);
                }
                fft().complex_in_place(line.data(), 1, height, false);
                for (std::size_t y = 0; y < rows; ++y)  // from -m_reach_y on
                    half.column(pair, x)[y] = line[(y + height - m_reach_y) % height];
            }
        }
    });
    const float factor = 1.0f / (static_cast<float>(plane.padded_width) * static_cast<float>(height));
    std::vector<std::vector<float>> all(by_pair.size());
    parallel_for(by_pair.size(), [&](std::size_t pair) {
        if (by_pair[pair].empty())
            return;
        all[pair].resize(m_width * m_height);
        std::vector<Complex> frequencies(plane.columns());
        std::vector<float> line(plane.padded_width);
        for (std::size_t y = 0; y < rows; ++y) {
            for (std::size_t x = 0; x < plane.columns(); ++x)
                frequencies[x] = half.column(pair, x)[y];
            fft().half_to_real(frequencies.data(), line.data(), 1, plane.padded_width);
            float* const row = all[pair].data() + (y + m_height - m_reach_y) % m_height * m_width;
            for (std::size_t x = 0; x <= m_reach_x; ++x)
                row[x] = factor * line[x];
            for (std::size_t x = 1; x <= m_reach_x; ++x)
                row[m_width - x] = factor * line[plane.padded_width - x];
        }
    });
    return all;
}

void PartConvolution::solve(const Round& round, std::size_t first_part, std::size_t count, const MakeLightRow& light,
                            const StoreRow& store)
{
    const std::size_t results = m_terms.sets.results.size();
    const std::size_t rows = m_levels.texels.plane.height;
    const std::size_t blocks = items_of(rows, lines_at_once);
    const double factor = 1.0 / (static_cast<double>(m_width) * static_cast<double>(m_height));
    ColumnSpectra terms(count * round.count, columns(), rows);
    ColumnSpectra sums(count * results, columns(), rows);
    std::vector<std::size_t> first_kernel(round.count + 1, 0);
    for (const Kernel& kernel : round.kernels)
        ++first_kernel[kernel.term + 1];
    for (std::size_t t = 0; t < round.count; ++t)
        first_kernel[t + 1] += first_kernel[t];

    // Calls `body(part, its number, first row, rows, scratch)` for blocks of rows of all parts.
    const auto for_rows = [&](const auto& body) {
        parallel_for(count * blocks, [&](std::size_t item) {
            const PlanePart& part = m_parts[first_part + item / blocks];
            const std::size_t y0 = item % blocks * lines_at_once;
            if (y0 >= part.height)
                return;
            Scratch& scratch = m_scratch.local();
            scratch.lines.resize(lines_at_once * m_width);
            scratch.half.resize(lines_at_once * columns());
            body(part, item / blocks, y0, std::min(lines_at_once, part.height - y0), scratch);
        });
    };
    // Transform the light along x.
    for_rows([&](const PlanePart& part, std::size_t i, std::size_t y0, std::size_t lines, Scratch& scratch) {
        while (scratch.rows.size() < lines)
            scratch.rows.push_back(light());
        std::array<TermValues, lines_at_once> light_rows{};
        for (std::size_t y = 0; y < lines; ++y)
            light_rows[y] = scratch.rows[y]({part.y + y0 + y, part.x, part.width}, round.first, round.count);
        for (std::size_t t = 0; t < round.count; ++t) {
            for (std::size_t y = 0; y < lines; ++y) {
                float* line = scratch.lines.data() + y * m_width;
                std::copy_n(light_rows[y].values + t * light_rows[y].stride, part.width, line);
                std::fill(line + part.width, line + m_width, 0.0f);
            }
            fft().real_to_half(scratch.lines.data(), scratch.half.data(), lines, m_width);
            for (std::size_t x = 0; x < columns(); ++x)
                for (std::size_t y = 0; y < lines; ++y)
                    terms.column(i * round.count + t, x)[y0 + y] = scratch.half[y * columns() + x];
        }
    });
    // Transform it along y, multiply it by the kernels' spectra, and transform the sums back along y.
    parallel_for(items_of(columns(), columns_per_item), [&](std::size_t item) {
        Scratch& scratch = m_scratch.local();
        scratch.columns.resize(lines_at_once * m_height);
        scratch.sums.resize(2 * results * m_height);
        for (std::size_t x = item * columns_per_item; x < std::min(columns(), (item + 1) * columns_per_item); ++x)
            for (std::size_t i = 0; i < count; ++i) {
                const std::size_t height = m_parts[first_part + i].height;
                std::ranges::fill(scratch.sums, Complex());
                for (std::size_t first = 0; first < round.count; first += lines_at_once) {
                    const std::size_t batch = std::min(lines_at_once, round.count - first);
                    for (std::size_t t = 0; t < batch; ++t) {
                        Complex* line = scratch.columns.data() + t * m_height;
                        std::copy_n(terms.column(i * round.count + first + t, x), height, line);
                        std::fill(line + height, line + m_height, Complex());
                    }
                    fft().complex_in_place(scratch.columns.data(), batch, m_height, true);
                    for (std::size_t k = first_kernel[first]; k < first_kernel[first + batch]; ++k) {
                        const Kernel& kernel = round.kernels[k];
                        add_product(scratch.sums.data() + (2 * kernel.result + (kernel.odd_m ? 1 : 0)) * m_height,
                                    kernel.values.data() + x * m_height,
                                    scratch.columns.data() + (kernel.term - first) * m_height, m_height);
                    }
                }
                for (std::size_t k = 0; k < results; ++k) {
                    Complex* even = scratch.sums.data() + 2 * k * m_height;
                    const Complex* odd = even + m_height;
                    for (std::size_t f = 0; f < m_height; ++f)  // add -i times the odd sums
                        even[f] += Complex(odd[f].imag(), -odd[f].real());
                    fft().complex_in_place(even, 1, m_height, false);
                    std::copy_n(even, height, sums.column(i * results + k, x));
                }
            }
    });
    // Transform the sums back along x.
    for_rows([&](const PlanePart& part, std::size_t i, std::size_t y0, std::size_t lines, Scratch& scratch) {
        for (std::size_t k = 0; k < results; ++k) {
            for (std::size_t x = 0; x < columns(); ++x)
                for (std::size_t y = 0; y < lines; ++y)
                    scratch.half[y * columns() + x] = sums.column(i * results + k, x)[y0 + y];
            fft().half_to_real(scratch.half.data(), scratch.lines.data(), lines, m_width);
            for (std::size_t y = 0; y < lines; ++y)
                store(k, {part.y + y0 + y, part.x, part.width}, scratch.lines.data() + y * m_width, factor);
        }
    });
}

}  // namespace beamspread
