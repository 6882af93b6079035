#include "python/casters.h"

namespace beamspread {

Progress::Callback progress_callback(const py::object& progress)
{
    if (!progress.is_none() && PyCallable_Check(progress.ptr()) == 0)
        reject("progress", std::string(py::repr(progress)), "a function of the finished fraction, or None");
    return [&progress](double fraction) {
        const py::gil_scoped_acquire gil;
        if (PyErr_CheckSignals() != 0)
            throw py::error_already_set();
        if (progress.is_none())
            return true;
        const py::object answer = progress(fraction);
        py::detail::make_caster<bool> boolean;
        constexpr bool convert = false;
        return !boolean.load(answer, convert) || static_cast<bool>(boolean);
    };
}

std::string shape_text(const py::array& array)
{
    return std::string(py::str(array.dtype())) + " of shape " + std::string(py::str(array.attr("shape")));
}

template <class T>
Array<T> real_array(const std::string& name, const py::object& values)
{
    const auto array = py::array::ensure(values);
    if (!array)
        reject(name, "no array", "real numbers");
    const std::string kind(1, array.dtype().kind());
    if (std::string("fiub").find(kind) == std::string::npos)
        reject(name, shape_text(array), "real numbers");
    if (py::module_::import("numpy.ma").attr("is_masked")(values).cast<bool>())
        reject(name, "an array with masked values", "real numbers, none of them masked");
    return py::array_t<T, py::array::c_style | py::array::forcecast>::ensure(array);
}

template Array<float> real_array(const std::string&, const py::object&);
template Array<double> real_array(const std::string&, const py::object&);

Side side_from_name(const std::string& name)
{
    return named<Side>("side", name, {{"reflected", Side::reflected}, {"transmitted", Side::transmitted}});
}

std::size_t image_side(std::ptrdiff_t size)
{
    if (size < 1)
        reject("size", static_cast<double>(size), "1 <= size <= 16384 texels");
    return static_cast<std::size_t>(size);
}

}  // namespace beamspread
