// Averages of errors at nodes, as results average them.
#pragma once

#include <cstddef>
#include <vector>

namespace beamspread {

// Values at the nodes of a grid of so many columns, averaged as by the cubic spline of bake/field_light.h, and over squares
// of so many nodes to each side, which a medium's spread stands for.
std::vector<double> smoothed(const std::vector<double>& values, std::size_t columns, double nodes_x, double nodes_y);

}  // namespace beamspread
