#include "scene/node_noise.h"

#include <algorithm>

namespace beamspread {

namespace {

// Averages `count` values that lie `stride` apart. The spline gives the border's nodes their own values.
void smooth_line(double* values, std::size_t count, std::size_t stride, double nodes)
{
    std::vector<double> line(count);
    for (std::size_t i = 0; i < count; ++i) {
        const double at = values[i * stride];
        const bool is_border = i == 0 || i + 1 == count;
        line[i] = is_border ? at : (4.0 * at + values[(i - 1) * stride] + values[(i + 1) * stride]) / 6.0;
    }
    const auto reach = static_cast<std::size_t>(std::min(nodes, static_cast<double>(count)));
    for (std::size_t i = 0; i < count; ++i) {
        const std::size_t first = i - std::min(i, reach);
        const std::size_t last = std::min(i + reach, count - 1);
        double sum = 0.0;
        for (std::size_t k = first; k <= last; ++k)
            sum += line[k];
        values[i * stride] = sum / static_cast<double>(last - first + 1);
    }
}

}  // namespace

std::vector<double> smoothed(const std::vector<double>& values, std::size_t columns, double nodes_x, double nodes_y)
{
    std::vector<double> result = values;
    const std::size_t rows = values.size() / columns;
    for (std::size_t y = 0; y < rows; ++y)
        smooth_line(&result[y * columns], columns, 1, nodes_x);
    for (std::size_t x = 0; x < columns; ++x)
        smooth_line(&result[x], rows, columns, nodes_y);
    return result;
}

}  // namespace beamspread
