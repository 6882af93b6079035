#include "solve/spectral/kernel_spectra.h"

#include <algorithm>
#include <cmath>

#include "base/constants.h"
#include "simd/loops.h"
#include "solve/spectral/convolution.h"

namespace beamspread {

namespace {

double sinc(double x)
{
    return x == 0.0 ? 1.0 : std::sin(x) / x;
}

// Transform of a texel at `turns` per node. On a coarser grid it is divided by the transform of the splines twice, for
// the light that they spread and the luminance that they interpolate, and by the texels per node.
double texel_transform(double turns, std::size_t texels_per_node)
{
    const auto step = static_cast<double>(texels_per_node);
    const double splines = texels_per_node > 1 ? SplineAxis::response(turns) : 1.0;
    return sinc(pi * turns / step) / (step * splines * splines);
}

double turns(std::size_t frequency, std::size_t size)
{
    return static_cast<double>(frequency) / static_cast<double>(size);
}

}  // namespace

KernelSpectra::KernelSpectra(const Level& level, const std::vector<ScaledProfile>& profiles,
                             const std::optional<RadialWindow>& outside_centre)
    : m_plane(level.plane)
{
    if (level.centre)
        m_centre.emplace(m_plane, *level.centre, profiles, outside_centre);
    if (level.ring)
        m_ring.emplace(profiles, *level.ring, m_plane.unit());
    for (std::size_t f = 0; f <= m_plane.padded_height / 2; ++f)
        m_texel_y.push_back(static_cast<float>(texel_transform(turns(f, m_plane.padded_height), m_plane.texels_y)));
}

void KernelSpectra::start(std::size_t frequency, const HarmonicRange& harmonics, Column& column) const
{
    if (!m_ring)
        return;
    const std::size_t frequencies = m_plane.padded_height / 2 + 1;
    column.first_m = harmonics.first;
    column.first_function = m_ring->columns_below(harmonics.first);
    const std::size_t functions = m_ring->columns_below(harmonics.end) - column.first_function;
    column.trig.resize(2 * (harmonics.end - harmonics.first) * frequencies);
    column.hankel.resize(functions * frequencies);
    // Compute the frequency kx in radians per unit of length.
    const double x_turns = turns(frequency, m_plane.padded_width);
    const double kx = 2.0 * pi * x_turns * m_plane.unit() / m_plane.pitch_x;
    const auto texel_x = static_cast<float>(texel_transform(x_turns, m_plane.texels_x));
    const bool x_nyquist = 2 * frequency == m_plane.padded_width;

    column.k.resize(frequencies);
    for (auto* part : {&column.cos_psi, &column.sin_psi, &column.cosine, &column.sine})
        part->resize(frequencies);
    for (std::size_t f = 0; f < frequencies; ++f) {
        const double ky = 2.0 * pi * turns(f, m_plane.padded_height) * m_plane.unit() / m_plane.pitch_y;
        const double k = std::sqrt(kx * kx + ky * ky);
        column.k[f] = k;
        column.cos_psi[f] = static_cast<float>(k > 0.0 ? kx / k : 1.0);
        column.sin_psi[f] = static_cast<float>(k > 0.0 ? ky / k : 0.0);
        column.cosine[f] = texel_x * m_texel_y[f];
        column.sine[f] = 0.0f;
    }
    const auto next = [&] {
        rotate(column.cosine.data(), column.sine.data(), column.cos_psi.data(), column.sin_psi.data(), frequencies);
    };
    for (std::size_t m = 0; m < harmonics.first; ++m)
        next();
    for (std::size_t m = harmonics.first; m < harmonics.end; ++m) {
        float* trig = column.trig.data() + 2 * (m - harmonics.first) * frequencies;
        std::copy(column.cosine.begin(), column.cosine.end(), trig);
        std::copy(column.sine.begin(), column.sine.end(), trig + frequencies);
        // At the Nyquist frequency, functions that are odd along its axis have no spectrum.
        if (x_nyquist)
            std::fill_n(m % 2 == 1 ? trig : trig + frequencies, frequencies, 0.0f);
        trig[2 * frequencies - 1] = 0.0f;
        next();
    }
    constexpr std::size_t at_once = 16;  // frequencies that fill a cache line of each function
    column.values.resize(at_once * functions);
    for (std::size_t first = 0; first < frequencies; first += at_once) {
        const std::size_t count = std::min(at_once, frequencies - first);
        for (std::size_t f = 0; f < count; ++f)
            m_ring->row(column.k[first + f], column.first_function, functions, column.values.data() + f * functions);
        for (std::size_t i = 0; i < functions; ++i)
            for (std::size_t f = 0; f < count; ++f)
                column.hankel[i * frequencies + first + f] = column.values[f * functions + i];
    }
}

std::vector<KernelSpectra::Part> KernelSpectra::parts(const std::vector<KernelTerm>& kernel) const
{
    std::vector<Part> parts;
    for (auto first = kernel.begin(); first != kernel.end();) {
        const auto last = std::find_if(first, kernel.end(), [&](const KernelTerm& term) {
            return term.phase != first->phase || term.m % 2 != first->m % 2;
        });
        const std::span<const KernelTerm> terms(first, last);
        parts.push_back({terms, m_centre ? m_centre->add_up(terms) : CentreSpectrum::Sum()});
        first = last;
    }
    return parts;
}

void KernelSpectra::start(std::size_t first_frequency, std::size_t count, std::span<const Part* const> parts,
                          Centres& centres) const
{
    if (!m_centre)
        return;
    centres.columns.sums.clear();
    for (const Part* part : parts)
        centres.columns.sums.push_back(&part->centre);
    m_centre->start(first_frequency, count, centres.columns);
}

void KernelSpectra::select(std::size_t column, std::size_t first, std::size_t count, Centres& centres) const
{
    centres.first = first;
    if (!m_centre)
        return;
    centres.spectra.resize(count * (m_plane.padded_height / 2 + 1));
    m_centre->spectra(centres.columns, column, first, count, centres.spectra.data());
}

void KernelSpectra::spectrum(const Column& column, const Centres& centres, std::size_t i, const Part& part,
                             float* values) const
{
    const std::size_t frequencies = m_plane.padded_height / 2 + 1;
    const bool sine = part.sine();
    if (m_centre)
        std::copy_n(centres.spectra.data() + (i - centres.first) * frequencies, frequencies, values);
    else
        std::fill_n(values, frequencies, 0.0f);
    if (m_ring)
        for (const KernelTerm& term : part.terms) {
            const std::size_t function = m_ring->column(term.profile, term.m);
            if (function == HankelTable::no_column)
                continue;
            const float* trig = column.trig.data() + (2 * (term.m - column.first_m) + (sine ? 1 : 0)) * frequencies;
            const float* hankel = column.hankel.data() + (function - column.first_function) * frequencies;
            add_scaled_product(values, trig, hankel, static_cast<float>(term.weight), frequencies);
        }
    for (std::size_t f = frequencies; f < m_plane.padded_height; ++f)
        values[f] = sine ? -values[m_plane.padded_height - f] : values[m_plane.padded_height - f];
}

}  // namespace beamspread
