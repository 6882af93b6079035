#include "ldf/library/ldf_library.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/Dense>

#include "base/constants.h"
#include "base/error.h"

namespace beamspread {

namespace {

// Row-major, as AngleSpline stores it.
using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// Second derivatives of the cardinal splines, which are 1 at one point and 0 at the others (de Boor 2001, "A Practical
// Guide to Splines", Ch. IV): [point][spline].
Matrix cardinal_second_derivatives(const std::vector<double>& x)
{
    const auto n = static_cast<Eigen::Index>(x.size());
    Matrix a = Matrix::Zero(n, n);
    Matrix b = Matrix::Zero(n, n);
    const auto step = [&](Eigen::Index i) {
        return x[static_cast<std::size_t>(i + 1)] - x[static_cast<std::size_t>(i)];
    };
    for (Eigen::Index i = 1; i + 1 < n; ++i) {
        const double h0 = step(i - 1);
        const double h1 = step(i);
        a.row(i).segment(i - 1, 3) << h0, 2.0 * (h0 + h1), h1;
        b.row(i).segment(i - 1, 3) << 6.0 / h0, -6.0 / h0 - 6.0 / h1, 6.0 / h1;
    }
    // Not-a-knot: the third derivative is continuous at the second and the second last point.
    const auto end_condition = [&](Eigen::Index row, Eigen::Index i) {
        a.row(row).segment(i - 1, 3) << step(i), -(step(i - 1) + step(i)), step(i - 1);
    };
    end_condition(0, 1);
    end_condition(n - 1, n - 2);
    return a.partialPivLu().solve(b);
}

// Smallest distance of nodes in degrees. Closer nodes amplify noise: at this distance noise of 1e-3 is a slope of 1 per
// radian, about that of the LDFs.
constexpr double min_spacing_deg = 0.06;

}  // namespace

AngleSpline::AngleSpline(std::vector<double> nodes) : m_nodes(std::move(nodes))
{
    for (auto node = m_nodes.rbegin(); node != m_nodes.rend(); ++node)
        if (*node > 0.0)
            m_points.push_back(-*node);
    m_points.insert(m_points.end(), m_nodes.begin(), m_nodes.end());
    if (m_points.size() > 4) {
        const Matrix derivatives = cardinal_second_derivatives(m_points);
        m_second_derivative.assign(derivatives.data(), derivatives.data() + derivatives.size());
    }
}

std::vector<double> AngleSpline::weights(double x, Parity parity) const
{
    const std::size_t n = m_points.size();
    std::vector<double> point_weight(n, 0.0);
    if (n <= 4) {
        // The spline of up to four points is Lagrange's polynomial.
        for (std::size_t i = 0; i < n; ++i) {
            point_weight[i] = 1.0;
            for (std::size_t k = 0; k < n; ++k)
                if (k != i)
                    point_weight[i] *= (x - m_points[k]) / (m_points[i] - m_points[k]);
        }
    } else {
        const auto above = std::upper_bound(m_points.begin() + 1, m_points.end() - 1, x);
        const auto hi = static_cast<std::size_t>(above - m_points.begin());
        const std::size_t lo = hi - 1;
        const double h = m_points[hi] - m_points[lo];
        const double a = (m_points[hi] - x) / h;
        const double b = 1.0 - a;
        point_weight[lo] += a;
        point_weight[hi] += b;
        const double da = (a * a * a - a) * h * h / 6.0;
        const double db = (b * b * b - b) * h * h / 6.0;
        for (std::size_t k = 0; k < n; ++k)
            point_weight[k] += da * m_second_derivative[lo * n + k] + db * m_second_derivative[hi * n + k];
    }

    const std::size_t count = m_nodes.size();
    std::vector<double> result(count);
    for (std::size_t j = 0; j < count; ++j) {
        const double here = point_weight[n - count + j];
        if (m_nodes[j] > 0.0) {
            const double mirrored = point_weight[count - 1 - j];
            result[j] = parity == Parity::even ? here + mirrored : here - mirrored;
        } else {
            // An odd function is zero at zero; the sample there is noise.
            result[j] = parity == Parity::even ? here : 0.0;
        }
    }
    return result;
}

AngleNodes::AngleNodes(std::vector<double> angles_deg) : m_angles_deg(std::move(angles_deg))
{
    for (std::size_t j = 1; j < count(); ++j)
        if (!(m_angles_deg[j] - m_angles_deg[j - 1] > min_spacing_deg))
            reject("angles", m_angles_deg[j], "distinct angles, more than 0.06 degrees apart");
    std::vector<double> nodes;
    for (const double angle : m_angles_deg)
        // Snap to 0 a node that is too close to its own mirror image.
        nodes.push_back(angle < 0.5 * min_spacing_deg ? 0.0 : angle * radians_per_degree);
    m_spline = AngleSpline(std::move(nodes));
}

double AngleNodes::clamped(double angle_deg) const
{
    return std::clamp(angle_deg, m_angles_deg.front(), m_angles_deg.back());
}

std::array<std::size_t, 2> AngleNodes::neighbours(double angle_deg) const
{
    std::size_t j = 0;
    while (j + 2 < count() && angle_deg >= m_angles_deg[j + 1])
        ++j;
    return {j, std::min(j + 1, count() - 1)};
}

LdfSource::AngleWeights AngleNodes::weights(double angle_deg, double factor) const
{
    const double theta = clamped(angle_deg) * radians_per_degree;
    LdfSource::AngleWeights weights{m_spline.weights(theta, AngleSpline::Parity::even),
                                    m_spline.weights(theta, AngleSpline::Parity::odd), neighbours(angle_deg)};
    for (double& w : weights.even)
        w *= factor;
    for (double& w : weights.odd)
        w *= factor;
    return weights;
}

std::vector<double> with_middles(const std::vector<double>& angles_deg)
{
    std::vector<double> all;
    for (const double angle : angles_deg) {
        if (!all.empty())
            all.push_back(0.5 * (all.back() + angle));
        all.push_back(angle);
    }
    return all;
}

}  // namespace beamspread
