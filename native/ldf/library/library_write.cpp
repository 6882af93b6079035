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

std::map<std::string, ExrAttribute> common_attributes(const LdfLibrary& library, double angle_deg)
{
    return {{"beamspreadLdf", format::version},
            {"g", library.medium().g},
            {"ior", library.medium().ior},
            {"thickness", library.medium().thickness},
            {"photons", std::to_string(library.photons())},
            {"seed", std::to_string(library.seed())},
            {"angle", angle_deg}};
}

// Appends the parts of one library. Results of a curved part have no batches and deviations.
void add_parts(const LdfLibrary& library, const std::string& prefix, const std::map<std::string, ExrAttribute>& more,
               std::vector<ExrPart>& parts)
{
    for (std::size_t j = 0; j < library.results().size(); ++j) {
        const AngleResult& result = library.results()[j];
        for (std::size_t side = 0; side < side_count; ++side) {
            const SideResult& from = result.sides[side];
            if (from.power.empty())
                continue;
            const std::string part_name = prefix + format::part_name(side, j);
            auto attributes = common_attributes(library, result.angle_deg);
            attributes.insert(more.begin(), more.end());
            auto first_attributes = attributes;
            first_attributes["harmonics"] = std::vector<float>(from.harmonics.begin(), from.harmonics.end());
            if (library.is_calibrated()) {
                const Residuals& left = library.residuals()[j][side];
                first_attributes["residuals"] = std::vector<float>(left.here.begin(), left.here.end());
                first_attributes["residualsHalfway"] = std::vector<float>(left.halfway.begin(), left.halfway.end());
            }
            const auto add = [&](const std::string& name, std::size_t columns, std::vector<float> values,
                                 const std::map<std::string, ExrAttribute>& with, bool half) {
                const std::size_t lines = values.size() / columns;
                parts.push_back(
                    {name, static_cast<int>(columns), static_cast<int>(lines), {"Y"}, std::move(values), with, half});
            };
            std::vector<float> power = format::with_columns(from.power, radius_bin_count, from.radii);
            power.resize(used_rows(from.power) * from.radii);
            add(part_name, from.radii, std::move(power), first_attributes, false);
            if (!from.ratios.empty()) {
                std::vector<float> ratios = format::with_columns(from.ratios, radius_bin_count, from.radii);
                ratios.resize(format::ratio_lines(ratios.size()) * format::ratio_columns, 0.0F);
                add(part_name + ".ratios", format::ratio_columns, std::move(ratios), attributes, true);
            }
            std::vector<float> orders = from.mean_order;
            orders.insert(orders.end(), from.order_variance.begin(), from.order_variance.end());
            orders.insert(orders.end(), from.batch_totals.begin(), from.batch_totals.end());
            add(part_name + ".orders", order_bin_count, std::move(orders), attributes, false);
            if (!from.deviations.empty())
                add(part_name + ".scatter", from.deviations.size() / group_count, from.deviations, attributes, true);
        }
    }
}

}  // namespace

void save_library(const LdfLibrary& library, const std::filesystem::path& path, bool with_plane)
{
    std::vector<ExrPart> parts;
    if (with_plane)
        add_parts(library, "", {}, parts);
    else if (library.curved().empty())
        reject("with_plane", "False", "True for a library without curvatures");
    for (std::size_t i = 0; i < library.curved().size(); ++i) {
        const CurvedPart& part = library.curved()[i];
        add_parts(*part.library, format::curved_prefix(i), {{"curvature", part.curvature}}, parts);
    }
    for (ExrPart& part : parts)
        part.attributes["checksum"] = format::checksum(part).text;
    write_exr_parts(path.string(), parts);
}

}  // namespace beamspread
