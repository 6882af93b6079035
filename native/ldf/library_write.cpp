// Writes the files that ldf/library_format.h describes.
#include <algorithm>
#include <map>

#include "image/exr.h"
#include "ldf/library.h"
#include "ldf/library_format.h"

namespace beamspread {

namespace format = library_format;

namespace {

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
    return {{"beamspreadLdf", format::version},
            {"g", library.medium().g},
            {"ior", library.medium().ior},
            {"thickness", library.medium().thickness},
            {"photons", std::to_string(library.photons())},
            {"seed", std::to_string(library.seed())},
            {"angle", angle_deg},
            {"centre", centre}};
}

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
            std::vector<float> power = format::with_columns(from.power, radius_bin_count, used.radii);
            power.resize(used.orders * used.radii);
            add(format::part_name(side, j), used.radii, std::move(power), first_attributes, false);
            if (!from.ratios.empty()) {
                std::vector<float> ratios =
                    format::packed(library.medium(), format::ratio_orders(from.harmonics), used.radii, from.ratios);
                ratios.resize(format::ratio_lines(ratios.size()) * format::ratio_columns, 0.0F);
                add(format::part_name(side, j) + ".ratios", format::ratio_columns, std::move(ratios), attributes, true);
            }
            std::vector<float> orders = from.mean_order;
            orders.insert(orders.end(), from.order_variance.begin(), from.order_variance.end());
            orders.insert(orders.end(), from.batch_totals.begin(), from.batch_totals.end());
            add(format::part_name(side, j) + ".orders", order_bin_count, std::move(orders), attributes, false);
            const std::vector<std::size_t> scatter_orders(from.deviations.size() / radius_bin_count, 0);
            std::vector<float> scatter = format::packed(library.medium(), scatter_orders, used.radii, from.deviations);
            const std::size_t scatter_columns = scatter.size() / format::scatter_lines;
            add(format::part_name(side, j) + ".scatter", scatter_columns, std::move(scatter), attributes, true);
        }
    }
    for (ExrPart& part : parts)
        part.attributes["checksum"] = format::checksum(part).text;
    write_exr_parts(path, parts);
}

}  // namespace beamspread
