// Reads and checks the files that ldf/library_format.h describes.
#include <algorithm>
#include <charconv>
#include <cmath>
#include <numeric>
#include <utility>

#include "base/error.h"
#include "base/threads.h"
#include "image/exr.h"
#include "ldf/library/ldf_library.h"
#include "ldf/library/library_format.h"

namespace beamspread {

namespace format = library_format;

namespace {

class Reader {
public:
    explicit Reader(const std::string& path) : m_path(path), m_parts(read_exr_parts(path)) {}

    LdfLibrary library()
    {
        const ExrPart* first = find(format::part_name(0, 0));
        if (!first)
            fail(m_parts.empty() ? "holds no parts" : "holds no plane");
        const Medium medium = checked_medium(*first);
        std::vector<AngleResult> results;
        std::vector<SideResiduals> residuals;
        const bool is_calibrated = first->attributes.contains("residuals");
        while (find(format::part_name(0, results.size())))
            results.emplace_back();
        parallel_for(results.size(), [&](std::size_t j) { results[j] = angle_result(j, medium); });
        for (std::size_t j = 0; is_calibrated && j < results.size(); ++j)
            residuals.push_back(side_residuals(j));
        return consistent([&] {
            const LdfLibrary plane(medium, number(*first, "photons"), number(*first, "seed"), std::move(results),
                                   std::move(residuals));
            return find(format::curved_name(0)) ? plane.with_curved(curved()) : plane;
        });
    }

    std::vector<CurvedPart> curved()
    {
        std::vector<CurvedPart> parts;
        while (find(format::curved_name(parts.size())))
            parts.emplace_back();
        if (parts.empty())
            fail("holds no curved surfaces");
        parallel_for(parts.size(), [&](std::size_t i) { parts[i] = curved_part(format::curved_name(i)); });
        return parts;
    }

private:
    Medium checked_medium(const ExrPart& first) const
    {
        if (attribute<int>(first, "beamspreadLdf") != format::version)
            fail("is of another format version");
        return {attribute<double>(first, "g"), attribute<double>(first, "ior"), attribute<double>(first, "thickness")};
    }

    template <class Make>
    LdfLibrary consistent(const Make& make) const
    {
        try {
            return make();
        } catch (const InvalidArgument& error) {
            fail(std::string("is inconsistent: ") + error.what());
        }
    }

    AngleResult angle_result(std::size_t j, const Medium& medium)
    {
        AngleResult result;
        result.angle_deg = checked_angle(*find(format::part_name(0, j)), "angle");
        for (std::size_t side = 0; side < side_count; ++side)
            if (find(format::part_name(side, j)))
                result.sides[side] = side_result(format::part_name(side, j));
        if (result.sides[1].power.empty() != medium.is_half_space())
            fail("does not fit its own thickness");
        return result;
    }

    CurvedPart curved_part(const std::string& name)
    {
        constexpr auto side = static_cast<std::size_t>(Side::reflected);
        const ExrPart& first = checked(name);
        const Medium medium = checked_medium(first);
        std::vector<AngleResult> results;
        while (first.attributes.contains("angle." + std::to_string(results.size()))) {
            const double angle = checked_angle(first, "angle." + std::to_string(results.size()));
            results.emplace_back().angle_deg = angle;
        }
        const ExrPart& orders = checked(name + ".orders");
        if (results.empty() || orders.width != static_cast<int>(order_bin_count) ||
            orders.height != static_cast<int>(results.size() * format::curved_order_lines))
            fail_size(orders.name);
        const auto radii = static_cast<std::size_t>(first.width);
        const auto rows = static_cast<std::size_t>(first.height) / results.size();
        if (radii > radius_bin_count || rows > order_bin_count || first.pixels.size() != rows * radii * results.size())
            fail_size(name);
        std::vector<SideResiduals> errors(results.size(), SideResiduals{});
        std::size_t rings = 0;
        for (std::size_t j = 0; j < results.size(); ++j) {
            SideResult& to = results[j].sides[side];
            const auto line = [&](std::size_t i) {
                return orders.pixels.begin() +
                       static_cast<std::ptrdiff_t>((j * format::curved_order_lines + i) * order_bin_count);
            };
            to.radii = radii;
            to.power = curved_power(first, rows, j);
            to.mean_order.assign(line(0), line(1));
            to.order_variance.assign(line(1), line(2));
            to.harmonics = checked_harmonics({line(2), line(3)}, order_bin_count);
            to.harmonics.resize(row_count, 1);
            const std::vector<float> of_angle(line(3), line(3) + compared_albedos.size());
            copy_errors(of_angle, orders.name, errors[j][side].here);
            rings += ring_count(to.harmonics);
        }
        const std::vector<float> all_ratios = ratios(name + ".ratios", rings, radii);
        auto begin = all_ratios.begin();
        for (AngleResult& result : results) {
            SideResult& to = result.sides[side];
            const auto end = begin + static_cast<std::ptrdiff_t>(ring_count(to.harmonics) * radius_bin_count);
            to.ratios.assign(begin, end);
            begin = end;
        }
        const LdfLibrary library = consistent([&] {
            return LdfLibrary(medium, number(first, "photons"), number(first, "seed"), std::move(results),
                              std::move(errors));
        });
        return {attribute<double>(first, "curvature"), std::make_shared<LdfLibrary>(library)};
    }

    static std::vector<float> curved_power(const ExrPart& part, std::size_t rows, std::size_t angle)
    {
        const auto count = static_cast<std::ptrdiff_t>(rows) * part.width;
        const auto begin = part.pixels.begin() + static_cast<std::ptrdiff_t>(angle) * count;
        auto power =
            format::with_columns({begin, begin + count}, static_cast<std::size_t>(part.width), radius_bin_count);
        for (float& x : power)
            x /= format::curved_power_scale;
        power.resize(row_count * radius_bin_count, 0.0F);
        return power;
    }

    double checked_angle(const ExrPart& part, const std::string& name) const
    {
        const auto angle = attribute<double>(part, name);
        if (!(angle >= 0.0 && angle < 90.0))
            fail("has an angle out of range");
        return angle;
    }

    [[noreturn]] void fail(const std::string& why) const
    {
        throw IoError("'" + m_path + "' is not an LDF library: it " + why);
    }

    ExrPart* find(const std::string& name)
    {
        const auto part =
            std::find_if(m_parts.begin(), m_parts.end(), [&](const ExrPart& p) { return p.name == name; });
        return part == m_parts.end() ? nullptr : &*part;
    }

    template <class T>
    T attribute(const ExrPart& part, const std::string& name) const
    {
        const auto entry = part.attributes.find(name);
        if (entry == part.attributes.end() || !std::holds_alternative<T>(entry->second))
            fail("has no attribute '" + name + "' of the right type");
        return std::get<T>(entry->second);
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

    ExrPart& checked(const std::string& name)
    {
        ExrPart* part = find(name);
        if (!part)
            fail("has no part '" + name + "'");
        if (part->channels != std::vector<std::string>{"Y"})
            fail_size(name);
        const format::Checksum sum = format::checksum(*part);
        if (!sum.is_finite)
            fail("has a part '" + name + "' with values that are not finite");
        if (attribute<std::string>(*part, "checksum") != sum.text)
            fail("has a damaged part '" + name + "'");
        return *part;
    }

    [[noreturn]] void fail_size(const std::string& name) const { fail("has a part '" + name + "' of another size"); }

    // Values of a part in lines of radius bins. Bins that the part lacks are zero.
    std::vector<float> power(const ExrPart& part) const
    {
        if (part.width > static_cast<int>(radius_bin_count) || part.height > static_cast<int>(row_count))
            fail_size(part.name);
        auto values = format::with_columns(part.pixels, static_cast<std::size_t>(part.width), radius_bin_count);
        values.resize(row_count * radius_bin_count, 0.0F);
        return values;
    }

    std::vector<std::size_t> checked_harmonics(const std::vector<float>& values, std::size_t rows) const
    {
        std::vector<std::size_t> counts;
        for (const float count : values) {
            const bool fits = counts.size() < row_count && count >= 1.0F && count == std::floor(count) &&
                              count <= static_cast<float>(harmonics_of(counts.size()));
            if (!fits)
                fail("has an attribute 'harmonics' that is no list of their numbers");
            counts.push_back(static_cast<std::size_t>(count));
        }
        if (counts.size() != rows)
            fail("has an attribute 'harmonics' of another size");
        return counts;
    }

    // Number of stored rings of ratios in each radius bin.
    static std::size_t ring_count(const std::vector<std::size_t>& harmonics)
    {
        return std::accumulate(harmonics.begin(), harmonics.end(), std::size_t{0}) - harmonics.size();
    }

    std::vector<float> ratios(const std::string& name, std::size_t rings, std::size_t radii)
    {
        if (rings == 0)
            return {};
        ExrPart& part = checked(name);
        const std::size_t lines = format::ratio_lines(rings * radii);
        if (part.width != static_cast<int>(format::ratio_columns) || part.height != static_cast<int>(lines))
            fail_size(name);
        part.pixels.resize(rings * radii);
        return format::with_columns(part.pixels, radii, radius_bin_count);
    }

    // The largest part of a file: its pixels are moved, not copied.
    std::vector<float> scatter(ExrPart& part, const std::vector<std::size_t>& harmonics, std::size_t radii) const
    {
        if (part.height != static_cast<int>(group_count) ||
            part.pixels.size() != group_count * deviation_count(harmonics, radii))
            fail_size(part.name);
        return std::move(part.pixels);
    }

    void copy_errors(const std::vector<float>& values, const std::string& name,
                     std::array<float, compared_albedos.size()>& to) const
    {
        if (values.size() != to.size() ||
            !std::all_of(values.begin(), values.end(), [](float x) { return x >= 0.0F && std::isfinite(x); }))
            fail("has in '" + name + "' no list of errors");
        std::copy(values.begin(), values.end(), to.begin());
    }

    SideResiduals side_residuals(std::size_t j)
    {
        SideResiduals residuals{};
        for (std::size_t side = 0; side < side_count; ++side)
            if (const ExrPart* part = find(format::part_name(side, j)))
                for (const auto& [name, to] : {std::pair("residuals", &residuals[side].here),
                                               std::pair("residualsHalfway", &residuals[side].halfway)})
                    copy_errors(attribute<std::vector<float>>(*part, name), name, *to);
        return residuals;
    }

    SideResult side_result(const std::string& name)
    {
        SideResult result;
        const ExrPart& first = checked(name);
        result.radii = static_cast<std::size_t>(first.width);
        result.power = power(first);
        result.harmonics = checked_harmonics(attribute<std::vector<float>>(first, "harmonics"), row_count);
        result.ratios = ratios(name + ".ratios", ring_count(result.harmonics), result.radii);
        const ExrPart& orders = checked(name + ".orders");
        if (orders.width != static_cast<int>(order_bin_count) || orders.height != static_cast<int>(2 + batch_count))
            fail_size(orders.name);
        const auto line = [&](std::size_t i) {
            return orders.pixels.begin() + static_cast<std::ptrdiff_t>(i * order_bin_count);
        };
        result.mean_order.assign(line(0), line(1));
        result.order_variance.assign(line(1), line(2));
        result.batch_totals.assign(line(2), orders.pixels.end());
        result.deviations = scatter(checked(name + ".scatter"), result.harmonics, result.radii);
        return result;
    }

    std::string m_path;
    std::vector<ExrPart> m_parts;
};

}  // namespace

LdfLibrary load_library(const std::filesystem::path& path)
{
    return Reader(path.string()).library();
}

std::vector<CurvedPart> load_curved(const std::filesystem::path& path)
{
    return Reader(path.string()).curved();
}

}  // namespace beamspread
