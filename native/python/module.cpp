// The extension module beamspread._native: exceptions, and one binding function per topic.
#include "base/error.h"
#include "python/casters.h"

namespace beamspread {

// Translates errors of the engine to Python's.
static void translate(std::exception_ptr pointer)
{
    try {
        if (pointer)
            std::rethrow_exception(pointer);
    } catch (const InvalidArgument& error) {
        PyErr_SetString(PyExc_ValueError, error.what());
    } catch (const IoError& error) {
        PyErr_SetString(PyExc_OSError, error.what());
    }
}

}  // namespace beamspread

PYBIND11_MODULE(_native, m)
{
    using namespace beamspread;
    m.doc() = "Light transport of beamspread; import the package `beamspread` instead.";
    m.attr("__version__") = BEAMSPREAD_VERSION;
    py::register_exception<Cancelled>(m, "Cancelled").doc() = "A progress callback returned False.";
    py::register_exception<MemoryLimit>(m, "MemoryLimit", PyExc_MemoryError).doc() =
        "The job needs more memory than allowed.";
    py::register_local_exception_translator(&translate);
    bind_medium(m);
    // Bind types before the functions that have them in their signatures.
    bind_ldf(m);
    bind_ldf_sample(m);
    bind_interpolation(m);
    bind_transport(m);
    bind_image(m);
    bind_scene(m);
    bind_bent_texels(m);
    bind_solve(m);
    bind_textured(m);
    bind_bake(m);
}
