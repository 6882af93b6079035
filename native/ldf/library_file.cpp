// Files of LdfLibrary: multi-part OpenEXR.
//
// Every part carries the attributes beamspreadLdf (format version), g, ior, thickness (mean free
// paths, inf: half-space), photons, seed, angle (degrees), centre (mean free paths) and a checksum of itself. For the
// j-th angle and each side there are
//   "<side>.<j>"         columns: radius bins, lines: order bins, channels m0 .. m16: sums of weight * cos(m phi)
//                        per unit power that entered (transport/bins.h, tally.h), up to the last bins that are not empty;
//                        of a calibrated library also the attributes residuals and residualsHalfway (ldf/library.h);
//   "<side>.<j>.orders"  columns: order bins; line 0 and 1: mean and variance of the order; then one
//                        line per batch: power that leaves;
//   "<side>.<j>.scatter" columns: radius bins, lines: albedos within groups of batches, channels m0 .. m16:
//                        deviations of the groups (transport/map_scatter.h).
#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>

#include "base/error.h"
#include "image/exr.h"
#include "ldf/library.h"

namespace beamspread {

namespace {

constexpr int format_version = 4;
constexpr std::size_t scatter_lines = group_count * scatter_albedos.size();
constexpr std::array<const char*, side_count> side_names = {"reflected", "transmitted"};

std::vector<std::string> harmonic_channels()
{
    std::vector<std::string> names;
    for (std::size_t m = 0; m < harmonic_count; ++m)
        names.push_back(std::string("m").append(std::to_string(m)));
    return names;
}

// Lines of radius bins, cut after `columns` of them or filled up with zeros.
std::vector<float> with_columns(const std::vector<float>& values, std::size_t from_columns, std::size_t columns)
{
    const std::size_t lines = values.size() / (from_columns * harmonic_count);
    const std::size_t kept = std::min(from_columns, columns) * harmonic_count;
    std::vector<float> result(lines * columns * harmonic_count, 0.0F);
    for (std::size_t i = 0; i < lines; ++i)
        std::copy_n(values.begin() + static_cast<std::ptrdiff_t>(i * from_columns * harmonic_count), kept,
                    result.begin() + static_cast<std::ptrdiff_t>(i * columns * harmonic_count));
    return result;
}

// Bins that something was counted in, up to the last one; at least one of each.
struct UsedBins {
    explicit UsedBins(const std::vector<float>& moments)
    {
        for (std::size_t i = 0; i < moments.size(); i += harmonic_count) {
            if (moments[i] == 0.0F)
                continue;
            const std::size_t bin = i / harmonic_count;
            orders = std::max(orders, bin / radius_bin_count + 1);
            radii = std::max(radii, bin % radius_bin_count + 1);
        }
    }

    std::size_t orders = 1;
    std::size_t radii = 1;
};

std::map<std::string, ExrAttribute> common_attributes(const LdfLibrary& library, double angle_deg, double centre)
{
    return {{"beamspreadLdf", format_version},
            {"g", library.medium().g},
            {"ior", library.medium().ior},
            {"thickness", library.medium().thickness},
            {"photons", std::to_string(library.photons())},
            {"seed", std::to_string(library.seed())},
            {"angle", angle_deg},
            {"centre", centre}};
}

std::string part_name(std::size_t side, std::size_t j)
{
    return std::string(side_names[side]) + "." + std::to_string(j);
}

// FNV-1a over whole numbers instead of bytes: notices any damage to a part, be it to a single attribute.
class Checksum {
public:
    void add(std::uint64_t word) { m_hash = (m_hash ^ word) * 0x100000001b3ULL; }
    void add(int value) { add(static_cast<std::uint64_t>(value)); }
    void add(double value) { add(std::bit_cast<std::uint64_t>(value)); }
    void add(const std::string& text)
    {
        for (char c : text)
            add(static_cast<std::uint64_t>(c));
        add(text.size());
    }
    void add(const std::vector<float>& values)
    {
        for (float x : values)
            add(std::uint64_t{std::bit_cast<std::uint32_t>(x)});
        add(values.size());
    }
    std::string text() const { return std::to_string(m_hash); }

private:
    std::uint64_t m_hash = 0xcbf29ce484222325ULL;
};

std::string checksum(const ExrPart& part)
{
    Checksum sum;
    sum.add(part.name);
    for (const auto& [name, value] : part.attributes) {
        if (name == "checksum")
            continue;
        sum.add(name);
        std::visit([&sum](const auto& x) { sum.add(x); }, value);
    }
    sum.add(part.pixels);
    return sum.text();
}

class Reader {
public:
    explicit Reader(const std::string& path) : m_path(path), m_parts(read_exr_parts(path)) {}

    LdfLibrary library() const
    {
        if (m_parts.empty())
            fail("holds no parts");
        const ExrPart& first = m_parts.front();
        if (attribute<int>(first, "beamspreadLdf") != format_version)
            fail("is of another format version");
        const Medium medium{attribute<double>(first, "g"), attribute<double>(first, "ior"),
                            attribute<double>(first, "thickness")};
        std::vector<AngleResult> results;
        std::vector<SideResiduals> residuals;
        const bool is_calibrated = first.attributes.contains("residuals");
        while (const ExrPart* part = find(part_name(0, results.size()))) {
            AngleResult result;
            result.angle_deg = attribute<double>(*part, "angle");
            if (!(result.angle_deg >= 0.0 && result.angle_deg < 90.0))
                fail("has an angle out of range");
            for (std::size_t side = 0; side < side_count; ++side)
                if (find(part_name(side, results.size())))
                    result.sides[side] = side_result(part_name(side, results.size()));
            if (is_calibrated)
                residuals.push_back(side_residuals(results.size()));
            if (result.sides[1].moments.empty() != medium.is_half_space())
                fail("does not fit its own thickness");
            results.push_back(std::move(result));
        }
        try {
            return LdfLibrary(medium, number(first, "photons"), number(first, "seed"), std::move(results),
                              std::move(residuals));
        } catch (const InvalidArgument& error) {
            fail(std::string("is inconsistent: ") + error.what());
        }
    }

private:
    [[noreturn]] void fail(const std::string& why) const
    {
        throw IoError("'" + m_path + "' is not an LDF library: it " + why);
    }

    const ExrPart* find(const std::string& name) const
    {
        const auto found =
            std::find_if(m_parts.begin(), m_parts.end(), [&](const ExrPart& p) { return p.name == name; });
        return found == m_parts.end() ? nullptr : &*found;
    }

    template <class T>
    T attribute(const ExrPart& part, const std::string& name) const
    {
        const auto found = part.attributes.find(name);
        if (found == part.attributes.end() || !std::holds_alternative<T>(found->second))
            fail("has no attribute '" + name + "' of the right type");
        return std::get<T>(found->second);
    }

    std::uint64_t number(const ExrPart& part, const std::string& name) const
    {
        const auto text = attribute<std::string>(part, name);
        std::uint64_t value = 0;
        const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
        if (error != std::errc() || end != text.data() + text.size())
            fail("has an attribute '" + name + "' that is no number");
        return value;
    }

    const ExrPart& checked(const std::string& name, std::size_t height, const std::vector<std::string>& channels) const
    {
        const ExrPart* part = find(name);
        if (!part)
            fail("has no part '" + name + "'");
        if (part->height > static_cast<int>(height) || part->channels != channels)
            fail("has a part '" + name + "' of another size");
        if (!std::all_of(part->pixels.begin(), part->pixels.end(), [](float x) { return std::isfinite(x); }))
            fail("has a part '" + name + "' with values that are not finite");
        if (attribute<std::string>(*part, "checksum") != checksum(*part))
            fail("has a damaged part '" + name + "'");
        return *part;
    }

    // [line][radius bin][harmonic] of a part of at most this many lines, the missing bins empty.
    std::vector<float> rings(const ExrPart& part, std::size_t lines) const
    {
        if (part.width > static_cast<int>(radius_bin_count))
            fail("has a part '" + part.name + "' of another size");
        auto values = with_columns(part.pixels, static_cast<std::size_t>(part.width), radius_bin_count);
        values.resize(lines * radius_bin_count * harmonic_count, 0.0F);
        return values;
    }

    void read_residuals(const ExrPart& part, const std::string& name,
                        std::array<float, compared_albedos.size()>& to) const
    {
        const auto values = attribute<std::vector<float>>(part, name);
        if (values.size() != to.size() ||
            !std::all_of(values.begin(), values.end(), [](float x) { return x >= 0.0F && std::isfinite(x); }))
            fail("has an attribute '" + name + "' that is no list of errors");
        std::copy(values.begin(), values.end(), to.begin());
    }

    SideResiduals side_residuals(std::size_t j) const
    {
        SideResiduals residuals{};
        for (std::size_t side = 0; side < side_count; ++side)
            if (const ExrPart* part = find(part_name(side, j))) {
                read_residuals(*part, "residuals", residuals[side].here);
                read_residuals(*part, "residualsHalfway", residuals[side].halfway);
            }
        return residuals;
    }

    SideResult side_result(const std::string& name) const
    {
        SideResult result;
        const ExrPart& moments = checked(name, order_bin_count, harmonic_channels());
        result.centre = attribute<double>(moments, "centre");
        if (!std::isfinite(result.centre))
            fail("has a centre that is not finite");
        result.moments = rings(moments, order_bin_count);
        const ExrPart& orders = checked(name + ".orders", 2 + batch_count, {"Y"});
        if (orders.width != static_cast<int>(order_bin_count) || orders.height != static_cast<int>(2 + batch_count))
            fail("has a part '" + orders.name + "' of another size");
        const auto line = [&](std::size_t i) {
            return orders.pixels.begin() + static_cast<std::ptrdiff_t>(i * order_bin_count);
        };
        result.mean_order.assign(line(0), line(1));
        result.order_variance.assign(line(1), line(2));
        result.batch_totals.assign(line(2), orders.pixels.end());
        result.deviations = rings(checked(name + ".scatter", scatter_lines, harmonic_channels()), scatter_lines);
        return result;
    }

    std::string m_path;
    std::vector<ExrPart> m_parts;
};

}  // namespace

void save_library(const LdfLibrary& library, const std::string& path)
{
    std::vector<ExrPart> parts;
    for (std::size_t j = 0; j < library.results().size(); ++j) {
        const AngleResult& result = library.results()[j];
        for (std::size_t side = 0; side < side_count; ++side) {
            const SideResult& from = result.sides[side];
            if (from.moments.empty())
                continue;
            const auto attributes = common_attributes(library, result.angle_deg, from.centre);
            auto moments_attributes = attributes;
            if (library.is_calibrated()) {
                const Residuals& left = library.residuals()[j][side];
                moments_attributes["residuals"] = std::vector<float>(left.here.begin(), left.here.end());
                moments_attributes["residualsHalfway"] = std::vector<float>(left.halfway.begin(), left.halfway.end());
            }
            const UsedBins used(from.moments);
            std::vector<float> moments = with_columns(from.moments, radius_bin_count, used.radii);
            moments.resize(used.orders * used.radii * harmonic_count);
            parts.push_back({part_name(side, j), static_cast<int>(used.radii), static_cast<int>(used.orders),
                             harmonic_channels(), std::move(moments), moments_attributes});
            std::vector<float> orders = from.mean_order;
            orders.insert(orders.end(), from.order_variance.begin(), from.order_variance.end());
            orders.insert(orders.end(), from.batch_totals.begin(), from.batch_totals.end());
            parts.push_back({part_name(side, j) + ".orders",
                             static_cast<int>(order_bin_count),
                             static_cast<int>(2 + batch_count),
                             {"Y"},
                             std::move(orders),
                             attributes});
            parts.push_back({part_name(side, j) + ".scatter", static_cast<int>(used.radii),
                             static_cast<int>(scatter_lines), harmonic_channels(),
                             with_columns(from.deviations, radius_bin_count, used.radii), attributes, true});
        }
    }
    for (ExrPart& part : parts)
        part.attributes["checksum"] = checksum(part);
    write_exr_parts(path, parts);
}

LdfLibrary load_library(const std::string& path)
{
    return Reader(path).library();
}

}  // namespace beamspread
