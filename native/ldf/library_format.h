// What readers and writers of library files agree on.
//
// Every part carries the attributes beamspreadLdf (format version), g, ior, thickness (mean free
// paths, inf: half-space), photons, seed, angle (degrees), centre (mean free paths) and a checksum of itself. For the
// j-th angle and each side, radius bins up to the last that is not empty (transport/bins.h), there are
//   "<side>.<j>"         columns: radius bins, lines: order bins up to the last that is not empty: power that leaves
//                        per unit power that entered; attribute harmonics: how many each order bin has; of a calibrated
//                        library also residuals and residualsHalfway (ldf/library.h);
//   "<side>.<j>.ratios"  means of cos(m phi) over each ring, weighted by power, m = 1 and on: [order bin][m][radius
//                        bin], without bins that are not counted apart (transport/simulation.h), in lines of a fixed
//                        length, filled up with zeros, half precision; left out where no order has any;
//   "<side>.<j>.orders"  columns: order bins; line 0 and 1: mean and variance of the order; then one
//                        line per batch: power that leaves;
//   "<side>.<j>.scatter" columns: [harmonic][radius bin], lines: albedos within groups of batches: deviations of the
//                        groups, half precision. Of media that are counted in finer radius bins (transport/
//                        counted_bins.h), columns: [albedo][harmonic][radius bin], lines: groups. Which bins there are at
//                        each albedo is in transport/map_scatter.h.
// One channel each: OpenEXR takes longer to sort channels into pixels than to read.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "image/exr.h"
#include "ldf/library.h"

namespace beamspread::library_format {

inline constexpr std::size_t ratio_columns = 2048;

// Goes up when the layout of a medium's files changes. Files come with the package: other media's need not change.
int version(const Medium& medium);

std::size_t scatter_lines(const Medium& medium);

std::string part_name(std::size_t side, std::size_t angle);

// Lines that hold so many values.
inline std::size_t ratio_lines(std::size_t values)
{
    return (values + ratio_columns - 1) / ratio_columns;
}

// Lines of another length: what is too long is cut off, what is missing filled up with zeros.
std::vector<float> with_columns(const std::vector<float>& values, std::size_t from_columns, std::size_t columns);

// What is counted of [ring][radius bin], ring after ring, and back; `orders`: each ring's order bin. How many values that
// are.
std::vector<float> packed(const Medium& medium, std::span<const std::size_t> orders, std::size_t radii,
                          std::span<const float> rings);
std::vector<float> unpacked(const Medium& medium, std::span<const std::size_t> orders, std::size_t radii,
                            std::span<const float> values);
std::size_t packed_size(const Medium& medium, std::span<const std::size_t> orders, std::size_t radii);

// The order bin of each ring of `ratios`.
std::vector<std::size_t> ratio_orders(std::span<const std::size_t> harmonics);

// Of everything but itself, and whether all values are finite.
struct Checksum {
    std::string text;
    bool is_finite;
};
Checksum checksum(const ExrPart& part);

}  // namespace beamspread::library_format
