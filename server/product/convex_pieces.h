#pragma once
// Convex shapes of a body for the collision check.
#include <string>
#include <vector>

#include "server/geometry/mesh/triangle_mesh.h"
#include "server/product/product.h"

namespace takt::product {

/// How the collision check sees a body.
enum class ConvexMethod { hull, pieces, vhacd };

struct ConvexChoice {
  ConvexMethod method = ConvexMethod::hull;
  std::vector<std::vector<Vec3>> pieces;  ///< points of each convex piece, of method pieces
  double error = 0.0;  ///< share of the volume that the shapes lose or gain; of vhacd that of the hull
};

/// The hull where it gains at most `allowed` of the volume; else exact pieces of a stack of convex sections (a bolt) or of
/// a prism with holes (a plate), whose volume agrees with the body's within 1 %; else V-HACD, at load.
ConvexChoice choose_convex(const Body& body, double allowed = 0.05);

}  // namespace takt::product
