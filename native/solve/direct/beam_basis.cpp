#include "solve/direct/beam_basis.h"

#include <cmath>

namespace beamspread {

BeamBasis BeamBasis::uniform(const Vec3& travel)
{
    BeamBasis basis;
    basis.m_node_count = 1;
    const double angle = incidence_deg(travel);
    basis.m_profiles = [angle](const ChannelMedium& medium) {
        return std::vector{medium.ldf->profile(angle, medium.albedo, Side::reflected)};
    };
    basis.m_weights = [](const Vec3&) { return Weights{{1.0}, {1.0}, {0, 0}}; };
    return basis;
}

BeamBasis BeamBasis::library_nodes(const LdfSource& library)
{
    BeamBasis basis;
    basis.m_node_count = library.node_count();
    basis.m_profiles = [](const ChannelMedium& medium) {
        return medium.ldf->node_profiles(medium.albedo, Side::reflected);
    };
    basis.m_weights = [&library](const Vec3& direction) { return library.angle_weights(incidence_deg(direction)); };
    return basis;
}

QuadrantRows::QuadrantRows(const RadialProfile& profile, const Plane& plane, const ChannelMedium& medium,
                           std::size_t first, std::size_t count)
    : m_first(first), m_width(plane.width), m_texels(plane.width * count)
{
    const double px = plane.pitch_x / medium.mean_free_path;
    const double py = plane.pitch_y / medium.mean_free_path;
    const double y0 = (static_cast<double>(first) - 0.5) * py;
    m_integrals = integrate_texels(profile, {-0.5 * px, y0, px, py, plane.width, count});
}

void QuadrantRows::row(std::ptrdiff_t dy, const Harmonics& cosine, const Harmonics& sine,
                       std::vector<double>& values) const
{
    values.assign(2 * m_width - 1, 0.0);
    double* right = values.data() + (m_width - 1);
    const std::size_t first = (static_cast<std::size_t>(std::abs(dy)) - m_first) * m_width;
    for (std::size_t m = 0; m < m_integrals.harmonics; ++m) {
        // phi -> -phi for dy < 0, and phi -> pi - phi for dx < 0.
        const double by_sine = dy < 0 ? -sine[m] : sine[m];
        const double mirrored = m % 2 == 0 ? 1.0 : -1.0;
        if (cosine[m] != 0.0) {
            const double* a = m_integrals.cosine.data() + m * m_texels + first;
            for (std::size_t x = 0; x < m_width; ++x)
                right[x] += cosine[m] * a[x];
            for (std::size_t x = 1; x < m_width; ++x)
                values[m_width - 1 - x] += mirrored * cosine[m] * a[x];
        }
        if (by_sine != 0.0) {
            const double* b = m_integrals.sine.data() + m * m_texels + first;
            for (std::size_t x = 0; x < m_width; ++x)
                right[x] += by_sine * b[x];
            for (std::size_t x = 1; x < m_width; ++x)
                values[m_width - 1 - x] -= mirrored * by_sine * b[x];
        }
    }
}

}  // namespace beamspread
