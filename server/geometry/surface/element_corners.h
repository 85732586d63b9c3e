#pragma once
// Division of a surface's triangles into contact elements, and the corners of an element, for pictures.
#include <array>
#include <cstddef>
#include <vector>

#include "plant_models/spatial.h"
#include "server/geometry/surface/contact_surface.h"

namespace takt {

using TriangleCorners = std::array<Vec3, 3>;

/// The two halves of a triangle, cut from the middle of its longest edge (the first of several equal ones) to
/// the opposite corner. `length_m` receives the length of that edge.
std::array<TriangleCorners, 2> halve_longest_edge(const TriangleCorners& piece, double& length_m);

/// Triangles that show one element, in the frame of the body: the element itself; a resampled one by its convex
/// hull. Each call divides the element's triangle again.
std::vector<TriangleCorners> element_triangles_B(const ContactSurface& surface, std::size_t element);

}  // namespace takt
