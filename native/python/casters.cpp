#include "python/casters.h"

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

}  // namespace beamspread
