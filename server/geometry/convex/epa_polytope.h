#pragma once
// A growing polytope inside the Minkowski difference A - B (the expanding polytope algorithm, EPA: van den
// Bergen 2001). Its faces bound the penetration depth from below and the computed extreme points bound it
// from above, so the result is a bracket.
#include <array>
#include <cstdint>
#include <limits>

#include "server/geometry/convex/gjk_simplex.h"

namespace takt {

/// The difference A - B in A's frame: its extreme points.
struct Difference {
  const ConvexShape& a;
  const ConvexShape& b;
  Mat3 R_AB;
  Vec3 p_AB;
  std::uint32_t vertex_a;  ///< start of the climbs
  std::uint32_t vertex_b;

  Difference(const ConvexShape& shape_a, const Pose& X_WA, const ConvexShape& shape_b, const Pose& X_WB,
             std::uint32_t first_a = ConvexShape::kNoVertex, std::uint32_t first_b = ConvexShape::kNoVertex)
      : a(shape_a),
        b(shape_b),
        R_AB(X_WA.R.transpose() * X_WB.R),
        p_AB(X_WA.R.transpose() * (X_WB.p - X_WA.p)),
        vertex_a(first_a),
        vertex_b(first_b) {}

  /// The point of A - B furthest along the unit vector n.
  SimplexCorner extreme(const Vec3& n) {
    SimplexCorner corner;
    const Vec3 down_B = -(R_AB.transpose() * n);
    // Directions change sides from call to call: the climb begins at the higher of two starts.
    vertex_a = a.higher_start(n, vertex_a);
    vertex_b = b.higher_start(down_B, vertex_b);
    corner.a = a.extreme_point(n, vertex_a);
    corner.b = b.extreme_point(down_B, vertex_b);
    corner.y = corner.a - (R_AB * corner.b + p_AB);
    return corner;
  }
};

class Polytope {
 public:
  /// Begins with the corners of a simplex that contains the origin (up to rounding) and completes it to four.
  /// `size` is that of the problem. False if A - B is flat to 1e-9 of the size.
  bool begin(const Simplex& simplex, Difference& difference, double size);

  /// Grows until the bracket is no wider than `tolerance`, or the lower bound reaches `share` of the upper
  /// bound, or the capacity is used up. `thinnest`: smallest share of size^2 of a face that may grow; a
  /// thinner nearest face ends the growth. Call once.
  void grow(Difference& difference, double tolerance, double share, double thinnest);

  double lower() const { return lower_; }  ///< the origin is at least this deep inside (negative: outside)
  double upper() const { return upper_; }  ///< and at most this deep
  const Vec3& normal() const { return normal_; }  ///< direction of `upper`, from A to B
  /// The point of the lower bound's face nearest to the origin, as a point of A and one of B (own frames).
  void witness(Vec3& point_A, Vec3& point_B) const;
  /// Largest distance from `point_B` of the corners' points of B.
  double reach(const Vec3& point_B) const;

 private:
  static constexpr int kMaxCorners = 96;
  static constexpr int kMaxFaces = 2 * kMaxCorners;
  struct Face {
    std::array<int, 3> corner;
    Vec3 normal;  ///< outward, unit
    double offset = 0.0;
  };
  bool add_face(int i, int j, int k, double thinnest);

  std::array<SimplexCorner, kMaxCorners> corners_;
  std::array<Face, kMaxFaces> faces_;
  int corner_count_ = 0, face_count_ = 0;
  Face nearest_;  ///< the face of `lower_`
  double size_ = 1.0;
  double lower_ = -std::numeric_limits<double>::infinity();
  double upper_ = std::numeric_limits<double>::infinity();
  Vec3 normal_ = Vec3::UnitX();
};

}  // namespace takt
