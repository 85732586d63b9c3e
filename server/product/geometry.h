#pragma once
// Instances of a product in the world: triangles by face, boxes.
#include <array>
#include <limits>
#include <vector>

#include "server/geometry/aabb.h"
#include "server/product/product.h"

namespace takt::product {

using Triangle = std::array<Vec3, 3>;

inline Vec3 normal_of(const Triangle& t) {
  return (t[1] - t[0]).cross(t[2] - t[0]);
}  ///< twice the area long

using Polygon = std::vector<Vec3>;
/// Keeps the part of a convex polygon with n . p <= offset.
void clip(Polygon& polygon, const Vec3& n, double offset);

/// The face in the frame that the pose is in.
Face placed(Face face, const Pose& X_WB);
/// Two faces around one axis, whose axes are at most so far apart; both in one frame.
bool coaxial(const Face& a, const Face& b, double apart_m);

/// A face where its instance is.
struct PlacedFace {
  Face face;  ///< axis and point in the world
  std::vector<Triangle> triangles;
  Aabb box;
};

/// An instance where it is.
struct PlacedInstance {
  std::vector<Triangle> triangles;  ///< of the whole mesh, in its order
  std::vector<PlacedFace> faces;    ///< those with triangles
  Aabb box;
  double mass_kg = 0.0;
};

std::vector<PlacedInstance> place(const Product& product);

/// Box around points; grows. Starts empty.
struct BoxBuilder {
  Aabb box;
  bool any = false;
  void add(const Vec3& p) {
    box.lower = any ? box.lower.cwiseMin(p).eval() : p;
    box.upper = any ? box.upper.cwiseMax(p).eval() : p;
    any = true;
  }
};

struct Extent {
  double from = std::numeric_limits<double>::infinity(), to = -from;
  bool meets(const Extent& other, double within) const {
    return from < other.to + within && other.from < to + within;
  }
};

/// Coordinates of the instance along an axis of the world.
Extent along(const PlacedInstance& instance, const Vec3& axis);

/// True if the triangle has this place inside or on its border, seen along z; `up`: the sign of its normal's z.
bool covers(const Triangle& t, double x, double y, double up);

inline bool near(const Aabb& a, const Aabb& b, double gap_m) {
  return ((a.lower - b.upper).array() <= gap_m).all() && ((b.lower - a.upper).array() <= gap_m).all();
}

}  // namespace takt::product
