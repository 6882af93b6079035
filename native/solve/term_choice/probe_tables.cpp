#include "solve/term_choice/probe_tables.h"

#include "base/threads.h"
#include "ldf/radial/texel_integral.h"

namespace beamspread {

namespace {

constexpr std::size_t cells_along = cell_reach + 1;  // of a quadrant

double cell_side(std::size_t size)
{
    return std::pow(3.0, static_cast<double>(size));
}

}  // namespace

ProbeTables::ProbeTables(const LowRankBasis& basis, const Plane& plane)
    : m_media(basis.profiles.size()),
      m_ranks(basis.profiles.front().size()),
      m_pitch_x(plane.pitch_x),
      m_pitch_y(plane.pitch_y),
      m_first(static_cast<float>(basis.first)),
      m_per_step(basis.last > basis.first ? static_cast<float>(angle_steps / (basis.last - basis.first)) : 0.0f)
{
    std::vector<std::size_t> harmonics(m_ranks, 0);
    for (const LowRankBasis::AngleFunction& function : basis.functions)
        harmonics[function.rank] = std::max(harmonics[function.rank], function.m + 1);
    for (const std::size_t count : harmonics) {
        m_starts.push_back(m_row_size);
        for (std::size_t m = 0; m < count; m += harmonics_per_block) {
            m_columns.push_back(m);
            m_row_size += harmonics_per_block;
            m_harmonics = std::max(m_harmonics, m + harmonics_per_block);
        }
    }
    m_starts.push_back(m_row_size);
    for (const LowRankBasis::AngleFunction& function : basis.functions)
        m_places.push_back(m_starts[function.rank] + function.m);
    for (const std::vector<ScaledProfile>& profiles : basis.profiles)
        m_reach = std::max(m_reach, profiles.front().reach);
    const auto longest = static_cast<double>(std::max(plane.width, plane.height));
    while ((cell_reach + 0.5) * cell_side(m_sizes - 1) < longest)
        ++m_sizes;
    tabulate_angles(basis);
    integrate(basis, plane);
}

void ProbeTables::tabulate_angles(const LowRankBasis& basis)
{
    m_by_angle.resize(angle_steps * m_row_size);
    for (std::size_t step = 0; step < angle_steps; ++step)
        for (std::size_t f = 0; f < m_places.size(); ++f) {
            const std::vector<TableStep>& values = basis.functions[f].values;
            m_by_angle[step * m_row_size + m_places[f]] =
                values[(2 * step + 1) * (values.size() - 1) / (2 * angle_steps)].value;
        }
}

void ProbeTables::integrate(const LowRankBasis& basis, const Plane& plane)
{
    constexpr std::size_t cells = cells_along * cells_along;
    m_kernels.resize(m_sizes * cells * m_media * kernels * m_row_size);
    parallel_for(m_sizes * m_media * m_ranks, [&](std::size_t item) {
        const std::size_t size = item / (m_media * m_ranks);
        const std::size_t medium = item / m_ranks % m_media;
        const std::size_t rank = item % m_ranks;
        const ScaledProfile& scaled = basis.profiles[medium][rank];
        const double side = cell_side(size);
        const double px = side * plane.pitch_x / scaled.mean_free_path;
        const double py = side * plane.pitch_y / scaled.mean_free_path;
        const TexelIntegrals integrals =
            integrate_texels(scaled.profile, {-0.5 * px, -0.5 * py, px, py, cells_along, cells_along});
        const std::size_t harmonics = std::min(integrals.harmonics, m_starts[rank + 1] - m_starts[rank]);
        for (std::size_t cell = 0; cell < cells; ++cell) {
            float* row = m_kernels.data() + ((size * cells + cell) * m_media + medium) * kernels * m_row_size;
            row += m_starts[rank];
            const std::size_t y = cell / cells_along;
            const std::size_t x = cell % cells_along;
            const double r = std::hypot(static_cast<double>(x) * px, static_cast<double>(y) * py);
            const Harmonics density = cell > 0 ? scaled.profile.density(r) : Harmonics{};
            for (std::size_t m = 0; m < harmonics; ++m) {
                row[cosine * m_row_size + m] = static_cast<float>(integrals.cosine[m * cells + cell] / (side * side));
                row[sine * m_row_size + m] = static_cast<float>(integrals.sine[m * cells + cell] / (side * side));
                row[radial * m_row_size + m] = static_cast<float>(density[m] * px * py / (side * side));
            }
        }
    });
}

bool ProbeTables::out_of_reach(std::size_t size, std::size_t dy, std::size_t dx) const
{
    const auto nearest = [&](std::size_t cells, double pitch) {
        return std::max(static_cast<double>(cells) - 0.5, 0.0) * cell_side(size) * pitch;
    };
    const double x = nearest(dx, m_pitch_x);
    const double y = nearest(dy, m_pitch_y);
    return x * x + y * y > m_reach * m_reach;
}

}  // namespace beamspread
