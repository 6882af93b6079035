// Layout of library files, shared by reader and writer.
//
// Every part carries the attributes beamspreadLdf (format version), g, ior, thickness (mean free
// paths, inf: half-space), photons, seed, angle (degrees) and a checksum of itself. For the
// j-th angle and each side there are these parts, with radius bins up to the last that is not empty and rows as in
// transport/tally/bins.h:
//   "<side>.<j>"         columns: radius bins, lines: rows up to the last that is not empty: power that leaves
//                        per unit power that entered; attribute harmonics: their number in each row; calibrated
//                        libraries also have residuals and residualsHalfway (ldf/library/ldf_library.h);
//   "<side>.<j>.ratios"  means of cos(m phi) over each ring, weighted by power, m = 1 and on: [row][m][radius
//                        bin], in lines of a fixed length, filled up with zeros, half precision; left out if no row
//                        has any;
//   "<side>.<j>.orders"  columns: order bins; line 0 and 1: mean and variance of the order; then one
//                        line per batch: power that leaves;
//   "<side>.<j>.scatter" columns: [pole][albedo][harmonic][radius bin], lines: groups of batches: their deviations
//                        (transport/tally/tally.h), half precision.
// Curved surfaces follow, by ascending curvatures; a file may have these alone. The parts of the i-th have an attribute
// curvature (1 / mean free path), the attributes angle.<j> (degrees) instead of angle, and all angles together:
//   "curved.<i>"         columns: radius bins, lines: for each angle the order bins up to the last that is not empty:
//                        power times `curved_power_scale`, half precision;
//   "curved.<i>.ratios"  as above, for each angle;
//   "curved.<i>.orders"  columns: order bins; lines: for each angle the mean and the variance of the order, the number
//                        of harmonics, and the relative standard errors at `compared_albedos`.
// Each part has one channel, because sorting channels into pixels takes OpenEXR longer than reading.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "image/exr.h"
#include "ldf/library/ldf_library.h"

namespace beamspread::library_format {

// Values in a line of ratios, whose rows have many lengths. Part of the layout.
inline constexpr std::size_t ratio_columns = 2048;

// Version of the layout; a change makes files of earlier versions unreadable.
inline constexpr int version = 8;

std::string part_name(std::size_t side, std::size_t angle);

// Name of the i-th curved surface's first part.
std::string curved_name(std::size_t i);

// Lines of each angle among the orders of a curved surface.
inline constexpr std::size_t curved_order_lines = 4;

// Factor that keeps powers of curved surfaces, at most 1, in half precision's range.
inline constexpr float curved_power_scale = 1 << 14;

// Number of lines for this number of values.
inline std::size_t ratio_lines(std::size_t values)
{
    return (values + ratio_columns - 1) / ratio_columns;
}

// The values in lines of another length, cut off or filled up with zeros.
std::vector<float> with_columns(const std::vector<float>& values, std::size_t from_columns, std::size_t columns);

// Sum over all of a part but its own checksum; `is_finite` is true if all values are finite.
struct Checksum {
    std::string text;
    bool is_finite;
};
Checksum checksum(const ExrPart& part);

}  // namespace beamspread::library_format
