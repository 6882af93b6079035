#include "python/casters.h"

#include "base/error.h"

namespace beamspread {

Progress::Callback progress_callback(const py::object& progress)
{
    return [&progress](double fraction) {
        const py::gil_scoped_acquire gil;
        if (PyErr_CheckSignals() != 0)
            throw py::error_already_set();
        if (progress.is_none())
            return true;
        const py::object answer = progress(fraction);
        // A callback without a return statement does not mean to stop.
        return answer.is_none() || answer.cast<bool>();
    };
}

Side side_from_name(const std::string& name)
{
    if (name == "reflected")
        return Side::reflected;
    if (name == "transmitted")
        return Side::transmitted;
    reject("side", "'" + name + "'", "'reflected', 'transmitted'");
}

std::size_t image_side(std::ptrdiff_t size)
{
    if (size < 1)
        reject("size", static_cast<double>(size), "1 <= size <= 16384 texels");
    return static_cast<std::size_t>(size);
}

}  // namespace beamspread
