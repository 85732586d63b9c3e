#pragma once
// How triangles of a surface are divided into contact elements, and the corners of an element, for pictures.
#include <array>
#include <cstddef>

#include "plant_models/spatial.h"
#include "server/geometry/surface/contact_surface.h"

namespace takt {

using TriangleCorners = std::array<Vec3, 3>;

/// Its two halves, cut from the middle of the longest edge (the first of several as long) to the opposite
/// corner. `length_m` gets the length of that edge.
std::array<TriangleCorners, 2> halve_longest_edge(const TriangleCorners& piece, double& length_m);

/// Corners of one element, frame of the body. They are not kept: each call divides the element's triangle
/// again.
TriangleCorners element_corners_B(const ContactSurface& surface, std::size_t element);

}  // namespace takt
