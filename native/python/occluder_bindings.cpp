// Python names of occluders in native/scene: ColorTexture, OccluderMesh, Occluders.
#include <memory>
#include <optional>
#include <vector>

#include "python/casters.h"
#include "scene/occluders.h"

namespace beamspread {

namespace {

// An OccluderMesh and the arrays that it views.
struct HeldMesh {
    py::array vertices, triangles;
    std::optional<py::array> placements, materials, uvs, reflector_uvs;
    OccluderMesh mesh;
};

std::vector<Placement> to_placements(const py::array& array)
{
    using Row = std::array<double, 12>;
    std::vector<Placement> placements;
    for (const Row& row : to_rows<Row, double>("placements", array, "contiguous float64 (K, 12)")) {
        const auto column = [&row](std::size_t j) { return Vec3(row[j], row[4 + j], row[8 + j]); };
        placements.push_back({Mat3(column(0), column(1), column(2)), column(3)});
    }
    return placements;
}

std::unique_ptr<HeldMesh> make_mesh(const py::array& vertices, const py::array& triangles,
                                    const std::optional<py::array>& placements,
                                    std::vector<std::shared_ptr<ColorTexture>> transmittances,
                                    const std::optional<py::array>& materials, const std::optional<py::array>& uvs,
                                    std::vector<std::shared_ptr<Reflector>> reflectors,
                                    const std::optional<py::array>& reflector_uvs,
                                    const std::vector<std::uint32_t>& owners)
{
    auto held =
        std::make_unique<HeldMesh>(HeldMesh{vertices, triangles, placements, materials, uvs, reflector_uvs, {}});
    held->mesh.vertices = to_vertices(vertices);
    held->mesh.triangles = to_triangles(triangles);
    if (placements)
        held->mesh.placements = to_placements(*placements);
    if (!owners.empty() && owners.size() != held->mesh.placements.size())
        reject("owners", static_cast<double>(owners.size()), "one number for each placement");
    for (std::size_t i = 0; i < owners.size(); ++i)
        held->mesh.placements[i].owner = owners[i];
    held->mesh.transmittances.assign(transmittances.begin(), transmittances.end());
    if (materials)
        held->mesh.materials =
            to_rows<std::uint32_t, std::uint32_t>("materials", *materials, "contiguous uint32 (M, 1)");
    const auto to_uvs = [](const char* name, const py::array& array) {
        return to_rows<std::array<Vec2f, 3>, float>(name, array, "contiguous float32 (M, 6)");
    };
    if (uvs)
        held->mesh.uvs = to_uvs("uvs", *uvs);
    held->mesh.reflectors.assign(reflectors.begin(), reflectors.end());
    if (reflector_uvs)
        held->mesh.reflector_uvs = to_uvs("reflector_uvs", *reflector_uvs);
    return held;
}

std::unique_ptr<Occluders> make_occluders(const std::vector<const HeldMesh*>& held, const Numbers& origin,
                                          std::optional<int> max_crossings, std::size_t max_copied)
{
    std::vector<OccluderMesh> meshes;
    for (const HeldMesh* item : held)
        meshes.push_back(item->mesh);
    OccluderSettings settings{.max_copied = max_copied};
    if (max_crossings)
        settings.max_crossings = *max_crossings;
    const Vec3 center = to_vec3("origin", origin);
    const py::gil_scoped_release released;
    return std::make_unique<Occluders>(meshes, center, settings);
}

Extension to_extension(const std::string& name)
{
    return named<Extension>("extension", name,
                            {{"repeat", Extension::repeat},
                             {"extend", Extension::extend},
                             {"clip", Extension::clip},
                             {"mirror", Extension::mirror}});
}

std::shared_ptr<ColorTexture> make_color(const Numbers& color)
{
    return std::make_shared<ColorTexture>(Vec3f(to_vec3("color", color)));
}

std::shared_ptr<ColorTexture> make_image(const py::array& texels, Extension extension, bool is_smooth,
                                         const Numbers& outside)
{
    if (!py::isinstance<Array<float>>(texels) || texels.ndim() != 3 || (texels.shape(2) != 1 && texels.shape(2) != 3))
        reject("texels", shape_text(texels), "contiguous float32 (H, W, 1) or (H, W, 3)");
    const TexelArray view{.values = {static_cast<const float*>(texels.data()), static_cast<std::size_t>(texels.size())},
                          .width = static_cast<std::size_t>(texels.shape(1)),
                          .height = static_cast<std::size_t>(texels.shape(0)),
                          .channels = static_cast<std::size_t>(texels.shape(2))};
    return std::make_shared<ColorTexture>(view, extension, is_smooth, Vec3f(to_vec3("outside", outside)));
}

// The arguments that make the same texture; one color has no texels.
py::tuple state_of(const ColorTexture& texture)
{
    const Vec3f& color = texture.color();
    py::object texels = py::none();
    if (const std::vector<float> values = texture.texels(); !values.empty())
        texels = Array<float>({texture.height(), texture.width(), texture.channels()}, values.data());
    return py::make_tuple(texels, static_cast<int>(texture.extension()), texture.is_smooth(),
                          py::make_tuple(color.x, color.y, color.z));
}

std::shared_ptr<ColorTexture> from_state(const py::tuple& state)
{
    const auto color = state[3].cast<Numbers>();
    if (state[0].is_none())
        return make_color(color);
    return make_image(state[0].cast<py::array>(), static_cast<Extension>(state[1].cast<int>()), state[2].cast<bool>(),
                      color);
}

std::shared_ptr<Reflector> make_reflector(const std::shared_ptr<ColorTexture>& albedo, const Numbers& f0,
                                          double roughness, bool is_layered)
{
    if (!albedo)
        reject("albedo", "None", "a ColorTexture");
    return std::make_shared<Reflector>(albedo, Vec3f(to_vec3("f0", f0)), roughness, is_layered);
}

}  // namespace

void bind_occluders(py::module_& m)
{
    py::class_<ColorTexture, std::shared_ptr<ColorTexture>>(
        m, "ColorTexture",
        R"(A color on a surface: the part of light that it lets through or reflects.

Parameters
----------
color : 3 floats
    0 to 1 in each channel.
)")
        .def(py::init(&make_color), py::arg("color"))
        .def_static(
            "from_image",
            [](const py::array& texels, const std::string& extension, bool is_smooth, const Numbers& outside) {
                return make_image(texels, to_extension(extension), is_smooth, outside);
            },
            py::arg("texels"), py::arg("extension") = "repeat", py::arg("is_smooth") = true,
            py::arg("outside") = py::make_tuple(1.0, 1.0, 1.0),
            R"(An image of colors, at the triangles' UVs.

Parameters
----------
texels : ndarray, float32, shape (H, W, 1) or (H, W, 3), C-contiguous
    0 to 1; row 0 at v = 0. Stored in 16 bits.
extension : str
    Extension beyond the border: 'repeat', 'extend', 'clip', 'mirror'.
is_smooth : bool
    True for bilinear interpolation, False for the nearest texel.
outside : 3 floats
    Color of a clipped image beyond its border.

Raises
------
ValueError
    Wrong dtype or shape, a value outside 0 to 1.
)")
        .def_property_readonly("is_black", &ColorTexture::is_black, "bool: True if all colors are black.")
        .def_property_readonly("is_colored", &ColorTexture::is_colored, "bool: True if channels differ somewhere.")
        .def(py::pickle(&state_of, &from_state));

    py::class_<Reflector, std::shared_ptr<Reflector>>(m, "Reflector",
                                                      R"(The light that a material reflects, the same on both sides.

Parameters
----------
albedo : ColorTexture
    Diffuse (Lambertian) albedo. On a see-through triangle it counts in full, beside the transmittance.
f0 : 3 floats
    Reflectance at normal incidence of a GGX lobe over it, 0 to 1; 0: no lobe.
roughness : float
    Roughness of the lobe as in Cycles, 0 to 1: alpha is its square.
is_layered : bool
    True if the lobe takes its light from the diffuse reflection below it (Blender 4.0 and later); False if both add up.

Raises
------
ValueError
    A value is out of range.
)")
        .def(py::init(&make_reflector), py::arg("albedo"), py::arg("f0") = py::make_tuple(0.0, 0.0, 0.0),
             py::arg("roughness") = 1.0, py::arg("is_layered") = true)
        .def(py::pickle(
            [](const Reflector& reflector) {
                const Vec3f& f0 = reflector.f0();
                return py::make_tuple(reflector.albedo(), py::make_tuple(f0.x, f0.y, f0.z), reflector.roughness(),
                                      reflector.is_layered());
            },
            [](const py::tuple& state) {
                return make_reflector(state[0].cast<std::shared_ptr<ColorTexture>>(), state[1].cast<Numbers>(),
                                      state[2].cast<double>(), state[3].cast<bool>());
            }));

    py::class_<HeldMesh>(m, "OccluderMesh", R"(A mesh, its instances, and the light that its triangles let through.

Parameters
----------
vertices : ndarray, float64, shape (N, 3), C-contiguous
    Metres in the mesh's frame. No array may change before occluders are made of the mesh.
triangles : ndarray, uint32, shape (M, 3), C-contiguous
    Vertex indices.
placements : ndarray, float64, shape (K, 12), C-contiguous, optional
    Rows of 3 x 4 matrices from the mesh's frame to the world; None: the mesh is in the world.
transmittances : list of ColorTexture
    Part of light that each material lets through.
materials : ndarray, uint32, shape (M, 1), C-contiguous, optional
    Index of each triangle's material; None: all are opaque.
uvs : ndarray, float32, shape (M, 6), C-contiguous, optional
    (u, v) of each triangle's corners; None: all are (0, 0).
reflectors : list of Reflector or None
    Reflection of each material, None for a black one; empty: the mesh reflects nothing. Without `materials` all
    triangles have the first.
reflector_uvs : ndarray, float32, shape (M, 6), C-contiguous, optional
    (u, v) of each triangle's corners in the images of albedo; None: all are (0, 0).
owners : list of int
    Number of the object that each placement belongs to, 0 to 2^32 - 1; empty: all are 0.

Raises
------
ValueError
    Wrong dtype or shape.
)")
        .def(py::init(&make_mesh), py::arg("vertices"), py::arg("triangles"), py::arg("placements") = py::none(),
             py::arg("transmittances") = py::list(), py::arg("materials") = py::none(), py::arg("uvs") = py::none(),
             py::arg("reflectors") = py::list(), py::arg("reflector_uvs") = py::none(), py::arg("owners") = py::list());

    py::class_<Occluders>(m, "Occluders", R"(Triangles of meshes that block light, or a part of it, from both sides.

Parameters
----------
meshes : list of OccluderMesh
    May be empty: nothing is blocked.
origin : 3 floats
    World position near the receivers, metres: rays are traced in single precision relative to it.
max_crossings : int, optional
    Number of see-through triangles that a ray crosses; it ends at the next. None: no limit.
max_copied : int
    Number of triangles, with those of each placement, above which the placements of a mesh share its triangles.

Raises
------
ValueError
    A number that is not finite, an index that is out of range.
)")
        .def(py::init(&make_occluders), py::arg("meshes"), py::arg("origin") = py::make_tuple(0.0, 0.0, 0.0),
             py::arg("max_crossings") = py::none(), py::arg("max_copied") = OccluderSettings{}.max_copied)
        .def_property_readonly("triangle_count", &Occluders::triangle_count,
                               "int: number of triangles, with those of each placement.")
        .def_property_readonly("is_opaque", &Occluders::is_opaque, "bool: True if all triangles block all light.")
        .def_property_readonly("is_colored", &Occluders::is_colored,
                               "bool: True if some let one channel through more than another.");
}

}  // namespace beamspread
