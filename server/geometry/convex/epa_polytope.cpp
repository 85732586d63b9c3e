#include "server/geometry/convex/epa_polytope.h"

#include <algorithm>

namespace takt {

bool Polytope::add_face(int i, int j, int k, double thinnest) {
  if (face_count_ == kMaxFaces) return false;
  const Vec3& a = corners_[static_cast<std::size_t>(i)].y;
  const Vec3 normal =
      (corners_[static_cast<std::size_t>(j)].y - a).cross(corners_[static_cast<std::size_t>(k)].y - a);
  const double length = normal.norm();
  if (!(length > thinnest * size_ * size_)) return false;
  Face& face = faces_[static_cast<std::size_t>(face_count_++)];
  face.corner = {i, j, k};
  face.normal = normal / length;
  face.offset = face.normal.dot(a);
  return true;
}

bool Polytope::begin(const Simplex& simplex, Difference& difference, double size) {
  size_ = size;
  corner_count_ = simplex.count;
  for (int i = 0; i < simplex.count; ++i) corners_[static_cast<std::size_t>(i)] = simplex.corner[i];
  const double flat = 1e-9 * size;
  while (corner_count_ < 4) {
    // Directions normal to the simplex; at least one of the two signs leads away from it.
    const Vec3& y0 = corners_[0].y;
    Vec3 across[3] = {Vec3::UnitX(), Vec3::UnitY(), Vec3::UnitZ()};
    int directions = 3;
    if (corner_count_ == 2) {
      const Vec3 u = (corners_[1].y - y0).normalized();
      across[0] = u.unitOrthogonal();
      across[1] = u.cross(across[0]);
      directions = 2;
    } else if (corner_count_ == 3) {
      across[0] = (corners_[1].y - y0).cross(corners_[2].y - y0).normalized();
      directions = 1;
    }
    bool found = false;
    for (int i = 0; i < directions && !found; ++i) {
      for (const double sign : {1.0, -1.0}) {
        const Vec3 n = sign * across[i];
        const SimplexCorner corner = difference.extreme(n);
        if (!(n.dot(corner.y - y0) > flat)) continue;
        corners_[static_cast<std::size_t>(corner_count_++)] = corner;
        found = true;
        break;
      }
    }
    if (!found) return false;
  }
  const Vec3& a = corners_[0].y;
  const double volume = (corners_[1].y - a).cross(corners_[2].y - a).dot(corners_[3].y - a);
  if (volume > 0.0) std::swap(corners_[1], corners_[2]);  // faces 0 1 2 and so on are directed outwards
  face_count_ = 0;
  return add_face(0, 1, 2, 0.0) && add_face(0, 3, 1, 0.0) && add_face(0, 2, 3, 0.0) && add_face(1, 3, 2, 0.0);
}

void Polytope::grow(Difference& difference, double tolerance, double share, double thinnest) {
  struct Edge {
    int from, to;
  };
  std::array<Edge, 3 * kMaxFaces> edges;
  for (;;) {
    nearest_ = faces_[0];
    for (int f = 1; f < face_count_; ++f)
      if (faces_[static_cast<std::size_t>(f)].offset < nearest_.offset)
        nearest_ = faces_[static_cast<std::size_t>(f)];
    lower_ = nearest_.offset;
    const SimplexCorner corner = difference.extreme(nearest_.normal);
    const double height = nearest_.normal.dot(corner.y);
    if (height < upper_) {
      upper_ = height;
      normal_ = nearest_.normal;
    }
    if (upper_ - lower_ <= tolerance || lower_ >= share * upper_ || corner_count_ == kMaxCorners) return;
    if (!(height - lower_ > 1e-14 * size_)) return;  // converged up to rounding
    // Removes the faces visible from the new corner; their outline and the corner form new faces.
    int edge_count = 0;
    int kept = 0;
    const double visible = 1e-14 * size_;
    for (int f = 0; f < face_count_; ++f) {
      const Face& face = faces_[static_cast<std::size_t>(f)];
      if (face.normal.dot(corner.y) - face.offset > visible) {
        for (std::size_t e = 0; e < 3; ++e) {
          const Edge edge{face.corner[e], face.corner[(e + 1) % 3]};
          int twin = 0;
          while (twin < edge_count && !(edges[static_cast<std::size_t>(twin)].from == edge.to &&
                                        edges[static_cast<std::size_t>(twin)].to == edge.from))
            ++twin;
          if (twin < edge_count)
            edges[static_cast<std::size_t>(twin)] = edges[static_cast<std::size_t>(--edge_count)];
          else
            edges[static_cast<std::size_t>(edge_count++)] = edge;
        }
      } else {
        faces_[static_cast<std::size_t>(kept++)] = face;
      }
    }
    face_count_ = kept;
    const int added = corner_count_;
    corners_[static_cast<std::size_t>(corner_count_++)] = corner;
    for (int e = 0; e < edge_count; ++e) {
      // The face is too thin; the present bracket stays valid.
      const Edge& edge = edges[static_cast<std::size_t>(e)];
      if (!add_face(edge.from, edge.to, added, thinnest)) return;
    }
  }
}

void Polytope::witness(Vec3& point_A, Vec3& point_B) const {
  // Several faces may lie in the plane of the nearest; the origin's foot is in one of them.
  double nearest2 = std::numeric_limits<double>::infinity();
  const auto consider = [&](const Face& face) {
    Simplex triangle;
    for (std::size_t i = 0; i < 3; ++i)
      triangle.corner[i] = corners_[static_cast<std::size_t>(face.corner[i])];
    triangle.count = 3;
    if (triangle.reduce_to_nearest() == Simplex::Place::failed) return;
    const double distance2 = triangle.nearest().squaredNorm();
    if (!(distance2 < nearest2)) return;
    nearest2 = distance2;
    point_A.setZero();
    point_B.setZero();
    for (int i = 0; i < triangle.count; ++i) {
      point_A += triangle.weight[i] * triangle.corner[i].a;
      point_B += triangle.weight[i] * triangle.corner[i].b;
    }
  };
  point_A = corners_[static_cast<std::size_t>(nearest_.corner[0])].a;
  point_B = corners_[static_cast<std::size_t>(nearest_.corner[0])].b;
  consider(nearest_);
  for (int f = 0; f < face_count_; ++f) {
    const Face& face = faces_[static_cast<std::size_t>(f)];
    if (face.offset <= lower_ + 1e-9 * size_) consider(face);
  }
}

double Polytope::reach(const Vec3& point_B) const {
  double most = 0.0;
  for (int i = 0; i < corner_count_; ++i)
    most = std::max(most, (corners_[static_cast<std::size_t>(i)].b - point_B).norm());
  return most;
}

}  // namespace takt
