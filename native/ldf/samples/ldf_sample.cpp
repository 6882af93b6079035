#include "ldf/samples/ldf_sample.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>

#include "base/error.h"
#include "image/exr.h"
#include "ldf/radial/radial_function.h"
#include "medium/medium.h"

namespace beamspread {

namespace {

// Largest undershoot over the brightest texel. Sharpening filters undershoot steps by 9 % (Gibbs).
constexpr double max_undershoot = 0.1;

void check_image(const LdfSample& sample)
{
    if (sample.width < 1 || sample.height < 1 || sample.width > max_sample_side || sample.height > max_sample_side)
        reject("image", "of " + std::to_string(sample.height) + " x " + std::to_string(sample.width) + " texels",
               "sides of 1 to " + std::to_string(max_sample_side) + " texels");
    double darkest = 0.0;
    double brightest = 0.0;
    for (const float texel : sample.image) {
        const auto value = static_cast<double>(texel);
        if (!std::isfinite(value))
            reject("image", "with a texel of " + std::to_string(value), "finite exitance");
        darkest = std::min(darkest, value);
        brightest = std::max(brightest, value);
    }
    if (darkest < -max_undershoot * brightest)
        reject("image", "with a texel of " + std::to_string(darkest),
               "exitance >= 0, or undershoots of up to 10 % of the brightest texel");
}

struct Neighbours {
    std::size_t lower;
    std::size_t upper;
    double weight;  // of the upper one
};

Neighbours neighbours(double x, double pitch, std::size_t count)
{
    const auto last = static_cast<double>(count - 1);
    const double position = std::clamp(x / pitch + 0.5 * last, 0.0, last);
    const auto lower = static_cast<std::size_t>(position);
    return {lower, std::min(lower + 1, count - 1), position - std::floor(position)};
}

// A file is an OpenEXR file with one part. The first line of the file is that of the largest v, columns run
// toward +u, and O is the centre of the data window. The pixels are those of the channel Y, or of the only channel
// there is.
//
//   pitch         side of a pixel, mean free paths         needed
//   angle         of incidence, degrees                    needed
//   albedo        single-scattering albedo                 needed
//   beamDiameter  of the beam, mean free paths             0 (a pencil beam) where missing
//   g             anisotropy                               unknown where missing
//
// Numbers of type float, double or int; any other attributes are ignored. We write double.
constexpr const char* exitance_channel = "Y";

[[noreturn]] void fail(const std::string& path, const std::string& why)
{
    throw IoError("'" + path + "' is not an LDF sample: it " + why);
}

// The arrays' rows go up, the file's lines down.
std::vector<float> flipped(const std::vector<float>& image, std::size_t width)
{
    std::vector<float> result;
    result.reserve(image.size());
    for (auto row = image.end(); row != image.begin();) {
        row -= static_cast<std::ptrdiff_t>(width);
        result.insert(result.end(), row, row + static_cast<std::ptrdiff_t>(width));
    }
    return result;
}

class Reader {
public:
    explicit Reader(const std::string& path) : m_path(path)
    {
        std::vector<ExrPart> parts = read_exr_parts(path);
        if (!parts.empty() && parts.front().attributes.contains("beamspreadLdf"))
            fail(path, "holds a whole library, which LdfLibrary.load reads");
        if (parts.size() != 1)
            fail(path, "has " + std::to_string(parts.size()) + " parts instead of one");
        m_part = std::move(parts.front());
    }

    LdfSample sample() const
    {
        check_attributes();
        LdfSample result;
        result.width = static_cast<std::size_t>(m_part.width);
        result.height = static_cast<std::size_t>(m_part.height);
        result.image = flipped(channel(), result.width);
        result.pitch = needed("pitch");
        result.angle_deg = needed("angle");
        result.albedo = needed("albedo");
        result.beam_diameter = number("beamDiameter").value_or(0.0);
        result.g = number("g");
        try {
            validate(result);
        } catch (const InvalidArgument& error) {
            fail(m_path, std::string("holds an impossible value: ") + error.what());
        }
        return result;
    }

private:
    void check_attributes() const
    {
        std::string missing;
        for (const char* name : {"pitch", "angle", "albedo"})
            if (!m_part.attributes.contains(name))
                missing += std::string(missing.empty() ? "'" : ", '") + name + "'";
        if (!missing.empty())
            fail(m_path, "has no attribute " + missing +
                             "; needed are 'pitch' (mean free paths), 'angle' (degrees) and 'albedo'");
    }

    std::optional<double> number(const std::string& name) const
    {
        const auto entry = m_part.attributes.find(name);
        if (entry == m_part.attributes.end())
            return std::nullopt;
        if (const auto* real = std::get_if<double>(&entry->second))
            return *real;
        if (const auto* integer = std::get_if<int>(&entry->second))
            return *integer;
        fail(m_path, "has an attribute '" + name + "' that is no number");
    }

    // Value of an attribute that `check_attributes` has found.
    double needed(const std::string& name) const { return number(name).value_or(0.0); }

    std::vector<float> channel() const
    {
        const std::vector<std::string>& names = m_part.channels;
        const auto named = std::find(names.begin(), names.end(), exitance_channel);
        if (named == names.end() && names.size() != 1) {
            std::string list;
            for (const std::string& name : names)
                list += (list.empty() ? "'" : ", '") + name + "'";
            fail(m_path, "has the channels " + list + "; needed is 'Y', or one channel alone");
        }
        const auto index = static_cast<std::size_t>(named == names.end() ? 0 : std::distance(names.begin(), named));
        std::vector<float> values;
        values.reserve(m_part.pixels.size() / names.size());
        for (std::size_t i = index; i < m_part.pixels.size(); i += names.size())
            values.push_back(m_part.pixels[i]);
        return values;
    }

    std::string m_path;
    ExrPart m_part;
};

}  // namespace

double LdfSample::power() const
{
    return std::accumulate(image.begin(), image.end(), 0.0) * pitch * pitch;
}

double exitance_at(const LdfSample& sample, const Vec2& point)
{
    const Neighbours x = neighbours(point.x, sample.pitch, sample.width);
    const Neighbours y = neighbours(point.y, sample.pitch, sample.height);
    const auto along_u = [&](std::size_t row) {
        return (1.0 - x.weight) * static_cast<double>(sample.at(row, x.lower)) +
               x.weight * static_cast<double>(sample.at(row, x.upper));
    };
    return (1.0 - y.weight) * along_u(y.lower) + y.weight * along_u(y.upper);
}

void validate(const LdfSample& sample)
{
    check_image(sample);
    check_pitch(sample.pitch);
    if (!(sample.angle_deg >= 0.0 && sample.angle_deg < 90.0))
        reject("angle", sample.angle_deg, "0 <= angle < 90 degrees");
    check_albedo(sample.albedo);
    if (!(sample.beam_diameter >= 0.0 && std::isfinite(sample.beam_diameter)))
        reject("beam_diameter", sample.beam_diameter, "beam_diameter >= 0 mean free paths");
    if (sample.g && !(std::abs(*sample.g) < 1.0))
        reject("g", *sample.g, "-1 < g < 1");
}

void save_sample(const LdfSample& sample, const std::filesystem::path& path)
{
    ExrPart part;
    part.width = static_cast<int>(sample.width);
    part.height = static_cast<int>(sample.height);
    part.channels = {exitance_channel};
    part.pixels = flipped(sample.image, sample.width);
    part.attributes = {{"pitch", sample.pitch},
                       {"angle", sample.angle_deg},
                       {"albedo", sample.albedo},
                       {"beamDiameter", sample.beam_diameter}};
    if (sample.g)
        part.attributes.emplace("g", *sample.g);
    write_exr_parts(path.string(), {&part, 1});
}

LdfSample load_sample(const std::filesystem::path& path)
{
    return Reader(path.string()).sample();
}

}  // namespace beamspread
