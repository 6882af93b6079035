// OpenEXR images: named parts of float channels with typed attributes.
#pragma once

#include <map>
#include <span>
#include <string>
#include <variant>
#include <vector>

namespace beamspread {

// Half-precision and integer numbers of foreign files arrive as float and double.
using ExrAttribute = std::variant<std::string, double, int, std::vector<float>>;

struct ExrPart {
    std::string name;  // may be empty if the file has one part only
    int width = 0;
    int height = 0;
    std::vector<std::string> channels;  // in this order, although the format sorts them by name
    std::vector<float> pixels;          // height * width * channels; row 0 is the first line of the file
    std::map<std::string, ExrAttribute> attributes;
    bool half = false;  // true if the file stores all numbers in half precision, rounded
};

// Larger images are refused in both directions: a 16384 x 16384 image of four channels just fits.
inline constexpr int max_exr_side = 1 << 17;
inline constexpr long long max_exr_values = 1LL << 30;

// Noise in the last bits of baked numbers packs badly: ZIP saves two fifths of a baked RGB texture and takes ten times
// as long to write.
enum class ExrCompression { none, zip };

// Writes the parts to a file beside `path` and renames it over `path` when it is whole.
// Throws InvalidArgument if a part is inconsistent and IoError, naming the path, if it cannot be written.
void write_exr_parts(const std::string& path, std::span<const ExrPart> parts,
                     ExrCompression compression = ExrCompression::zip);

// The same for one part with pixels of the host: `pixels` replaces its own and goes from the file's last line to its
// first.
void write_exr_bottom_up(const std::string& path, const ExrPart& part, std::span<const float> pixels,
                         ExrCompression compression = ExrCompression::zip);

// Reads every part of a flat file, scan lines or tiles, half, float or unsigned channels. Throws IoError, naming the
// path, if the file is missing, damaged, too large, deep, or has subsampled channels.
std::vector<ExrPart> read_exr_parts(const std::string& path);

// The same parts without their pixels: reads only the start of the file.
std::vector<ExrPart> read_exr_headers(const std::string& path);

}  // namespace beamspread
