#include "scene/bent_texels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/threads.h"

namespace beamspread {

namespace {

// Texel rows that a thread fills at a time. More: fewer tests of triangles, less parallel.
constexpr std::size_t rows_per_band = 32;

// Barycentric coordinate down to which a point counts as inside: rounding of centroids on an edge.
constexpr double inside_tolerance = 1e-9;

// Parts of texels that smaller ones count as none: rounding leaves them where edges run between texels.
constexpr double least_part = 1e-6;

// Part of a texel's area from which on it counts as whole.
constexpr double whole_fraction = 1.0 - 1e-6;

double cross(const Vec2& a, const Vec2& b)
{
    return a.x * b.y - a.y * b.x;
}

// Convex polygon of few corners: a triangle cut by the four sides of a texel has at most seven.
struct Convex {
    std::array<Vec2, 8> corners;
    std::size_t count = 0;

    void add(const Vec2& corner) { corners[count++] = corner; }
};

// The part of a polygon where sign * (coordinate - bound) >= 0 (Sutherland and Hodgman 1974, doi:10.1145/360767.360802).
Convex cut(const Convex& polygon, int axis, double bound, double sign)
{
    Convex part;
    for (std::size_t i = 0; i < polygon.count; ++i) {
        const Vec2& p = polygon.corners[i];
        const Vec2& q = polygon.corners[i + 1 < polygon.count ? i + 1 : 0];
        const double a = sign * (p[axis] - bound);
        const double b = sign * (q[axis] - bound);
        if (a >= 0.0)
            part.add(p);
        if ((a > 0.0 && b < 0.0) || (a < 0.0 && b > 0.0)) {
            Vec2 crossing = p + (q - p) * (a / (a - b));
            crossing[axis] = bound;
            part.add(crossing);
        }
    }
    return part;
}

// Area of a part of a texel, and the integrals of place over the area, and of squares of place from the texel's corner.
struct Moment {
    double area = 0.0;
    Vec2 first{};
    Vec2 squares{};        // x^2, y^2
    double product = 0.0;  // x y

    void add(const Moment& part)
    {
        area += part.area;
        first += part.first;
        squares += part.squares;
        product += part.product;
    }
    Vec2 centroid() const { return first / area; }
};

// Columns of the symmetric matrix that turns a whole texel to one of the same covariance as a part. Its scale is off where
// the part is no parallelogram.
std::array<Vec2, 2> shape_of(const Moment& part, const Vec2& corner)
{
    const Vec2 middle = part.centroid() - corner;
    const double of_square = 12.0;  // 1 over the variance of a square of side 1
    const double xx = of_square * (part.squares.x / part.area - middle.x * middle.x);
    const double yy = of_square * (part.squares.y / part.area - middle.y * middle.y);
    const double xy = of_square * (part.product / part.area - middle.x * middle.y);
    // The root of a symmetric matrix M of 2 x 2 is (M + sqrt(det M) I) / sqrt(tr M + 2 sqrt(det M)).
    const double root = std::sqrt(std::max(xx * yy - xy * xy, 0.0));
    const double scale = 1.0 / std::sqrt(xx + yy + 2.0 * root);
    return {Vec2(xx + root, xy) * scale, Vec2(xy, yy + root) * scale};
}

// `corner`: of the texel.
Moment moment_of(const Convex& polygon, const Vec2& corner)
{
    Moment sum;
    for (std::size_t i = 1; i + 1 < polygon.count; ++i) {
        const Vec2 o = polygon.corners[0] - corner;
        const Vec2 a = polygon.corners[i] - corner;
        const Vec2 b = polygon.corners[i + 1] - corner;
        const double area = 0.5 * std::abs(cross(a - o, b - o));
        const Vec2 all = o + a + b;
        sum.add({area, (corner + all / 3.0) * area, (o * o + a * a + b * b + all * all) * (area / 12.0),
                 (o.x * o.y + a.x * a.y + b.x * b.y + all.x * all.y) * (area / 12.0)});
    }
    return sum;
}

// A triangle in the texture, anticlockwise.
struct Mapped {
    std::array<Vec2, 3> corners;
    double area_ratio;  // m^2 in a texel; 0 for a triangle without an area in the texture
    Vec2 low, high;

    bool is_empty() const { return !(area_ratio > 0.0); }

    // Weights of the second and the third corner at a point.
    Vec2 weights(const Vec2& point) const
    {
        const Vec2 a = corners[1] - corners[0];
        const Vec2 b = corners[2] - corners[0];
        const Vec2 p = point - corners[0];
        return Vec2(cross(p, b), cross(a, p)) / cross(a, b);
    }

    bool holds(const Vec2& point) const
    {
        const Vec2 w = weights(point);
        return std::min({w.x, w.y, 1.0 - w.x - w.y}) >= -inside_tolerance;
    }
};

std::vector<Mapped> to_mapped(const MappedTriangles& triangles)
{
    std::vector<Mapped> mapped(triangles.texels.size() / 3);
    for (std::size_t t = 0; t < mapped.size(); ++t) {
        std::array<Vec2, 3> at = {triangles.texels[3 * t], triangles.texels[3 * t + 1], triangles.texels[3 * t + 2]};
        const Vec3* p = &triangles.positions[3 * t];
        const double area = 0.5 * glm::length(glm::cross(p[1] - p[0], p[2] - p[0]));
        const double texels = 0.5 * std::abs(cross(at[1] - at[0], at[2] - at[0]));
        if (cross(at[1] - at[0], at[2] - at[0]) < 0.0)
            std::swap(at[1], at[2]);
        const double ratio = texels > 0.0 ? area / texels : 0.0;
        mapped[t] = {.corners = at,
                     .area_ratio = std::isfinite(ratio) ? ratio : 0.0,
                     .low = glm::min(glm::min(at[0], at[1]), at[2]),
                     .high = glm::max(glm::max(at[0], at[1]), at[2])};
    }
    return mapped;
}

// First and last texel, exclusive, of an extent within [first, last).
struct Range {
    std::size_t begin, end;

    Range(double low, double high, std::size_t first, std::size_t last)
    {
        const double lowest = static_cast<double>(first);
        const double highest = static_cast<double>(last);
        begin = static_cast<std::size_t>(std::floor(std::clamp(low, lowest, highest)));
        end = static_cast<std::size_t>(std::ceil(std::clamp(high, lowest, highest)));
        if (end == begin && low < highest && high >= lowest && begin < last)
            ++end;  // a triangle that is thin, or that lies on a border of texels
    }
};

// Calls visit(x, y, moment) for each texel of rows [first, last) that a triangle covers.
template <class Visit>
void for_each_part(const Mapped& triangle, std::size_t first, std::size_t last, std::size_t width, const Visit& visit)
{
    const Range rows(triangle.low.y, triangle.high.y, first, last);
    const Range columns(triangle.low.x, triangle.high.x, 0, width);
    Convex whole;
    for (const Vec2& corner : triangle.corners)
        whole.add(corner);
    for (std::size_t y = rows.begin; y < rows.end; ++y) {
        const double bottom = static_cast<double>(y);
        const Convex strip = cut(cut(whole, 1, bottom, 1.0), 1, bottom + 1.0, -1.0);
        if (strip.count < 3)
            continue;
        // Texels between these columns are covered wholly: those at both ends of the strip, since it is convex.
        double low = std::numeric_limits<double>::infinity();
        double high = -low;
        std::array<double, 2> begins = {low, low};
        std::array<double, 2> ends = {high, high};
        for (std::size_t i = 0; i < strip.count; ++i) {
            const Vec2& corner = strip.corners[i];
            low = std::min(low, corner.x);
            high = std::max(high, corner.x);
            for (const std::size_t side : {std::size_t{0}, std::size_t{1}}) {
                if (corner.y == bottom + static_cast<double>(side)) {
                    begins[side] = std::min(begins[side], corner.x);
                    ends[side] = std::max(ends[side], corner.x);
                }
            }
        }
        const double full_begin = std::max(begins[0], begins[1]);
        const double full_end = std::min(ends[0], ends[1]);
        const Range within(low, high, columns.begin, columns.end);
        for (std::size_t x = within.begin; x < within.end; ++x) {
            const double left = static_cast<double>(x);
            if (left >= full_begin && left + 1.0 <= full_end) {
                visit(x, y, Moment{1.0, {left + 0.5, bottom + 0.5}, Vec2(1.0 / 3.0), 0.25});
                continue;
            }
            const Moment part = moment_of(cut(cut(strip, 0, left, 1.0), 0, left + 1.0, -1.0), {left, bottom});
            if (part.area > 0.0)
                visit(x, y, part);
        }
    }
}

struct Texel {
    Moment covered;       // in texels
    double area = 0.0;    // m^2
    Moment most{};        // of the triangle that covers most
    std::int32_t triangle = -1;  // the same, and later the one in which the centroid lies
    bool has_centroid = false;
};

Vec3 perpendicular(const Vec3& vector, const Vec3& normal)
{
    return vector - normal * glm::dot(vector, normal);
}

class Band {
public:
    Band(const MappedTriangles& triangles, const std::vector<Mapped>& mapped, std::size_t first, std::size_t last,
         std::size_t width)
        : m_triangles(triangles),
          m_mapped(mapped),
          m_first(first),
          m_last(last),
          m_width(width),
          m_texels((last - first) * width)
    {
        for (std::size_t t = 0; t < mapped.size(); ++t) {
            const bool is_inside =
                mapped[t].low.y < static_cast<double>(last) && mapped[t].high.y >= static_cast<double>(first);
            if (is_inside && !mapped[t].is_empty())
                m_chosen.push_back(t);
        }
    }

    void cover()
    {
        for (const std::size_t t : m_chosen) {
            for_each_part(m_mapped[t], m_first, m_last, m_width, [&](std::size_t x, std::size_t y, const Moment& part) {
                Texel& texel = at(x, y);
                texel.covered.add(part);
                texel.area += part.area * m_mapped[t].area_ratio;
                if (part.area > texel.most.area) {
                    texel.most = part;
                    texel.triangle = static_cast<std::int32_t>(t);
                }
            });
        }
    }

    // Finds the triangle that each centroid lies in, the first one of several.
    void find_centroids()
    {
        for (const std::size_t t : m_chosen) {
            const Range rows(m_mapped[t].low.y, m_mapped[t].high.y, m_first, m_last);
            const Range columns(m_mapped[t].low.x, m_mapped[t].high.x, 0, m_width);
            for (std::size_t y = rows.begin; y < rows.end; ++y) {
                for (std::size_t x = columns.begin; x < columns.end; ++x) {
                    Texel& texel = at(x, y);
                    if (texel.has_centroid || texel.triangle < 0 || !m_mapped[t].holds(texel.covered.centroid()))
                        continue;
                    texel.has_centroid = true;
                    texel.triangle = static_cast<std::int32_t>(t);
                }
            }
        }
    }

    void write(const BentTexels& result)
    {
        for (std::size_t y = m_first; y < m_last; ++y)
            for (std::size_t x = 0; x < m_width; ++x)
                write_texel(at(x, y), x, y, result);
    }

private:
    Texel& at(std::size_t x, std::size_t y) { return m_texels[(y - m_first) * m_width + x]; }

    void write_texel(const Texel& found, std::size_t x, std::size_t y, const BentTexels& result) const
    {
        const Texel texel = found.covered.area < least_part ? Texel{} : found;
        result.covered(y, x) = static_cast<float>(texel.covered.area);
        result.areas(y, x) = static_cast<float>(texel.area);
        result.triangles(y, x) = texel.triangle;
        result.positions(y, x) = {};
        result.steps_x(y, x) = result.steps_y(y, x) = result.normals(y, x) = result.tangents(y, x) = {};
        if (texel.triangle < 0)
            return;
        const auto first = 3 * static_cast<std::size_t>(texel.triangle);
        const Moment& part = texel.has_centroid ? texel.covered : texel.most;
        const Vec2 point = part.centroid();
        const Vec3* p = &m_triangles.positions[first];
        const Vec2* uv = &m_triangles.texels[first];
        const Vec3 along = p[1] - p[0];
        const Vec3 across = p[2] - p[0];
        const Vec2 a = uv[1] - uv[0];
        const Vec2 b = uv[2] - uv[0];
        const double twice_area = cross(a, b);
        const Vec2 w = glm::max(Vec2(cross(point - uv[0], b), cross(a, point - uv[0])) / twice_area, Vec2(0.0));
        result.positions(y, x) = p[0] + along * w.x + across * w.y;

        const Vec3 step_x = (along * b.y - across * a.y) / twice_area;
        const Vec3 step_y = (across * a.x - along * b.x) / twice_area;
        const double whole = glm::length(glm::cross(step_x, step_y));
        std::array<Vec3, 2> steps = {step_x, step_y};
        if (texel.area < whole_fraction * whole && part.area >= least_part) {
            const std::array<Vec2, 2> shape = shape_of(part, Vec2(x, y));
            for (std::size_t i = 0; i < 2; ++i)
                steps[i] = step_x * shape[i].x + step_y * shape[i].y;
            const double area = glm::length(glm::cross(steps[0], steps[1]));
            for (Vec3& step : steps)
                step *= area > 0.0 ? std::sqrt(texel.area / area) : 1.0;
        }
        result.steps_x(y, x) = Vec3f(steps[0]);
        result.steps_y(y, x) = Vec3f(steps[1]);

        const Vec3 face_normal = glm::normalize(glm::cross(along, across));
        const Vec3 normal = shading_normal(first, w, face_normal);
        Vec3 tangent = perpendicular(step_x, normal);
        if (!(glm::length(tangent) > 1e-6 * glm::length(step_x)))
            tangent = Frame(normal).x;
        result.normals(y, x) = Vec3f(normal);
        result.tangents(y, x) = Vec3f(glm::normalize(tangent));
    }

    Vec3 shading_normal(std::size_t first, const Vec2& w, const Vec3& face_normal) const
    {
        if (m_triangles.normals.empty())
            return face_normal;
        const Vec3f* n = &m_triangles.normals[first];
        const Vec3 sum = Vec3(n[0]) * (1.0 - w.x - w.y) + Vec3(n[1]) * w.x + Vec3(n[2]) * w.y;
        const double length = glm::length(sum);
        if (!(length > 1e-6))
            return face_normal;
        const Vec3 normal = sum / length;
        if (glm::dot(normal, face_normal) >= least_cosine)
            return normal;
        const Vec3 sideways = perpendicular(normal, face_normal);
        const double sine = glm::length(sideways);
        if (!(sine > 1e-6))
            return face_normal;
        return face_normal * least_cosine + sideways * (std::sqrt(1.0 - least_cosine * least_cosine) / sine);
    }

    const MappedTriangles& m_triangles;
    const std::vector<Mapped>& m_mapped;
    std::size_t m_first;
    std::size_t m_last;
    std::size_t m_width;
    std::vector<Texel> m_texels;
    std::vector<std::size_t> m_chosen;
};

template <class Vector>
bool is_finite(const Vector& vector)
{
    for (int i = 0; i < Vector::length(); ++i) {
        if (!std::isfinite(vector[i]))
            return false;
    }
    return true;
}

template <class Vector>
void check(const std::string& name, std::span<const Vector> corners, std::size_t count)
{
    if (corners.size() != count)
        reject(name, std::to_string(corners.size()) + " corners", "as many as texels, three for each triangle");
    if (!std::all_of(corners.begin(), corners.end(), is_finite<Vector>))
        reject(name, "not finite", "finite numbers");
}

}  // namespace

void find_bent_texels(const MappedTriangles& triangles, int threads, const BentTexels& texels)
{
    const std::size_t count = triangles.texels.size();
    if (count % 3 != 0)
        reject("texels", std::to_string(count) + " corners", "three corners for each triangle");
    check("texels", triangles.texels, count);
    check("positions", triangles.positions, count);
    if (!triangles.normals.empty())
        check("normals", triangles.normals, count);
    const std::vector<Mapped> mapped = to_mapped(triangles);
    const std::size_t height = texels.covered.height;
    const auto fill_band = [&](std::size_t index) {
        const std::size_t first = index * rows_per_band;
        Band band(triangles, mapped, first, std::min(first + rows_per_band, height), texels.covered.width);
        band.cover();
        band.find_centroids();
        band.write(texels);
    };
    with_threads(threads, [&] { parallel_for((height + rows_per_band - 1) / rows_per_band, fill_band); });
}

}  // namespace beamspread
