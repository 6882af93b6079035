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
        if (!find(format::part_name(0, 0)))
            fail(m_parts.empty() ? "holds no parts" : "holds no plane");
        const LdfLibrary plane = of_prefix("", true);
        std::vector<CurvedPart> parts = curved();
        return parts.empty() ? plane : checked_whole([&] { return plane.with_curved(std::move(parts)); });
    }

    std::vector<CurvedPart> curved()
    {
        std::vector<CurvedPart> parts;
        while (const ExrPart* first = find(format::curved_prefix(parts.size()) + format::part_name(0, 0)))
            parts.push_back({attribute<double>(*first, "curvature"),
                             std::make_shared<LdfLibrary>(of_prefix(format::curved_prefix(parts.size()), false))});
        return parts;
    }

private:
    // The library whose parts' names begin with a prefix; of curved parts if it has no batches.
    LdfLibrary of_prefix(const std::string& prefix, bool has_batches)
    {
        const auto name = [&](std::size_t side, std::size_t j) { return prefix + format::part_name(side, j); };
        const ExrPart& first = *find(name(0, 0));
        const auto version = attribute<int>(first, "beamspreadLdf");
        const Medium medium{attribute<double>(first, "g"), attribute<double>(first, "ior"),
                            attribute<double>(first, "thickness")};
        if (version != format::version)
            fail("is of another format version");
        std::vector<AngleResult> results;
        std::vector<SideResiduals> residuals;
        const bool is_calibrated = first.attributes.contains("residuals");
        while (find(name(0, results.size())))
            results.emplace_back();
        parallel_for(results.size(),
                     [&](std::size_t j) { results[j] = angle_result(name(0, j), name(1, j), medium, has_batches); });
        for (std::size_t j = 0; is_calibrated && j < results.size(); ++j)
            residuals.push_back(side_residuals(name(0, j), name(1, j)));
        return checked_whole([&] {
            return LdfLibrary(medium, number(first, "photons"), number(first, "seed"), std::move(results),
                              std::move(residuals));
        });
    }

    template <class Make>
    LdfLibrary checked_whole(const Make& make) const
    {
        try {
            return make();
        } catch (const InvalidArgument& error) {
            fail(std::string("is inconsistent: ") + error.what());
        }
    }

    AngleResult angle_result(const std::string& reflected, const std::string& transmitted, const Medium& medium,
                             bool has_batches)
    {
        AngleResult result;
        result.angle_deg = attribute<double>(*find(reflected), "angle");
        if (!(result.angle_deg >= 0.0 && result.angle_deg < 90.0))
            fail("has an angle out of range");
        for (const auto& [side, name] : {std::pair(0, &reflected), std::pair(1, &transmitted)})
            if (find(*name))
                result.sides[static_cast<std::size_t>(side)] = side_result(*name, has_batches);
        if (result.sides[1].power.empty() != medium.is_half_space())
            fail("does not fit its own thickness");
        return result;
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

    std::vector<std::size_t> harmonics(const ExrPart& part) const
    {
        std::vector<std::size_t> counts;
        for (const float count : attribute<std::vector<float>>(part, "harmonics")) {
            const bool fits = counts.size() < row_count && count >= 1.0F && count == std::floor(count) &&
                              count <= static_cast<float>(harmonics_of(counts.size()));
            if (!fits)
                fail("has an attribute 'harmonics' that is no list of their numbers");
            counts.push_back(static_cast<std::size_t>(count));
        }
        if (counts.size() != row_count)
            fail("has an attribute 'harmonics' of another size");
        return counts;
    }

    std::vector<float> ratios(const std::string& name, const std::vector<std::size_t>& harmonics, std::size_t radii)
    {
        const std::size_t rings = std::accumulate(harmonics.begin(), harmonics.end(), std::size_t{0}) - row_count;
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

    void read_residuals(const ExrPart& part, const std::string& name,
                        std::array<float, compared_albedos.size()>& to) const
    {
        const auto values = attribute<std::vector<float>>(part, name);
        if (values.size() != to.size() ||
            !std::all_of(values.begin(), values.end(), [](float x) { return x >= 0.0F && std::isfinite(x); }))
            fail("has an attribute '" + name + "' that is no list of errors");
        std::copy(values.begin(), values.end(), to.begin());
    }

    SideResiduals side_residuals(const std::string& reflected, const std::string& transmitted)
    {
        SideResiduals residuals{};
        for (const auto& [side, name] : {std::pair(0, &reflected), std::pair(1, &transmitted)})
            if (const ExrPart* part = find(*name)) {
                Residuals& left = residuals[static_cast<std::size_t>(side)];
                read_residuals(*part, "residuals", left.here);
                read_residuals(*part, "residualsHalfway", left.halfway);
            }
        return residuals;
    }

    SideResult side_result(const std::string& name, bool has_batches)
    {
        SideResult result;
        const ExrPart& first = checked(name);
        result.radii = static_cast<std::size_t>(first.width);
        result.power = power(first);
        result.harmonics = harmonics(first);
        result.ratios = ratios(name + ".ratios", result.harmonics, result.radii);
        const ExrPart& orders = checked(name + ".orders");
        const std::size_t batches = has_batches ? batch_count : 0;
        if (orders.width != static_cast<int>(order_bin_count) || orders.height != static_cast<int>(2 + batches))
            fail_size(orders.name);
        const auto line = [&](std::size_t i) {
            return orders.pixels.begin() + static_cast<std::ptrdiff_t>(i * order_bin_count);
        };
        result.mean_order.assign(line(0), line(1));
        result.order_variance.assign(line(1), line(2));
        result.batch_totals.assign(line(2), orders.pixels.end());
        if (has_batches)
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
