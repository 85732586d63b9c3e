#pragma once
// Rays and boxes against the triangles of a closed mesh, exact up to rounding: what sensors see. No query allocates.
#include <vector>

#include "server/geometry/box_tree.h"
#include "server/geometry/mesh/triangle_mesh.h"

namespace takt {

class MeshRays {
 public:
  /// The mesh bounds a solid (check_closed()).
  explicit MeshRays(const TriangleMesh& mesh);

  const BodyBox& bounds() const { return tree_.bounds(); }
  /// The first point of the surface on the segment from p to q, as a share of its length in [0, 1], from either side of
  /// the surface (Moeller and Trumbore 1997). Above 1: none.
  double first_hit(const Vec3& p_B, const Vec3& q_B) const;
  /// Whether the point is inside the solid: the first surface on a long ray is seen from behind.
  bool contains(const Vec3& p_B) const;
  /// Whether the segment meets the surface, or lies inside the solid.
  bool meets_segment(const Vec3& p_B, const Vec3& q_B) const;
  /// Whether the box with this frame V and these half extents meets the surface (separating axes; Akenine-Moeller
  /// 2001), or one is inside the other.
  bool meets_box(const Pose& X_BV, const Vec3& half_m) const;

 private:
  struct Triangle {
    Vec3 a, b, c;
  };
  struct Hit {
    double share = 2.0;
    double along_normal = 0.0;  ///< of the direction, by the outward normal
  };
  Hit hit(const Vec3& p_B, const Vec3& q_B) const;

  std::vector<Triangle> triangles_;
  BoxTree tree_;
};

}  // namespace takt
