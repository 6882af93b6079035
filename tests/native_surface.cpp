// The solver `surface` for tests and measurements: part of the module _native_test.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "base/constants.h"
#include "python/media.h"
#include "solve/surface/surface_field.h"

namespace beamspread {

namespace {

// LDFs in closed form, see `density`.
class ExponentialSource final : public LdfSource {
public:
    explicit ExponentialSource(std::vector<double> curvatures) : m_curvatures(std::move(curvatures)) {}

    RadialProfile profile(double angle_deg, double albedo, Side side) const override
    {
        RadialProfile sum;
        const std::vector<RadialProfile> nodes = node_profiles(albedo, side);
        const AngleWeights weights = angle_weights(angle_deg, side);
        for (std::size_t j = 0; j < nodes.size(); ++j)
            sum.add(nodes[j], weights.even[j], weights.odd[j]);
        return sum;
    }

    std::vector<RadialProfile> node_profiles(double albedo, Side side) const override
    {
        const auto flat = std::find(m_curvatures.begin(), m_curvatures.end(), 0.0) - m_curvatures.begin();
        return curved_node_profiles(albedo, side, static_cast<std::size_t>(flat));
    }

    std::vector<double> curvatures() const override { return m_curvatures; }

    std::vector<RadialProfile> curved_node_profiles(double albedo, Side, std::size_t curvature) const override
    {
        std::vector<RadialProfile> nodes;
        for (const double angle : node_angles) {
            std::vector<double> moments(harmonics * edge_count);
            double inner = 0.0;
            for (std::size_t edge = 0; edge < edge_count; ++edge) {
                const double half = 0.5 * (radial_edge(edge) - inner);
                for (std::size_t q = 0; q < gauss_node.size(); ++q) {
                    const double r = inner + half * (1.0 + gauss_node[q]);
                    for (std::size_t m = 0; m < harmonics; ++m)
                        moments[m * edge_count + edge] += gauss_weight[q] * half * r * (m == 0 ? 2.0 * pi : pi) *
                                                          density(m, r, angle, albedo, m_curvatures[curvature]);
                }
                inner = radial_edge(edge);
            }
            nodes.emplace_back(0.0, moments, RadialDetail::all);
        }
        return nodes;
    }

    AngleWeights angle_weights(double angle_deg, Side /*side*/) const override
    {
        AngleWeights weights{std::vector<double>(node_angles.size()), {}, {}};
        const double step = node_angles[1];
        const auto before = std::min(static_cast<std::size_t>(angle_deg / step), node_angles.size() - 2);
        const double part = angle_deg / step - static_cast<double>(before);
        weights.even[before] = 1.0 - part;
        weights.even[before + 1] = part;
        weights.odd = weights.even;
        weights.neighbours = {before, before + 1};
        return weights;
    }

    void check_angle(double /*angle_deg*/) const override {}

    // c_m(r) = albedo (sin(angle) r / (1 + r))^m / (m + 1) (1 + (m + 1) curvature) exp(-r) / (2 pi), linear in between
    // the nodes of angle and curvature.
    static double density(std::size_t m, double r, double angle_deg, double albedo, double curvature)
    {
        const auto order = static_cast<double>(m);
        return albedo * std::pow(std::sin(angle_deg * radians_per_degree) * r / (1.0 + r), order) / (order + 1.0) *
               (1.0 + (order + 1.0) * curvature) * std::exp(-r) / (2.0 * pi);
    }

private:
    static constexpr std::size_t harmonics = 4;
    static constexpr std::array<double, 7> node_angles = {0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 90.0};

    std::vector<double> m_curvatures;
};

// A field with the objects that it views.
class HeldField {
public:
    HeldField(const py::array& samples, const Sources& ldf, const std::vector<double>& albedo,
              const std::vector<double>& mean_free_path, double tolerance, double max_angle, bool is_colored,
              int threads, std::size_t max_moment_bytes, bool is_direct, const std::string& side,
              const py::array& steps)
        : m_samples(samples), m_steps(steps), m_ldf(ldf)
    {
        SurfaceProblem problem;
        problem.samples = to_rows<SurfaceSample, float>("samples", samples, "contiguous float32 (N, 10)");
        if (steps.size() > 0)
            problem.steps = to_rows<SampleSteps, float>("steps", steps, "contiguous float32 (N, 6)");
        if (!problem.steps.empty() && problem.steps.size() != problem.samples.size())
            reject("steps", shape_text(steps), "a row for each sample");
        problem.channels = media_of(ldf, albedo, mean_free_path, side);
        problem.tolerance = tolerance;
        problem.max_angle_deg = max_angle;
        problem.is_colored = is_colored;
        problem.threads = threads;
        problem.max_moment_bytes = max_moment_bytes;
        problem.is_direct = is_direct;
        m_channels = problem.channels.size();
        Progress unseen;
        const py::gil_scoped_release release;
        m_field = std::make_unique<SurfaceField>(problem, unseen);
    }

    void add(const Array<float>& travel, const Array<float>& irradiance, const std::vector<double>& color,
             std::size_t first)
    {
        const auto rays = to_rows<Vec3f, float>("travel", travel, "float32 (N, 3)");
        const auto power = to_rows<Vec3f, float>("irradiance", irradiance, "float32 (N, 3)");
        if (power.size() != rays.size() || first + rays.size() > static_cast<std::size_t>(m_samples.shape(0)))
            reject("irradiance", shape_text(irradiance), "a row for each ray, one ray for each sample");
        const py::gil_scoped_release release;
        std::vector<std::uint32_t> samples(rays.size());
        std::iota(samples.begin(), samples.end(), static_cast<std::uint32_t>(first));
        m_field->add(samples, rays.data(), power.data(), color);
    }

    Array<float> solve(const py::object& progress)
    {
        Progress report(progress_callback(progress));
        Array<float> luminance({static_cast<std::size_t>(m_samples.shape(0)), m_channels});
        float* data = luminance.mutable_data();
        const py::gil_scoped_release release;
        report.set_total(1.0);
        m_field->solve(report, data);
        return luminance;
    }

    SurfaceField& field() { return *m_field; }

private:
    py::array m_samples;
    py::array m_steps;
    Sources m_ldf;
    std::size_t m_channels = 0;
    std::unique_ptr<SurfaceField> m_field;
};

}  // namespace

void bind_surface(py::module_& m)
{
    py::class_<ExponentialSource, LdfSource, std::shared_ptr<ExponentialSource>>(
        m, "ExponentialSource", "LDFs in closed form, linear in angles 15 degrees apart and in the curvature.")
        .def(py::init<std::vector<double>>(), py::arg("curvatures"));
    py::class_<HeldField>(m, "SurfaceField", "Light on samples of a surface, by the solver `surface`.")
        .def(py::init<const py::array&, const Sources&, const std::vector<double>&, const std::vector<double>&, double,
                      double, bool, int, std::size_t, bool, const std::string&, const py::array&>(),
             py::arg("samples"), py::arg("ldf"), py::arg("albedo"), py::arg("mean_free_path"),
             py::arg("tolerance") = 1e-3, py::arg("max_angle") = 88.0, py::arg("is_colored") = false,
             py::arg("threads") = 0, py::arg("max_moment_bytes") = 0, py::arg("is_direct") = false,
             py::arg("side") = "reflected", py::arg("steps") = Array<float>(0),
             "`steps`: float32 (N, 6), steps from each sample to its neighbors along columns and rows. "
             "`samples`: float32 (N, 10), position, normal, tangent and area.")
        .def("add", &HeldField::add, py::arg("travel"), py::arg("irradiance"), py::arg("color"), py::arg("first") = 0,
             "Add a ray to each of the samples from `first` on: float32 (N, 3) in their frames and channels.")
        .def(
            "clear", [](HeldField& self) { self.field().clear(); }, "Remove all rays.")
        .def("solve", &HeldField::solve, py::arg("progress") = py::none(), "Luminance, float32 (N, channels).")
        .def_property_readonly("beyond_share", [](HeldField& self) { return self.field().beyond_share(); })
        .def_property_readonly(
            "kernels", [](HeldField& self) { return reinterpret_cast<std::uintptr_t>(&self.field().basis()); },
            "Address of what it shares with fields of the same kernels, while one of them lives.")
        .def_property_readonly("mean_sources", [](HeldField& self) { return self.field().mean_sources(); })
        .def_property_readonly("moment_bytes", [](HeldField& self) { return self.field().moment_bytes(); })
        .def_property_readonly(
            "functions",
            [](HeldField& self) {
                std::vector<std::pair<std::size_t, std::size_t>> functions;
                for (const auto& function : self.field().basis().terms.basis.functions)
                    functions.emplace_back(function.m, function.rank);
                return functions;
            },
            "Harmonic and rank of each function of the angle.");
}

}  // namespace beamspread
