// Small vectors: GLM behind one header.
#pragma once

#include <cmath>

#include <glm/common.hpp>
#include <glm/exponential.hpp>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vector_relational.hpp>

namespace beamspread {

using Vec2 = glm::dvec2;
using Vec3 = glm::dvec3;
using Vec2f = glm::vec2;
using Vec3f = glm::vec3;
using Mat3 = glm::dmat3;

// Orthonormal basis around a unit vector z (Duff et al. 2017, "Building an orthonormal basis, revisited", JCGT 6(1)).
struct Frame {
    Vec3 x, y, z;

    explicit Frame(const Vec3& axis) : z(axis)
    {
        const double sign = std::copysign(1.0, axis.z);
        const double a = -1.0 / (sign + axis.z);
        const double b = axis.x * axis.y * a;
        x = {1.0 + sign * axis.x * axis.x * a, sign * b, -sign * axis.x};
        y = {b, sign + axis.y * axis.y * a, -axis.y};
    }

    Vec3 to_world(const Vec3& v) const { return x * v.x + y * v.y + z * v.z; }
};

}  // namespace beamspread
