#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/constants.h"
#include "solve/term_choice/choose_terms.h"

namespace beamspread {

namespace {

// Fraction of the tolerance that errors of smooth light may use, root mean square over the plane and relative to the mean
// of all light. Larger: fewer terms, larger errors.
constexpr double smooth_budget = 0.05;

// Error of the radiance without a term of harmonic m, per moment: light that is even within a kernel's reach cancels in
// all harmonics but 0, and beside a border a part is left that falls as 1 / m.
double error_of(std::size_t m)
{
    return m == 0 ? 1.0 : 0.5 / static_cast<double>(m);
}

// Mean square over the plane of the moments of both phases, (W/m^2)^2.
double squared_moments(const KernelDecomposition& kernels, std::size_t term, const SmoothLight& light)
{
    const std::size_t count = light.travel.size();
    const auto m = static_cast<double>(kernels.terms()[term].m);
    std::vector<double> size;
    std::vector<double> angle;
    for (const Vec3f& travel : light.travel) {
        const Vec3 direction(travel);
        size.push_back(kernels.function(term, std::tan(0.5 * incidence_deg(direction) * radians_per_degree)));
        angle.push_back(m * azimuth(direction));
    }
    double sum = 0.0;
    for (std::size_t i = 0; i < count; ++i)
        for (std::size_t j = 0; j < count; ++j)
            sum += light.products[i * count + j] * size[i] * size[j] * std::cos(angle[i] - angle[j]);
    return std::max(sum, 0.0);
}

}  // namespace

std::vector<std::size_t> smooth_terms(const KernelDecomposition& kernels, const ComingLight& coming, double tolerance)
{
    std::vector<double> squared_error(kernels.terms().size());
    for (std::size_t t = 0; t < squared_error.size(); ++t) {
        double sum = 0.0;
        for (const SmoothLight& light : coming.smooth)
            sum += squared_moments(kernels, t, light);
        const double factor = error_of(kernels.terms()[t].m);
        squared_error[t] = sum * factor * factor;
    }
    std::vector<std::size_t> order(squared_error.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    // Harmonics above 0 take two transforms.
    const auto worth = [&](std::size_t t) { return squared_error[t] * (kernels.terms()[t].m == 0 ? 2.0 : 1.0); };
    std::ranges::stable_sort(order, {}, worth);
    const double allowed = smooth_budget * tolerance * coming.irradiance;
    double error = 0.0;
    const auto needed = std::ranges::find_if(order, [&](std::size_t t) {
        error += squared_error[t];
        return error > allowed * allowed;
    });
    order.erase(order.begin(), needed);
    std::ranges::sort(order);
    return order;
}

}  // namespace beamspread
