#include "ldf/samples/interpolate.h"

#include <cmath>

#include "base/error.h"
#include "ldf/samples/angular_space.h"
#include "ldf/samples/sample_grid.h"

namespace beamspread {

namespace {

// Default height of Q over the image's width, as in Manabe et al. 2012: 100 units over a window of 150.
constexpr double height_per_width = 2.0 / 3.0;

struct WeightedSample {
    const LdfSample* sample;
    double weight;
};

std::vector<WeightedSample> linear_weights(const SampleCell& cell)
{
    std::vector<WeightedSample> weighted;
    for (std::size_t i = 0; i < 2; ++i)
        for (std::size_t j = 0; j < 2; ++j)
            for (std::size_t k = 0; k < 2; ++k) {
                const double w = cell.angle.weight_of(i) * cell.albedo.weight_of(j) * cell.g.weight_of(k);
                if (w > 0.0)
                    weighted.push_back({cell.corners[i][j][k], w});
            }
    return weighted;
}

void blend_planar(LdfSample& result, const std::vector<WeightedSample>& weighted)
{
    for (std::size_t i = 0; i < result.image.size(); ++i) {
        double sum = 0.0;
        for (const auto& [sample, weight] : weighted)
            sum += weight * static_cast<double>(sample->image[i]);
        result.image[i] = static_cast<float>(sum);
    }
}

void blend_angular(LdfSample& result, const std::vector<WeightedSample>& weighted, double height)
{
    const Vec2 origin(0.0, 0.0);
    Vec2 brightest(0.0, 0.0);
    std::vector<AngularSpace> spaces;
    for (const auto& [sample, weight] : weighted) {
        spaces.emplace_back(origin, brightest_point(*sample), height);
        brightest += weight * spaces.back().brightest();
    }
    const AngularSpace space(origin, brightest, height);
    for (std::size_t y = 0; y < result.height; ++y) {
        for (std::size_t x = 0; x < result.width; ++x) {
            const AngularCoordinates at = space.to_angular(Vec2(result.u(x), result.v(y)));
            double sum = 0.0;
            for (std::size_t k = 0; k < weighted.size(); ++k)
                sum += weighted[k].weight * exitance_at(*weighted[k].sample, spaces[k].to_planar(at));
            result.image[y * result.width + x] = static_cast<float>(sum);
        }
    }
}

}  // namespace

LdfSample interpolate(const std::vector<const LdfSample*>& samples, double angle_deg, double albedo,
                      std::optional<double> g, Interpolation method, std::optional<double> height)
{
    if (height && method != Interpolation::angular)
        reject("height", *height, "None, except for method 'angular'");
    if (height && !(*height > 0.0 && std::isfinite(*height)))
        reject("height", *height, "height > 0 mean free paths");
    const SampleGrid grid(samples);
    const SampleCell cell = grid.cell(angle_deg, albedo, g);
    LdfSample result = *cell.corners[0][0][0];
    const std::vector<WeightedSample> weighted = linear_weights(cell);
    if (weighted.size() > 1) {
        switch (method) {
            case Interpolation::planar:
                blend_planar(result, weighted);
                break;
            case Interpolation::angular:
                blend_angular(result, weighted,
                              height.value_or(height_per_width * static_cast<double>(result.width) * result.pitch));
                break;
            case Interpolation::adaptive:
                result.image = adaptive_image(cell, angle_deg, albedo, g);
                break;
        }
    }
    result.angle_deg = angle_deg;
    result.albedo = albedo;
    if (g)
        result.g = g;
    return result;
}

}  // namespace beamspread
