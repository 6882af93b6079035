#include <algorithm>
#include <array>
#include <numeric>

#include "solve/term_choice/choose_terms.h"

namespace beamspread {

namespace {

// Fraction of the tolerance that errors of smooth light may use, root mean square over the plane and relative to
// `ComingLight::irradiance`. Larger: fewer terms, larger errors.
constexpr double smooth_budget = 0.05;

// Error of the radiance without a term of harmonic m, per moment: light that is even within a kernel's reach cancels in
// all harmonics but 0, and beside a border a part is left that falls as 1 / m.
double error_of(std::size_t m)
{
    return m == 0 ? 1.0 : 0.5 / static_cast<double>(m);
}

// `KernelDecomposition::function` of a term at the angles of smooth light.
std::array<double, SmoothLight::angles> function_of(const KernelDecomposition& kernels, std::size_t term)
{
    std::array<double, SmoothLight::angles> values{};
    for (std::size_t i = 0; i < values.size(); ++i)
        values[i] = kernels.function(term, SmoothLight::half_tangent(i));
    return values;
}

}  // namespace

std::vector<std::size_t> smooth_terms(const KernelDecomposition& kernels, const ComingLight& coming, double tolerance)
{
    std::vector<double> squared_error(kernels.terms().size());
    for (std::size_t t = 0; t < squared_error.size(); ++t) {
        const auto function = function_of(kernels, t);
        double sum = 0.0;
        for (const SmoothLight& light : coming.smooth)
            sum += light.squared_moment(kernels.terms()[t].m, function);
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
