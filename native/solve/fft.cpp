#include "solve/fft.h"

#include <algorithm>

#include "base/threads.h"
#include "ducc0/fft/fft.h"

namespace beamspread {

namespace {
// Rows or columns of one work item: some hundred kilobytes, so that an item stays in the cache.
constexpr std::size_t lines_per_item = 32;

std::size_t item_count(std::size_t lines)
{
    return (lines + lines_per_item - 1) / lines_per_item;
}
}  // namespace

RealTransform::RealTransform(std::size_t min_height, std::size_t min_width)
    : m_height(ducc0::good_size_complex(min_height)),
      m_width(ducc0::good_size_real(min_width)),
      m_half_width(m_width / 2 + 1)
{
}

void RealTransform::transform_columns(Spectrum& spectrum, bool forward) const
{
    parallel_for(item_count(m_half_width), [&](std::size_t item) {
        const std::size_t first = item * lines_per_item;
        const std::size_t count = std::min(lines_per_item, m_half_width - first);
        const ducc0::vfmav<std::complex<double>> columns(spectrum.data() + first, {m_height, count},
                                                         {static_cast<std::ptrdiff_t>(m_half_width), 1});
        ducc0::c2c(columns, columns, {0}, forward, 1.0, 1);
    });
}

Spectrum RealTransform::forward(const std::vector<double>& values) const
{
    Spectrum spectrum(m_height * m_half_width);
    parallel_for(item_count(m_height), [&](std::size_t item) {
        const std::size_t first = item * lines_per_item;
        const std::size_t count = std::min(lines_per_item, m_height - first);
        const double* begin = values.data() + first * m_width;
        // The padding, half of the rows or more, transforms to zeros.
        if (std::all_of(begin, begin + count * m_width, [](double x) { return x == 0.0; }))
            return;
        const ducc0::cfmav<double> rows(begin, {count, m_width});
        const ducc0::vfmav<std::complex<double>> out(spectrum.data() + first * m_half_width, {count, m_half_width});
        ducc0::r2c(rows, out, 1, true, 1.0, 1);
    });
    transform_columns(spectrum, true);
    return spectrum;
}

std::vector<double> RealTransform::inverse(Spectrum& spectrum) const
{
    transform_columns(spectrum, false);
    std::vector<double> values(m_height * m_width);
    const double scale = 1.0 / (static_cast<double>(m_height) * static_cast<double>(m_width));
    parallel_for(item_count(m_height), [&](std::size_t item) {
        const std::size_t first = item * lines_per_item;
        const std::size_t count = std::min(lines_per_item, m_height - first);
        const ducc0::cfmav<std::complex<double>> rows(spectrum.data() + first * m_half_width, {count, m_half_width});
        const ducc0::vfmav<double> out(values.data() + first * m_width, {count, m_width});
        ducc0::c2r(rows, out, 1, false, scale, 1);
    });
    return values;
}

}  // namespace beamspread
