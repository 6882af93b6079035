// What readers and writers of library files agree on.
//
// Every part carries the attributes beamspreadLdf (format version), g, ior, thickness (mean free
// paths, inf: half-space), photons, seed, angle (degrees) and a checksum of itself. For the
// j-th angle and each side, radius bins up to the last that is not empty, rows as in transport/bins.h, there are
//   "<side>.<j>"         columns: radius bins, lines: rows up to the last that is not empty: power that leaves
//                        per unit power that entered; attribute harmonics: how many each row has; of a calibrated
//                        library also residuals and residualsHalfway (ldf/library/ldf_library.h);
//   "<side>.<j>.ratios"  means of cos(m phi) over each ring, weighted by power, m = 1 and on: [row][m][radius
//                        bin], in lines of a fixed length, filled up with zeros, half precision; left out where no row
//                        has any;
//   "<side>.<j>.orders"  columns: order bins; line 0 and 1: mean and variance of the order; then one
//                        line per batch: power that leaves;
//   "<side>.<j>.scatter" columns: [pole][albedo][harmonic][radius bin], lines: groups of batches: their deviations
//                        (transport/tally/tally_statistics.h), half precision.
// One channel each: OpenEXR takes longer to sort channels into pixels than to read.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "image/exr.h"
#include "ldf/library/ldf_library.h"

namespace beamspread::library_format {

// Values in a line of ratios, which come in rows of many lengths: part of the layout, like the version.
inline constexpr std::size_t ratio_columns = 2048;

// Goes up when the layout changes.
inline constexpr int version = 8;

std::string part_name(std::size_t side, std::size_t angle);

// Lines that hold so many values.
inline std::size_t ratio_lines(std::size_t values)
{
    return (values + ratio_columns - 1) / ratio_columns;
}

// Lines of another length: what is too long is cut off, what is missing filled up with zeros.
std::vector<float> with_columns(const std::vector<float>& values, std::size_t from_columns, std::size_t columns);

// Of everything but itself, and whether all values are finite.
struct Checksum {
    std::string text;
    bool is_finite;
};
Checksum checksum(const ExrPart& part);

}  // namespace beamspread::library_format
