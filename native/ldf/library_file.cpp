// Files of LdfLibrary: multi-part OpenEXR.
//
// Every part carries the attributes beamspreadLdf (format version), g, ior, thickness (mean free
// paths, inf: half-space), photons, seed, angle (degrees), centre (mean free paths) and a checksum of itself. For the
// j-th angle and each side, radius bins up to the last that is not empty (transport/bins.h), there are
//   "<side>.<j>"         columns: radius bins, lines: order bins up to the last that is not empty: power that leaves
//                        per unit power that entered; attribute harmonics: how many each order bin has; of a calibrated
//                        library also residuals and residualsHalfway (ldf/library.h);
//   "<side>.<j>.ratios"  means of cos(m phi) over each ring, weighted by power, m = 1 and on: [order bin][m][radius
//                        bin] in lines of a fixed length, filled up with zeros, half precision; left out where no order
//                        has any;
//   "<side>.<j>.orders"  columns: order bins; line 0 and 1: mean and variance of the order; then one
//                        line per batch: power that leaves;
//   "<side>.<j>.scatter" columns: [harmonic][radius bin], lines: albedos within groups of batches: deviations of the
//                        groups (transport/map_scatter.h), half precision.
// One channel each: OpenEXR takes longer to sort channels into pixels than to read.
#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>

#include "base/error.h"
#include "image/exr.h"
#include "ldf/library.h"

namespace beamspread {

namespace {

constexpr int format_version = 5;
constexpr std::size_t ratio_columns = 2048;
constexpr std::size_t scatter_lines = group_count * scatter_albedos.size();
constexpr std::array<const char*, side_count> side_names = {"reflected", "transmitted"};

// Lines of another length: what is too long is cut off, what is missing filled up with zeros.
std::vector<float> with_columns(const std::vector<float>& values, std::size_t from_columns, std::size_t columns)
{
    const std::size_t lines = values.size() / from_columns;
    std::vector<float> result(lines * columns, 0.0F);
    for (std::size_t i = 0; i < lines; ++i)
        std::copy_n(values.begin() + static_cast<std::ptrdiff_t>(i * from_columns), std::min(from_columns, columns),
                    result.begin() + static_cast<std::ptrdiff_t>(i * columns));
    return result;
}

// Bins that something was counted in, up to the last one; at least one of each.
struct UsedBins {
    explicit UsedBins(const std::vector<float>& power)
    {
        for (std::size_t bin = 0; bin < power.size(); ++bin) {
            if (power[bin] == 0.0F)
                continue;
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
        // Two at a time, and all finite as long as no exponent is all ones.
        std::size_t i = 0;
        for (; i + 1 < values.size(); i += 2)
            add(bits(values[i]) | bits(values[i + 1]) << 32);
        if (i < values.size())
            add(bits(values[i]));
        add(values.size());
    }
    bool is_finite() const { return m_finite; }
    std::string text() const { return std::to_string(m_hash); }

private:
    std::uint64_t bits(float x)
    {
        constexpr std::uint32_t exponent = 0x7f800000;
        const auto word = std::bit_cast<std::uint32_t>(x);
        m_finite = m_finite && (word & exponent) != exponent;
        return word;
    }

    std::uint64_t m_hash = 0xcbf29ce484222325ULL;
    bool m_finite = true;
};

Checksum checksum(const ExrPart& part)
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
    return sum;
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
            if (result.sides[1].power.empty() != medium.is_half_space())
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

    const ExrPart& checked(const std::string& name) const
    {
        const ExrPart* part = find(name);
        if (!part)
            fail("has no part '" + name + "'");
        if (part->channels != std::vector<std::string>{"Y"})
            fail_size(name);
        const Checksum sum = checksum(*part);
        if (!sum.is_finite())
            fail("has a part '" + name + "' with values that are not finite");
        if (attribute<std::string>(*part, "checksum") != sum.text())
            fail("has a damaged part '" + name + "'");
        return *part;
    }

    [[noreturn]] void fail_size(const std::string& name) const { fail("has a part '" + name + "' of another size"); }

    // A part of lines of radius bins, the missing bins empty.
    std::vector<float> power(const ExrPart& part) const
    {
        if (part.width > static_cast<int>(radius_bin_count) || part.height > static_cast<int>(order_bin_count))
            fail_size(part.name);
        auto values = with_columns(part.pixels, static_cast<std::size_t>(part.width), radius_bin_count);
        values.resize(order_bin_count * radius_bin_count, 0.0F);
        return values;
    }

    std::vector<std::size_t> harmonics(const ExrPart& part) const
    {
        std::vector<std::size_t> counts;
        for (const float count : attribute<std::vector<float>>(part, "harmonics")) {
            const bool fits = counts.size() < order_bin_count && count >= 1.0F && count == std::floor(count) &&
                              count <= static_cast<float>(harmonics_of(counts.size()));
            if (!fits)
                fail("has an attribute 'harmonics' that is no list of their numbers");
            counts.push_back(static_cast<std::size_t>(count));
        }
        if (counts.size() != order_bin_count)
            fail("has an attribute 'harmonics' of another size");
        return counts;
    }

    std::vector<float> ratios(const std::string& name, const std::vector<std::size_t>& harmonics,
                              std::size_t radii) const
    {
        std::size_t rings = 0;
        for (const std::size_t count : harmonics)
            rings += count - 1;
        if (rings == 0)
            return {};
        const ExrPart& part = checked(name);
        const std::size_t lines = (rings * radii + ratio_columns - 1) / ratio_columns;
        if (part.width != static_cast<int>(ratio_columns) || part.height != static_cast<int>(lines))
            fail_size(name);
        std::vector<float> values(part.pixels.begin(),
                                  part.pixels.begin() + static_cast<std::ptrdiff_t>(rings * radii));
        return with_columns(values, radii, radius_bin_count);
    }

    std::vector<float> scatter(const ExrPart& part, std::size_t harmonics, std::size_t radii) const
    {
        if (part.width != static_cast<int>(harmonics * radii) || part.height != static_cast<int>(scatter_lines))
            fail_size(part.name);
        return with_columns(part.pixels, radii, radius_bin_count);
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
        const ExrPart& first = checked(name);
        const auto radii = static_cast<std::size_t>(first.width);
        result.centre = attribute<double>(first, "centre");
        if (!std::isfinite(result.centre))
            fail("has a centre that is not finite");
        result.power = power(first);
        result.harmonics = harmonics(first);
        result.ratios = ratios(name + ".ratios", result.harmonics, radii);
        const ExrPart& orders = checked(name + ".orders");
        if (orders.width != static_cast<int>(order_bin_count) || orders.height != static_cast<int>(2 + batch_count))
            fail_size(orders.name);
        const auto line = [&](std::size_t i) {
            return orders.pixels.begin() + static_cast<std::ptrdiff_t>(i * order_bin_count);
        };
        result.mean_order.assign(line(0), line(1));
        result.order_variance.assign(line(1), line(2));
        result.batch_totals.assign(line(2), orders.pixels.end());
        result.deviations = scatter(checked(name + ".scatter"), most_harmonics(result), radii);
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
            if (from.power.empty())
                continue;
            const auto attributes = common_attributes(library, result.angle_deg, from.centre);
            auto first_attributes = attributes;
            first_attributes["harmonics"] = std::vector<float>(from.harmonics.begin(), from.harmonics.end());
            if (library.is_calibrated()) {
                const Residuals& left = library.residuals()[j][side];
                first_attributes["residuals"] = std::vector<float>(left.here.begin(), left.here.end());
                first_attributes["residualsHalfway"] = std::vector<float>(left.halfway.begin(), left.halfway.end());
            }
            const UsedBins used(from.power);
            const auto add = [&](const std::string& name, std::size_t columns, std::vector<float> values,
                                 const std::map<std::string, ExrAttribute>& with, bool half) {
                const std::size_t lines = values.size() / columns;
                parts.push_back(
                    {name, static_cast<int>(columns), static_cast<int>(lines), {"Y"}, std::move(values), with, half});
            };
            std::vector<float> power = with_columns(from.power, radius_bin_count, used.radii);
            power.resize(used.orders * used.radii);
            add(part_name(side, j), used.radii, std::move(power), first_attributes, false);
            if (!from.ratios.empty()) {
                std::vector<float> ratios = with_columns(from.ratios, radius_bin_count, used.radii);
                ratios.resize((ratios.size() + ratio_columns - 1) / ratio_columns * ratio_columns, 0.0F);
                add(part_name(side, j) + ".ratios", ratio_columns, std::move(ratios), attributes, true);
            }
            std::vector<float> orders = from.mean_order;
            orders.insert(orders.end(), from.order_variance.begin(), from.order_variance.end());
            orders.insert(orders.end(), from.batch_totals.begin(), from.batch_totals.end());
            add(part_name(side, j) + ".orders", order_bin_count, std::move(orders), attributes, false);
            add(part_name(side, j) + ".scatter", most_harmonics(from) * used.radii,
                with_columns(from.deviations, radius_bin_count, used.radii), attributes, true);
        }
    }
    for (ExrPart& part : parts)
        part.attributes["checksum"] = checksum(part).text();
    write_exr_parts(path, parts);
}

LdfLibrary load_library(const std::string& path)
{
    return Reader(path).library();
}

}  // namespace beamspread
