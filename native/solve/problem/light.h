// Light that arrives on a plane of texels.
#pragma once

#include <cstddef>
#include <variant>
#include <vector>

#include "base/vec.h"
#include "base/view.h"

namespace beamspread {

// A plane of texels. Texel (0, 0) lies at the origin of the plane frame: x runs along rows, y from row to row, z
// outward.
struct Plane {
    std::size_t width = 0;
    std::size_t height = 0;
    double pitch_x = 1.0;  // metres
    double pitch_y = 1.0;

    std::size_t texels() const { return width * height; }
};

struct Texel {
    std::size_t y;
    std::size_t x;
};

// Part of a row of texels.
struct RowSpan {
    std::size_t y;
    std::size_t x;
    std::size_t width;
};

// Directions along which light travels, unit vectors of the plane frame with z < 0.
struct OneDirection {
    Vec3 travel{0.0, 0.0, -1.0};
};
struct FromPoint {
    Vec3 position{};  // metres, z > 0; light travels from here to the middles of texels
};
struct PerTexel {
    const float* travel = nullptr;  // (height, width, 3) row by row
};
using Directions = std::variant<OneDirection, FromPoint, PerTexel>;

// One light on a plane.
struct PlaneLight {
    View2D<const float> irradiance;  // W/m^2 at colour 1
    Directions directions;
    std::vector<double> color;  // [channel], >= 0
};

// Light with an irradiance for each channel: one light if channels are proportional, else one per channel.
std::vector<PlaneLight> lights_of_channels(const std::vector<View2D<const float>>& irradiance,
                                           const Directions& directions);

// Rays of one light, one at each texel of a part of a row.
struct RayRow {
    std::size_t y;
    std::size_t x;
    std::size_t width;
    const float* travel;      // [texel][x, y, z], of any length; z < 0
    const float* irradiance;  // [texel][channel], W/m^2
};

// The angles of a light in part of a row.
struct BeamRow {
    std::vector<float> irradiance;
    std::vector<float> cos_beta;  // azimuth of travel
    std::vector<float> sin_beta;
    std::vector<float> half_tangent;  // tan(theta / 2), smooth everywhere and computed without trigonometry
    std::vector<float> travel;        // working memory

    // Reads part of a row. False if all of it is dark; the angles are not set then.
    bool read(const Plane& plane, const PlaneLight& light, const RowSpan& span);
};

// The brightest texel; the first one, row by row, of several.
Texel brightest(const View2D<const float>& irradiance);

// Direction of the beam at a texel, of any length.
Vec3 travel_at(const Plane& plane, const Directions& directions, std::size_t y, std::size_t x);

// Angle of incidence in degrees and azimuth in radians of a direction of travel.
double incidence_deg(const Vec3& travel);
double azimuth(const Vec3& travel);

}  // namespace beamspread
