// Small vectors: GLM behind one header.
#pragma once

#include <glm/common.hpp>
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

}  // namespace beamspread
