#pragma once
// Difference between a solid and the set of convex parts that approximates it.
#include <span>

#include "server/geometry/convex/overlap.h"
#include "server/geometry/mesh/triangle_mesh.h"

namespace takt {

/// Volumes in m^3, shares of the solid's volume.
struct VolumeComparison {
  double solid_volume = 0.0;
  double union_volume = 0.0;  ///< of the union of the parts: a volume that several parts share counts once
  double lost = 0.0;          ///< share of the solid that no part covers
  double gained = 0.0;        ///< volume of the parts outside the solid, as a share of the solid's
  double error() const { return lost + gained; }
};

/// Compares by parallel rays: along each axis of B, one ray through every cell of a regular grid, at a place
/// in the cell drawn with a fixed seed; lengths along a ray are exact. The shares are off by about 1e-3 for a
/// body of plain faces and repeat bit for bit. `solid` must be closed (check_closed); where several of its
/// surfaces enclose a point, that point counts once. Throws std::invalid_argument for a part without volume.
VolumeComparison compare_volumes(const TriangleMesh& solid, std::span<const ConvexShape> parts);

/// The same for the solid's own convex hull, in closed form: it loses nothing, and gains the difference of the
/// volumes. Where the shells of the solid may lie in each other, rays as above tell what counts once.
VolumeComparison compare_with_hull(const TriangleMesh& solid, const ConvexShape& hull);

}  // namespace takt
