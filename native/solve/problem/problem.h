// The task of a solver: light on a plane of texels, and the media beneath.
#pragma once

#include <cstddef>
#include <variant>
#include <vector>

#include "base/vec.h"
#include "base/view.h"
#include "ldf/radial/ldf_source.h"
#include "solve/problem/smooth_light.h"

namespace beamspread {

// Rectangle of texels.
struct PlanePart {
    std::size_t y = 0;
    std::size_t x = 0;
    std::size_t height = 0;
    std::size_t width = 0;
};

// The part with a texel; null if none has it.
const PlanePart* part_with(const std::vector<PlanePart>& parts, std::size_t y, std::size_t x);

// A plane of texels. Texel (0, 0) lies at the origin of the plane frame: x runs along rows, y from row to row, z
// outward. The plane may consist of rectangular parts. Light does not cross the dark gaps between them; without gaps, the
// solver `fft` keeps it on its part.
struct Plane {
    std::size_t width = 0;
    std::size_t height = 0;
    double pitch_x = 1.0;  // metres
    double pitch_y = 1.0;
    double extent = 0.0;  // largest distance of two texels of a part, metres; 0: the plane is one part
    double gap = 0.0;     // least distance of texels of different parts, metres; 0: parts may touch
    std::vector<PlanePart> parts{};  // outside of these no luminance is wanted; empty: the plane is one part

    std::size_t texels() const { return width * height; }

    // True if light has to be kept on its part.
    bool is_divided() const { return !parts.empty() && gap == 0.0; }

    // The part with a texel; null in a gap.
    const PlanePart* part_of(std::size_t y, std::size_t x) const { return part_with(parts, y, x); }
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

// Angle of incidence in degrees from tan(theta / 2).
double angle_deg(double half_tangent);

// The medium of a color channel, and the side that light leaves.
struct ChannelMedium {
    const LdfSource* ldf = nullptr;
    double albedo = 0.0;
    double mean_free_path = 1.0;  // metres
    Side side = Side::reflected;  // of the luminance: where light enters, or the far side of a slab

    bool operator==(const ChannelMedium&) const = default;
};

// Light at few texels that are spread over a part of the plane.
struct SurveyedLight {
    Plane plane;
    double texels_each = 1.0;  // texels of the plane that each of these stands for
    PlaneLight light;
};

// Light that will be added to a light field later. It decides which terms the field keeps.
struct ComingLight {
    // All of that light: its angles and colors.
    std::vector<SurveyedLight> survey;

    // Some of that light at all texels; terms are chosen for its luminance. Empty: for any light of the survey's
    // angles.
    std::vector<PlaneLight> examples;

    // Some of that light, which needs terms besides.
    std::vector<SmoothLight> smooth;

    double irradiance = 0.0;  // mean over texels and channels that errors of smooth light count against, W/m^2
};

enum class Solver { fft, direct, adaptive };

struct Problem {
    Plane plane;
    std::vector<ChannelMedium> channels;
    std::vector<PlaneLight> lights;
    Solver solver = Solver::fft;
    double tolerance = 1e-3;  // largest relative error of the luminance by an approximating solver
    int threads = 0;          // 0: all
    std::size_t memory = std::size_t{5} << 26;  // bytes of spectra at once; larger planes are solved in tiles
    std::size_t coarsening = 0;  // texels per node of the coarse grid of solver `fft`; 1: no such grid, 0: the fastest
    ComingLight coming{};
    std::size_t max_moment_bytes = 0;  // bytes of moments of coming light; 0: any
    // Solver `fft`: factors of all light where it enters, [texel][channel]; null: 1. Lights that channels share stay
    // shared, and one channel after the other is colored and spread.
    const float* entering = nullptr;
};

// Throws InvalidArgument for a plane, media, light or options that solvers don't cover.
void validate(const Problem& problem);

// Sets values below 0 to 0: rounding of sums, above all of transforms, leaves such values where it is dark.
void clip_negative(float* values, std::size_t count);

// Sets of channels with proportional light: each channel's light is a factor times that of its set. Lights of one
// colour make one set, lights of different colours at most one per channel. Channels of one set and medium share a
// result. Channels of different factors of entering light are in different sets, whose light is proportional until it
// enters.
struct ChannelSets {
    struct Member {
        std::size_t channel;
        double factor;
    };
    struct Result {
        std::size_t set;
        std::size_t medium;
        std::vector<Member> members;
    };

    explicit ChannelSets(const Problem& problem);

    std::size_t count() const { return m_reference.size(); }

    // The reference channel of a set, and a light's colour in it.
    std::size_t channel(std::size_t set) const { return m_reference[set]; }
    double color(const PlaneLight& light, std::size_t set) const { return light.color[m_reference[set]]; }

    // The results of a set, ascending.
    std::vector<std::size_t> results_of(std::size_t set) const;

    // The first set whose light is proportional until it enters, and the factor of this set's light to it.
    std::size_t source(std::size_t set) const { return m_sources[set].set; }
    double source_factor(std::size_t set) const { return m_sources[set].factor; }

    std::vector<ChannelMedium> media;
    std::vector<Result> results;

private:
    struct Source {
        std::size_t set;
        double factor;
    };

    std::vector<std::size_t> m_reference;  // [set]
    std::vector<Source> m_sources;  // [set]
};

}  // namespace beamspread
