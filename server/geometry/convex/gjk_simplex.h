#pragma once
// The simplex of GJK: up to four points of the Minkowski difference A - B, and the position of the origin
// relative to them (Ericson, Real-Time Collision Detection, 2005, 5.1).
#include <algorithm>
#include <cmath>

#include "server/geometry/convex/convex_shape.h"

namespace takt {

/// A point of A, a point of B (each in its own frame), and their difference in A's frame.
struct SimplexCorner {
  Vec3 y, a, b;
};

struct Simplex {
  enum class Place { outside, inside, failed };

  SimplexCorner corner[4];
  double weight[4] = {};  ///< of the point nearest to the origin; inside: of the origin itself
  int count = 0;

  /// False if the simplex has the point already.
  bool add(const SimplexCorner& c) {
    for (int i = 0; i < count; ++i)
      if (corner[i].y == c.y) return false;
    if (count == 4) return false;
    corner[count++] = c;
    return true;
  }

  Vec3 nearest() const {
    Vec3 v = Vec3::Zero();
    for (int i = 0; i < count; ++i) v += weight[i] * corner[i].y;
    return v;
  }

  /// Keeps the corners that carry the point nearest to the origin, and its weights; all four if the origin is
  /// inside. `failed`: the corners are too flat for a verdict.
  Place reduce_to_nearest();

  /// With four corners around the origin: its distance from the nearest face, less the possible rounding
  /// error at coordinates of the given size; 0 if a face is too thin for a verdict.
  double depth(double size) const;
};

}  // namespace takt
