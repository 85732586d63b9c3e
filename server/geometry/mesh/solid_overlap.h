#pragma once
// Penetration depth of two solids from their triangle meshes, for reports of collisions and of overlap at the
// start. Meshes contain pockets and holes that convex shapes lack.
//
// The depth of a point is its distance to the surface of the solid that contains it. The examined points lie
// on the edges of both meshes. The edges are divided so that every face has some, with fewer in planes of
// many faces. Each stretch of an edge between two faces of the other solid gives its middle point, so that
// even a thin wall is found. The result is a lower bound of the deepest point's depth; it is zero for solids
// that only touch.
#include <cstdint>
#include <vector>

#include "server/geometry/box_tree.h"
#include "server/geometry/mesh/triangle_mesh.h"

namespace takt {

class SolidProbe {
 public:
  /// `mesh` must be closed (check_closed).
  explicit SolidProbe(const TriangleMesh& mesh);

  const BodyBox& box() const { return faces_.bounds(); }

  /// Distance of a point to the surface (m); any value <= `enough_m` if the distance is at most `enough_m`.
  double distance(const Vec3& p_B, double enough_m) const;
  bool contains(const Vec3& p_B) const;

 private:
  friend class OverlapSearch;
  static constexpr std::size_t kCrossings = 64;
  struct Edge {
    std::uint32_t from, to;
  };
  int winding(const Vec3& p_B, const Vec3& d_B) const;

  std::vector<Vec3> vertices_;  ///< of the mesh, followed by those of its divided edges
  std::vector<std::array<std::uint32_t, 3>> triangles_;
  std::vector<Edge> edges_;
  BoxTree faces_, edge_tree_;
};

struct SolidOverlap {
  double depth_m = 0.0;  ///< 0: no examined point is deeper than the limit
  Vec3 p_W = Vec3::Zero();
};

/// The deepest examined point of one solid in the other, if it is deeper than `deeper_than_m`. Does not
/// allocate; the same arguments give the same bits.
SolidOverlap solid_overlap(const SolidProbe& a, const Pose& X_WA, const SolidProbe& b, const Pose& X_WB,
                           double deeper_than_m);

}  // namespace takt
