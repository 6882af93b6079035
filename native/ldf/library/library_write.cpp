// Writes the files that ldf/library_format.h describes.
#include <algorithm>
#include <map>

#include "base/error.h"
#include "image/exr.h"
#include "ldf/library/ldf_library.h"
#include "ldf/library/library_format.h"

namespace beamspread {

namespace format = library_format;

namespace {

// Number of rows up to the last one with power; at least one.
std::size_t used_rows(const std::vector<float>& power)
{
    std::size_t used = 1;
    for (std::size_t bin = 0; bin < power.size(); ++bin)
        if (power[bin] != 0.0F)
            used = bin / radius_bin_count + 1;
    return used;
}

std::map<std::string, ExrAttribute> common_attributes(const LdfLibrary& library)
{
    return {{"beamspreadLdf", format::version},
            {"g", library.medium().g},
            {"ior", library.medium().ior},
            {"thickness", library.medium().thickness},
            {"photons", std::to_string(library.photons())},
            {"seed", std::to_string(library.seed())}};
}

ExrPart part_of(const std::string& name, std::size_t columns, std::vector<float> values,
                const std::map<std::string, ExrAttribute>& attributes, bool half)
{
    const std::size_t lines = values.size() / columns;
    return {name, static_cast<int>(columns), static_cast<int>(lines), {"Y"}, std::move(values), attributes, half};
}

// The part of ratios in lines of radius bins.
ExrPart ratio_part(const std::string& name, std::vector<float> ratios,
                   const std::map<std::string, ExrAttribute>& attributes)
{
    ratios.resize(format::ratio_lines(ratios.size()) * format::ratio_columns, 0.0F);
    return part_of(name, format::ratio_columns, std::move(ratios), attributes, true);
}

void add_plane(const LdfLibrary& library, std::vector<ExrPart>& parts)
{
    for (std::size_t j = 0; j < library.results().size(); ++j) {
        const AngleResult& result = library.results()[j];
        for (std::size_t side = 0; side < side_count; ++side) {
            const SideResult& from = result.sides[side];
            if (from.power.empty())
                continue;
            const std::string name = format::part_name(side, j);
            auto attributes = common_attributes(library);
            attributes["angle"] = result.angle_deg;
            auto first_attributes = attributes;
            first_attributes["harmonics"] = std::vector<float>(from.harmonics.begin(), from.harmonics.end());
            if (library.is_calibrated()) {
                const Residuals& left = library.residuals()[j][side];
                first_attributes["residuals"] = std::vector<float>(left.here.begin(), left.here.end());
                first_attributes["residualsHalfway"] = std::vector<float>(left.halfway.begin(), left.halfway.end());
            }
            std::vector<float> power = format::with_columns(from.power, radius_bin_count, from.radii);
            power.resize(used_rows(from.power) * from.radii);
            parts.push_back(part_of(name, from.radii, std::move(power), first_attributes, false));
            if (!from.ratios.empty())
                parts.push_back(ratio_part(
                    name + ".ratios", format::with_columns(from.ratios, radius_bin_count, from.radii), attributes));
            std::vector<float> orders = from.mean_order;
            orders.insert(orders.end(), from.order_variance.begin(), from.order_variance.end());
            orders.insert(orders.end(), from.batch_totals.begin(), from.batch_totals.end());
            parts.push_back(part_of(name + ".orders", order_bin_count, std::move(orders), attributes, false));
            parts.push_back(
                part_of(name + ".scatter", from.deviations.size() / group_count, from.deviations, attributes, true));
        }
    }
}

void add_curved(const CurvedPart& part, std::size_t i, std::vector<ExrPart>& parts)
{
    constexpr auto side = static_cast<std::size_t>(Side::reflected);
    const LdfLibrary& library = *part.library;
    auto attributes = common_attributes(library);
    attributes["curvature"] = part.curvature;
    std::size_t radii = 1;
    std::size_t rows = 1;
    for (std::size_t j = 0; j < library.results().size(); ++j) {
        const AngleResult& result = library.results()[j];
        attributes["angle." + std::to_string(j)] = result.angle_deg;
        radii = std::max(radii, result.sides[side].radii);
        rows = std::max(rows, used_rows(result.sides[side].power));
    }
    std::vector<float> power;
    std::vector<float> ratios;
    std::vector<float> orders;
    const auto append = [](const auto& values, std::size_t count, std::vector<float>& to) {
        const auto used = static_cast<std::ptrdiff_t>(std::min(count, values.size()));
        to.insert(to.end(), values.begin(), values.begin() + used);
        to.resize(to.size() + count - static_cast<std::size_t>(used), 0.0F);
    };
    for (std::size_t j = 0; j < library.results().size(); ++j) {
        const SideResult& from = library.results()[j].sides[side];
        append(format::with_columns(from.power, radius_bin_count, radii), rows * radii, power);
        const auto angle_ratios = format::with_columns(from.ratios, radius_bin_count, radii);
        append(angle_ratios, angle_ratios.size(), ratios);
        append(from.mean_order, order_bin_count, orders);
        append(from.order_variance, order_bin_count, orders);
        append(std::vector<float>(from.harmonics.begin(), from.harmonics.end()), order_bin_count, orders);
        append(library.residuals()[j][side].here, order_bin_count, orders);
    }
    for (float& x : power)
        x *= format::curved_power_scale;
    const std::string name = format::curved_name(i);
    parts.push_back(part_of(name, radii, std::move(power), attributes, true));
    if (!ratios.empty())
        parts.push_back(ratio_part(name + ".ratios", std::move(ratios), attributes));
    parts.push_back(part_of(name + ".orders", order_bin_count, std::move(orders), attributes, false));
}

}  // namespace

void save_library(const LdfLibrary& library, const std::filesystem::path& path, bool with_plane)
{
    std::vector<ExrPart> parts;
    if (with_plane)
        add_plane(library, parts);
    else if (library.curved().empty())
        reject("with_plane", "False", "True for a library without curvatures");
    for (std::size_t i = 0; i < library.curved().size(); ++i)
        add_curved(library.curved()[i], i, parts);
    for (ExrPart& part : parts)
        part.attributes["checksum"] = format::checksum(part).text;
    write_exr_parts(path.string(), parts);
}

}  // namespace beamspread
