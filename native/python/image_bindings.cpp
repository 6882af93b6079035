// Python names of native/image: write_exr, read_exr, read_exr_header, fill_rings, fill_margin.
#include "image/exr.h"

#include <algorithm>
#include <optional>

#include "base/error.h"
#include "image/margin.h"
#include "python/casters.h"

namespace beamspread {

namespace {

ExrAttribute to_attribute(const std::string& name, const py::handle& value)
{
    if (py::isinstance<py::str>(value))
        return py::cast<std::string>(value);
    if (py::isinstance<py::int_>(value))
        return py::cast<int>(value);
    if (py::isinstance<py::float_>(value))
        return py::cast<double>(value);
    if (py::isinstance<py::sequence>(value))
        return py::cast<std::vector<float>>(value);
    reject("attributes", "'" + name + "' of type " + std::string(py::str(py::type::of(value).attr("__name__"))),
           "str, int, float or a sequence of numbers");
}

std::map<std::string, ExrAttribute> to_attributes(const py::dict& attributes)
{
    std::map<std::string, ExrAttribute> result;
    for (const auto& [key, value] : attributes) {
        const auto name = std::string(py::str(key));
        try {
            result.emplace(name, to_attribute(name, value));
        } catch (const py::cast_error&) {
            reject("attributes", "'" + name + "': " + std::string(py::repr(value)), "an int of 32 bits or numbers");
        }
    }
    return result;
}

// The arrays' rows go up, the file's lines down.
void flip_rows(const float* from, float* to, std::size_t height, std::size_t row_values)
{
    for (std::size_t y = 0; y < height; ++y)
        std::copy_n(from + y * row_values, row_values, to + (height - 1 - y) * row_values);
}

void write_exr(const std::string& path, const py::array& array, const std::vector<std::string>& channels,
               const py::dict& attributes, const std::string& compression, bool half)
{
    const auto packing = named<ExrCompression>("compression", compression,
                                               {{"zip", ExrCompression::zip}, {"none", ExrCompression::none}});
    if (!py::isinstance<Array<float>>(array) || array.ndim() != 3)
        reject("array", shape_text(array), "contiguous float32 (H, W, C)");
    if (array.shape(2) != static_cast<py::ssize_t>(channels.size()))
        reject("array", std::to_string(array.shape(2)) + " channels",
               "as many as names in channels, " + std::to_string(channels.size()));
    if (array.shape(0) > max_exr_side || array.shape(1) > max_exr_side)
        reject("array", static_cast<double>(std::max(array.shape(0), array.shape(1))),
               "sides of up to " + std::to_string(max_exr_side) + " texels");

    ExrPart part;
    part.height = static_cast<int>(array.shape(0));
    part.width = static_cast<int>(array.shape(1));
    part.channels = channels;
    part.half = half;
    part.attributes = to_attributes(attributes);
    const std::span pixels(static_cast<const float*>(array.data()), static_cast<std::size_t>(array.size()));

    const py::gil_scoped_release released;
    write_exr_bottom_up(path, part, pixels, packing);
}

// The named part, or the only one if there is no name.
const ExrPart& choose_part(const std::string& path, const std::vector<ExrPart>& parts,
                           const std::optional<std::string>& name)
{
    const auto chosen =
        std::ranges::find_if(parts, [&](const ExrPart& part) { return name ? part.name == *name : parts.size() == 1; });
    if (chosen != parts.end())
        return *chosen;
    std::string names;
    for (const ExrPart& part : parts)
        names += (names.empty() ? "'" : ", '") + part.name + "'";
    throw IoError("cannot read '" + path + "': it has " +
                  (name ? "no part '" + *name + "', only " + names
                        : std::to_string(parts.size()) + " parts; name one of them, " + names));
}

py::tuple read_exr(const std::string& path, const std::optional<std::string>& part_name)
{
    std::vector<ExrPart> parts;
    {
        const py::gil_scoped_release released;
        parts = read_exr_parts(path);
    }
    const ExrPart& part = choose_part(path, parts, part_name);
    Array<float> array({static_cast<py::ssize_t>(part.height), static_cast<py::ssize_t>(part.width),
                        static_cast<py::ssize_t>(part.channels.size())});
    flip_rows(part.pixels.data(), array.mutable_data(), static_cast<std::size_t>(part.height),
              static_cast<std::size_t>(part.width) * part.channels.size());
    return py::make_tuple(array, part.channels, part.attributes);
}

py::list read_exr_header(const std::string& path)
{
    py::list result;
    for (const ExrPart& part : read_exr_headers(path))
        result.append(py::dict(py::arg("name") = part.name, py::arg("width") = part.width,
                               py::arg("height") = part.height, py::arg("channels") = part.channels,
                               py::arg("half") = part.half, py::arg("attributes") = part.attributes));
    return result;
}

// A texture that is written.
Texture texture_of(const py::array& array)
{
    if (!py::isinstance<Array<float>>(array) || array.ndim() != 3 || !array.writeable())
        reject("texture", shape_text(array), "contiguous, writable float32 (H, W, C)");
    return {static_cast<float*>(py::array(array).mutable_data()), side(array, 0), side(array, 1), side(array, 2)};
}

// Values of a texture's texels.
template <class T>
const T* of_texels(const std::string& name, const py::array& array, const Texture& texture, const std::string& allowed)
{
    const bool fits = py::isinstance<Array<T>>(array) && array.ndim() == 2 && side(array, 0) == texture.height &&
                      side(array, 1) == texture.width;
    if (!fits)
        reject(name, shape_text(array), "contiguous " + allowed + " (H, W) like the texture");
    return static_cast<const T*>(array.data());
}

void fill_rings(const py::array& array, const py::array& known, std::size_t count)
{
    const Texture texture = texture_of(array);
    const auto* const is_known =
        reinterpret_cast<const std::uint8_t*>(of_texels<bool>("known", known, texture, "bool"));
    const py::gil_scoped_release release;
    Rings(texture, nullptr).add(is_known, count);
}

void fill_margin(const py::array& array, const py::array& coverage, std::size_t margin, float whole, std::size_t border,
                 const std::optional<py::array>& labels)
{
    const Texture texture = texture_of(array);
    const float* const part = of_texels<float>("coverage", coverage, texture, "float32");
    const std::int32_t* const islands = labels ? of_texels<std::int32_t>("labels", *labels, texture, "int32") : nullptr;
    const py::gil_scoped_release release;
    extend_margin(texture, part, islands, margin, whole, border);
}

}  // namespace

void bind_image(py::module_& m)
{
    m.def("write_exr", &write_exr, py::arg("path"), py::arg("array"), py::arg("channels"),
          py::arg("attributes") = py::dict(), py::arg("compression") = "zip", py::arg("half") = false,
          R"(Write an OpenEXR file of 32-bit or 16-bit float channels.

The file is written beside `path` and takes its name when it is whole.

Parameters
----------
path : str
    A file that exists is replaced, unless it is read-only.
array : ndarray, float32, shape (H, W, C), C-contiguous
    Rows from the bottom up, as Blender stores images; the file gets them from the top down.
channels : sequence of str
    C names, such as ["R", "G", "B"].
attributes : dict, optional
    Header attributes: str, int, float, or a sequence of numbers (stored as 32-bit floats).
compression : {"zip", "none"}
    Both without loss.
half : bool
    Round to 16 bits: 11 bits of precision, up to 65504; what is larger becomes infinite.

Raises
------
ValueError
    An argument is of the wrong shape, dtype or range.
OSError
    The file cannot be written.
)");
    m.def("read_exr", &read_exr, py::arg("path"), py::arg("part") = py::none(), R"(Read one part of an OpenEXR file.

Parameters
----------
path : str
part : str, optional
    The part's name; may be left out where the file has one part only.

Returns
-------
array : ndarray, float32, shape (H, W, C)
    Rows from the bottom up. Half and integer channels are converted.
channels : list of str
    The names of the C channels: in the order in which `write_exr` got them, or R, G, B, A first.
attributes : dict
    Header attributes of type str, int, float and list of float; those that describe the image itself are left out.

Raises
------
OSError
    The file is missing, damaged or larger than 2^30 numbers, has deep data or subsampled channels, or no such part.
)");
    m.def("read_exr_header", &read_exr_header, py::arg("path"), R"(Read the headers of an OpenEXR file, without pixels.

Returns
-------
list of dict
    One for each part: `name`, `width`, `height`, `channels` and `attributes` as `read_exr` returns them, and `half`, True
    if all channels have 16 bits.

Raises
------
OSError
    The file is missing, or `read_exr` would refuse its header.
)");
    m.def("fill_rings", &fill_rings, py::arg("texture"), py::arg("known"), py::arg("count"),
          R"(Fill rings of texels around the known ones with the mean of their known neighbors.

Parameters
----------
texture : ndarray, float32, shape (H, W, C), C-contiguous
    Is changed.
known : ndarray, bool, shape (H, W), C-contiguous
count : int
    Number of rings.

Raises
------
ValueError
    An argument is of the wrong shape or dtype.
)");
    m.def("fill_margin", &fill_margin, py::arg("texture"), py::arg("coverage"), py::arg("margin"), py::arg("whole"),
          py::arg("border"), py::arg("labels") = py::none(),
          R"(Fill rings of texels around the islands of a texture, each with the mean of its island beside it.

Parameters
----------
texture : ndarray, float32, shape (H, W, C), C-contiguous
    Is changed, but for texels with a coverage above 0.
coverage : ndarray, float32, shape (H, W), C-contiguous
    Fraction of each texel inside the islands.
margin : int
    Number of rings.
whole : float
    Rings continue texels with a coverage above this, if there are any nearby.
border : int
    Texels within which these count as nearby.
labels : ndarray, int32, shape (H, W), C-contiguous, optional
    Island of each texel, below 0 for none; without, all belong to the same.

Raises
------
ValueError
    An argument is of the wrong shape or dtype.
)");
}

}  // namespace beamspread
