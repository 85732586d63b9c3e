#pragma once
// Four numbers at a time, for the loops over contact elements. GCC's vector types: the operations are those
// of single numbers, on every processor.
#include <cmath>
#include <cstring>

#include "plant_models/spatial.h"

// Variants for processors with wider registers, chosen at program start. They do not contract a * b + c
// (-ffp-contract=off). Sanitizers do not support the dispatch.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define TAKT_LANE_VARIANTS __attribute__((target_clones("avx2", "default")))
#else
#define TAKT_LANE_VARIANTS
#endif

namespace takt::simd4 {

using V4 = double __attribute__((vector_size(32)));

#define TAKT_LANE_INLINE [[gnu::always_inline]] inline

TAKT_LANE_INLINE void load(const double* from, V4& to) {
  std::memcpy(&to, from, sizeof to);
}
TAKT_LANE_INLINE void store(const V4& from, double* to) {
  std::memcpy(to, &from, sizeof from);
}
TAKT_LANE_INLINE double total(const V4& x) {
  return (x[0] + x[1]) + (x[2] + x[3]);
}
TAKT_LANE_INLINE double largest(const V4& x) {
  return std::fmax(std::fmax(x[0], x[1]), std::fmax(x[2], x[3]));
}

/// Three coordinates of four vectors.
struct V4x3 {
  V4 x, y, z;
};
TAKT_LANE_INLINE void load(const double* x, const double* y, const double* z, V4x3& to) {
  load(x, to.x), load(y, to.y), load(z, to.z);
}
TAKT_LANE_INLINE void dot(const V4x3& a, const V4x3& b, V4& to) {
  to = a.x * b.x + a.y * b.y + a.z * b.z;
}
TAKT_LANE_INLINE void cross(const V4x3& a, const V4x3& b, V4x3& to) {
  to.x = a.y * b.z - a.z * b.y;
  to.y = a.z * b.x - a.x * b.z;
  to.z = a.x * b.y - a.y * b.x;
}

/// A Pose as numbers, each the same for all lanes.
struct Transform {
  double R[3][3], p[3];
  explicit Transform(const Pose& X) {
    for (int i = 0; i < 3; ++i) {
      p[i] = X.p[i];
      for (int j = 0; j < 3; ++j) R[i][j] = X.R(i, j);
    }
  }
};
TAKT_LANE_INLINE void turn(const Transform& X, const V4x3& a, V4x3& to) {
  to.x = X.R[0][0] * a.x + X.R[0][1] * a.y + X.R[0][2] * a.z;
  to.y = X.R[1][0] * a.x + X.R[1][1] * a.y + X.R[1][2] * a.z;
  to.z = X.R[2][0] * a.x + X.R[2][1] * a.y + X.R[2][2] * a.z;
}
TAKT_LANE_INLINE void root(const V4& x, V4& to) {
  for (int i = 0; i < 4; ++i) to[i] = std::sqrt(x[i]);
}
TAKT_LANE_INLINE void length(const V4x3& a, V4& to) {
  dot(a, a, to);
  root(to, to);
}

}  // namespace takt::simd4
