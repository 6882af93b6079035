// Texels of a texture on the faces of any mesh: where each lies, which way it faces, and how much of the surface it shows.
#pragma once

#include <cstdint>
#include <span>

#include "base/vec.h"
#include "base/view.h"

namespace beamspread {

// Triangles, three corners each. They are anticlockwise seen from the side that light falls on; their UVs may have either
// orientation and reach beyond the grid.
struct MappedTriangles {
    std::span<const Vec2> texels;  // columns and rows: texel (x, y) spans [x, x + 1] x [y, y + 1]
    std::span<const Vec3> positions;  // world, metres
    std::span<const Vec3f> normals;  // shading normals of any length, interpolated over each triangle; empty: its own
};

// Values of texels. Those that no triangle covers are 0, and their triangle is -1.
struct BentTexels {
    View2D<float>
        covered;  // sum over triangles of the fraction of the texel that each covers; above 1 where they overlap
    View2D<float> areas;  // area of the surface in the texel, m^2: the sum over triangles
    // The rest is that of one point: the centroid of the covered part, on the triangle that it lies in. Where it lies in
    // none, between two islands, it is the centroid of the part of the triangle that covers most.
    View2D<Vec3> positions;
    // Change of position along columns and rows, metres, in the plane of the triangle. Of a texel that shows less than a
    // whole one they are the sides of a parallelogram with the area and covariance of the covered part.
    View2D<Vec3f> steps_x;
    View2D<Vec3f> steps_y;
    View2D<Vec3f> normals;  // unit; at least `least_cosine` toward the triangle's own normal
    View2D<Vec3f> tangents;  // unit, along the columns and at right angles to the normal
    View2D<std::int32_t> triangles;
};

// Least cosine between a shading normal and that of the triangle; shading normals beyond are tilted toward it.
inline constexpr double least_cosine = 0.1;

// Triangles without an area in the texture cover nothing. Throws InvalidArgument.
void find_bent_texels(const MappedTriangles& triangles, int threads, const BentTexels& texels);

}  // namespace beamspread
