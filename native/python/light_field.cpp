// Python name of native/solve/light_field.h: LightField, and the rays of lights that it takes.
#include <array>
#include <memory>
#include <utility>

#include "base/error.h"
#include "base/threads.h"
#include "python/problem.h"
#include "scene/ray_gather.h"
#include "solve/light_field.h"

namespace beamspread {

namespace {

// A field and what it looks at.
class HeldField {
public:
    HeldField(const py::tuple& shape, const Lights& lights, const py::tuple& survey_shape, const Lights& survey,
              const Sources& ldf, const std::vector<double>& albedo, const std::vector<double>& mean_free_path,
              std::array<double, 2> pitch, double tolerance, int threads, std::size_t memory_limit,
              const py::object& progress)
        : m_sources(ldf)
    {
        Problem problem = problem_of(lights, ldf, albedo, mean_free_path, tolerance);
        problem.plane = plane_of(shape, pitch);
        problem.to_come.plane = plane_of(survey_shape, pitch);
        problem.to_come.plane.pitch_x *=
            static_cast<double>(problem.plane.width) / static_cast<double>(problem.to_come.plane.width);
        problem.to_come.plane.pitch_y *=
            static_cast<double>(problem.plane.height) / static_cast<double>(problem.to_come.plane.height);
        problem.threads = threads;
        problem.most_for_light = memory_limit;
        for (const HeldLight* held : lights)
            m_lights.push_back(*held);
        for (const HeldLight* held : survey)
            problem.to_come.lights.push_back(held->light);
        Progress report(progress_callback(progress));
        const py::gil_scoped_release release;
        m_field = std::make_unique<LightField>(problem, report);
    }

    void add(const HeldLight& light) { m_field->add(light.light); }

    void add_rays(const ReceiverGrid& grid, const Light& light, const std::vector<double>& color,
                  const Array<float>& coverage, const Occluders* occluders, int rays, std::uint32_t seed, int threads,
                  double clearance, int even_rays, const py::object& progress)
    {
        const Plane& plane = m_field->problem().plane;
        if (grid.width != plane.width || grid.height != plane.height)
            reject("grid", "of another size", "that of the field");
        if (coverage.ndim() != 2 || static_cast<std::size_t>(coverage.size()) != plane.texels())
            reject("coverage", "of another shape", "that of the grid");
        Progress report(progress_callback(progress));
        Sink sink(*m_field, color, light.is_colored(), coverage.data());
        const py::gil_scoped_release release;
        gather_rays(grid, light, occluders,
                    {.rays = rays, .even_rays = even_rays, .seed = seed, .clearance = clearance, .threads = threads},
                    sink, report);
    }

    Array<float> solve(const py::object& progress)
    {
        const Plane& plane = m_field->problem().plane;
        Progress report(progress_callback(progress));
        Array<float> luminance({plane.height, plane.width, m_field->problem().channels.size()});
        float* data = luminance.mutable_data();
        const py::gil_scoped_release release;
        m_field->solve(report, data);
        return luminance;
    }

    void clear() { m_field->clear(); }
    std::size_t terms() const { return m_field->terms(); }

private:
    // Hands the rays on, of the part of each texel that is covered.
    class Sink final : public RaySink {
    public:
        Sink(LightField& field, std::vector<double> color, bool is_colored, const float* coverage)
            : m_field(field), m_color(std::move(color)), m_is_colored(is_colored), m_coverage(coverage)
        {
        }

        void add(const RayRun& run) override
        {
            std::vector<Vec3f>& covered = m_scratch.local();
            covered.resize(run.count);
            for (std::size_t i = 0; i < run.count; ++i)
                covered[i] = m_coverage[run.sample + i] * run.irradiance[i];
            static_assert(sizeof(Vec3f) == 3 * sizeof(float));
            const std::size_t width = m_field.problem().plane.width;
            m_field.add({run.sample / width, run.sample % width, run.count, &run.travel->x, &covered.front().x},
                        m_color, m_is_colored);
        }

    private:
        LightField& m_field;
        std::vector<double> m_color;
        bool m_is_colored;
        const float* m_coverage;
        PerThread<std::vector<Vec3f>> m_scratch;
    };

    static Plane plane_of(const py::tuple& shape, std::array<double, 2> pitch)
    {
        return {shape[1].cast<std::size_t>(), shape[0].cast<std::size_t>(), pitch[0], pitch[1]};
    }

    Sources m_sources;
    std::vector<HeldLight> m_lights;
    std::unique_ptr<LightField> m_field;
};

}  // namespace

void bind_light_field(py::module_& m)
{
    py::class_<HeldField>(m, "LightField",
                          R"(Luminance of light that comes bit by bit, in memory that does not grow with it.

By the solver 'fft'; parameters as of `convolve`.

Parameters
----------
shape : (int, int)
    Height and width of the plane, texels.
lights : sequence of PlaneLight
    Those of one direction are part of the field. All others only stand for light to come where terms are chosen.
survey_shape : (int, int)
    Of the plane that the survey looks at, as large but of fewer texels.
survey : sequence of PlaneLight
    All light to come, on that plane: its angles and colours. Without `lights`, terms are chosen for any light of these
    angles, by the kernels alone: those are off by `tolerance`.
ldf, albedo, mean_free_path, pitch, tolerance, threads, progress
    As for `convolve`; the progress is that of the choice of terms.
memory_limit : int
    Bytes that what is kept of light to come may take, 0: any. How many they are is known once terms are chosen.

Raises
------
MemoryLimit
    They would be more.
)")
        .def(py::init<const py::tuple&, const Lights&, const py::tuple&, const Lights&, const Sources&,
                      const std::vector<double>&, const std::vector<double>&, std::array<double, 2>, double, int,
                      std::size_t, const py::object&>(),
             py::arg("shape"), py::arg("lights"), py::arg("survey_shape"), py::arg("survey"), py::arg("ldf"),
             py::arg("albedo"), py::arg("mean_free_path"), py::arg("pitch"), py::arg("tolerance"),
             py::arg("threads") = 0, py::arg("memory_limit") = 0, py::arg("progress") = py::none())
        .def("add", &HeldField::add, py::arg("light"), ReleaseGil(),
             "Adds a PlaneLight, also one of `lights` that only stood for it.")
        .def("add_rays", &HeldField::add_rays, py::arg("grid"), py::arg("light"), py::arg("color"), py::arg("coverage"),
             py::arg("occluders") = py::none(), py::arg("rays") = 16, py::arg("seed") = 0, py::arg("threads") = 0,
             py::arg("clearance") = 0.0, py::arg("even_rays") = 0, py::arg("progress") = py::none(),
             R"(Adds the rays of a light of a size, see `gather_rays`.

`color`: factor in each channel; `coverage`: float32 (H, W), part of each texel that receives light.
)")
        .def("solve", &HeldField::solve, py::arg("progress") = py::none(),
             "Luminance, float32 (H, W, C) in W/(m^2 sr).")
        .def("clear", &HeldField::clear, ReleaseGil(),
             "Forgets what was added; terms and kernels stay for the light that comes next.")
        .def_property_readonly("terms", &HeldField::terms, "int: how many transforms of light `solve` makes.");
}

}  // namespace beamspread
