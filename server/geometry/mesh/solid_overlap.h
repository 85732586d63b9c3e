#pragma once
// How deep one solid is inside another, by their triangle meshes: for what is told of collisions and of
// overlap at the start. Convex shapes answer where they stand for the solid; a mesh knows its own pockets and
// holes.
//
// The depth of a point is its distance to the surface of the solid that it is in. Looked at are points of the
// edges of either mesh, divided so that no face is without edges, and fewer where many faces are in one
// plane: in the middle of each stretch between two faces of the other solid, so that no wall is too thin to
// be seen. What is found is a lower bound of the deepest point's depth, and zero for solids that only touch.
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

  /// Distance of a point to the surface (m); where it is at most `enough_m` some number that small.
  double distance(const Vec3& p_B, double enough_m) const;
  bool contains(const Vec3& p_B) const;

 private:
  friend class OverlapSearch;
  static constexpr std::size_t kCrossings = 64;
  struct Edge {
    std::uint32_t from, to;
  };
  int winding(const Vec3& p_B, const Vec3& d_B) const;

  std::vector<Vec3> vertices_;  ///< of the mesh, then of its divided edges
  std::vector<std::array<std::uint32_t, 3>> triangles_;
  std::vector<Edge> edges_;
  BoxTree faces_, edge_tree_;
};

struct SolidOverlap {
  double depth_m = 0.0;  ///< 0: no point is deeper than asked for
  Vec3 p_W = Vec3::Zero();
};

/// The deepest point found of one in the other, if it is deeper than `deeper_than_m`. Does not allocate; the
/// same arguments give the same bits.
SolidOverlap solid_overlap(const SolidProbe& a, const Pose& X_WA, const SolidProbe& b, const Pose& X_WB,
                           double deeper_than_m);

}  // namespace takt
