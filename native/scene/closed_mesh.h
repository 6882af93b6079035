// Meshes that are the border of a body, whose backs nobody sees from outside.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "scene/occluder_mesh.h"

namespace beamspread {

// True if from outside a mesh the fronts of its triangles hide their backs. Vertices at the same position count as one.
//
// Each edge must have as many triangles along it as against it: then the number of times that the mesh winds around a point
// only changes at triangles, by 1. No triangle may lie on another, and rays from the backs of some thousand places must
// all meet the mesh again: those from the backs of a mesh that is turned inside out, or that crosses itself so that parts
// are, would not. The places lie on the triangles of the indices `glowing`, on all without it. Of their area, parts of less
// than two thousandths may be missed.
//
// Throws InvalidArgument for a position that is not finite, or an index out of range.
bool is_closed(std::span<const Vec3> vertices, std::span<const Triangle> triangles,
               std::optional<std::span<const std::uint32_t>> glowing);

}  // namespace beamspread
