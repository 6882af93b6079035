// Python name of native/scene/bent_texels: bent_texels.
#include "python/casters.h"
#include "scene/bent_texels.h"

namespace beamspread {

namespace {

// Uninitialized array of vectors (height, width, 3), and a view of it.
template <class Vector, class Number>
struct VectorTexels {
    Array<Number> values;
    View2D<Vector> view;

    VectorTexels(py::ssize_t height, py::ssize_t width)
        : values({height, width, py::ssize_t{3}}),
          view{reinterpret_cast<Vector*>(values.mutable_data()), side(values, 0), side(values, 1), width}
    {
    }
};

template <class Number>
struct NumberTexels {
    Array<Number> values;
    View2D<Number> view;

    NumberTexels(py::ssize_t height, py::ssize_t width)
        : values({height, width}), view{values.mutable_data(), side(values, 0), side(values, 1), width}
    {
    }
};

py::dict bent_texels(const py::array& texels, const py::array& positions, const py::object& normals, py::ssize_t width,
                     py::ssize_t height, int threads)
{
    MappedTriangles triangles{
        .texels = to_rows<Vec2, double>("texels", texels, "contiguous float64 (N, 2)"),
        .positions = to_rows<Vec3, double>("positions", positions, "contiguous float64 (N, 3)"),
        .normals = {},
    };
    if (!normals.is_none())
        triangles.normals = to_rows<Vec3f, float>("normals", py::cast<py::array>(normals), "contiguous float32 (N, 3)");
    if (width < 1 || height < 1)
        reject(width < 1 ? "width" : "height", static_cast<double>(std::min(width, height)), "1 or more texels");
    NumberTexels<float> covered(height, width);
    NumberTexels<float> areas(height, width);
    NumberTexels<std::int32_t> numbers(height, width);
    VectorTexels<Vec3, double> points(height, width);
    VectorTexels<Vec3f, float> steps_x(height, width);
    VectorTexels<Vec3f, float> steps_y(height, width);
    VectorTexels<Vec3f, float> upward(height, width);
    VectorTexels<Vec3f, float> tangents(height, width);
    {
        const py::gil_scoped_release released;
        find_bent_texels(triangles, threads,
                         {.covered = covered.view,
                          .areas = areas.view,
                          .positions = points.view,
                          .steps_x = steps_x.view,
                          .steps_y = steps_y.view,
                          .normals = upward.view,
                          .tangents = tangents.view,
                          .triangles = numbers.view});
    }
    py::dict result;
    result["covered"] = covered.values;
    result["areas"] = areas.values;
    result["positions"] = points.values;
    result["steps_x"] = steps_x.values;
    result["steps_y"] = steps_y.values;
    result["normals"] = upward.values;
    result["tangents"] = tangents.values;
    result["triangles"] = numbers.values;
    return result;
}

}  // namespace

void bind_bent_texels(py::module_& m)
{
    m.def("bent_texels", &bent_texels, py::arg("texels"), py::arg("positions"), py::arg("normals"), py::arg("width"),
          py::arg("height"), py::arg("threads") = 0,
          R"(Texels of a texture on the triangles of any mesh.

Parameters
----------
texels : ndarray, float64, shape (3 M, 2), C-contiguous
    Columns and rows of the corners of all triangles: texel (row y, column x) spans [x, x+1] x [y, y+1]. Triangles may
    reach beyond the grid; those without an area cover nothing.
positions : ndarray, float64, shape (3 M, 3), C-contiguous
    World positions of the corners, metres; anticlockwise seen from the side that light falls on.
normals : ndarray, float32, shape (3 M, 3), C-contiguous, or None
    Shading normals of the corners, of any length; None: each triangle's own.
width, height : int
    Size of the texture, texels.
threads : int
    0: all. The result is the same, bit for bit, for any number.

Returns
-------
dict
    Arrays (height, width) or (height, width, 3); 0 where no triangle is. 'covered': float32, sum over triangles of the
    fraction of the texel that each covers. 'areas': float32, area of the surface in the texel, m^2. The rest belongs to
    the centroid of the covered part, or of the part of the triangle that covers most if the centroid lies on no triangle.
    'positions': float64, metres. 'steps_x', 'steps_y': float32, change of position along columns and rows in the plane of
    the triangle, metres; they span the area of a texel that shows less than its triangle would. 'normals': float32, unit
    shading normals, on the triangle's outer side. 'tangents': float32, unit vectors along the columns at right angles to
    the normals. 'triangles': int32, number of the triangle; -1 where none is.

Raises
------
ValueError
    An argument is out of range; the message names it.
)");
}

}  // namespace beamspread
