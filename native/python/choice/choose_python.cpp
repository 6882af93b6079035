// Entry of the module that holds the bindings for several Pythons: calls those of the Python that loads it.
// cmake/python_module.cmake links them, and names their Pythons by BEAMSPREAD_PYTHONS: BEAMSPREAD_PYTHON(11) is 3.11.
#define Py_LIMITED_API 0x030A0000
#include <Python.h>

#include <cstdlib>
#include <cstring>
#include <string>

#define BEAMSPREAD_PYTHON(minor) extern "C" PyObject* PyInit__native_3##minor();
BEAMSPREAD_PYTHONS
#undef BEAMSPREAD_PYTHON

namespace {

struct Bindings {
    long minor;
    PyObject* (*init)();
};

constexpr Bindings all_bindings[] = {
#define BEAMSPREAD_PYTHON(minor) {minor, &PyInit__native_3##minor},
    BEAMSPREAD_PYTHONS
#undef BEAMSPREAD_PYTHON
};

}  // namespace

// NOLINTNEXTLINE(bugprone-reserved-identifier, readability-identifier-naming): the name that Python looks for
PyMODINIT_FUNC PyInit__native()
{
    // The text begins with the version, and names a build without the lock: its objects have another layout.
    const char* const version = Py_GetVersion();
    const bool free_threaded = std::strstr(version, "free-threading") != nullptr;
    const long minor = std::strncmp(version, "3.", 2) == 0 ? std::strtol(version + 2, nullptr, 10) : -1;
    std::string pythons;
    for (const Bindings& bindings : all_bindings) {
        if (bindings.minor == minor && !free_threaded)
            return bindings.init();
        pythons += (pythons.empty() ? "3." : ", 3.") + std::to_string(bindings.minor);
    }
    return PyErr_Format(PyExc_ImportError, "the module is for Python %s%s", pythons.c_str(),
                        free_threaded ? " with the global interpreter lock" : "");
}
