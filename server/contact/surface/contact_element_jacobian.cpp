// K and D of contact elements: sums of outer products of their directions, kept as twelve or fewer sums at a
// time so that they stay in registers.
#include "server/contact/surface/element_factors.h"
#include "server/contact/surface/simd4.h"

namespace takt {
namespace {

using simd4::V4;
using simd4::V4x3;
using Rows = ElementRows;
using Factors = ElementFactors;

TAKT_LANE_INLINE void add_point(const V4& c, const V4x3& p, PointSums& s) {
  const V4 x = c * p.x, y = c * p.y, z = c * p.z;
  s.c += c, s.x += x, s.y += y, s.z += z;
  s.xx += x * p.x, s.yy += y * p.y, s.zz += z * p.z;
  s.xy += x * p.y, s.xz += x * p.z, s.yz += y * p.z;
}

/// L^T L with L = [1, -[p]x], from the sums.
Mat6 all_directions(const PointSums& s) {
  const double c = simd4::total(s.c), x = simd4::total(s.x), y = simd4::total(s.y), z = simd4::total(s.z);
  const double xx = simd4::total(s.xx), yy = simd4::total(s.yy), zz = simd4::total(s.zz);
  const double xy = simd4::total(s.xy), xz = simd4::total(s.xz), yz = simd4::total(s.yz);
  Mat6 m = Mat6::Zero();
  m(0, 0) = m(1, 1) = m(2, 2) = c;
  m(0, 4) = m(4, 0) = z, m(0, 5) = m(5, 0) = -y;
  m(1, 3) = m(3, 1) = -z, m(1, 5) = m(5, 1) = x;
  m(2, 3) = m(3, 2) = y, m(2, 4) = m(4, 2) = -x;
  m(3, 3) = yy + zz, m(4, 4) = xx + zz, m(5, 5) = xx + yy;
  m(3, 4) = m(4, 3) = -xy, m(3, 5) = m(5, 3) = -xz, m(4, 5) = m(5, 4) = -yz;
  return m;
}

/// The six coordinates of a direction at a point.
TAKT_LANE_INLINE void screw(const V4x3& direction, const V4x3& p, V4 (&to)[6]) {
  V4x3 m;
  simd4::cross(p, direction, m);
  to[0] = direction.x, to[1] = direction.y, to[2] = direction.z;
  to[3] = m.x, to[4] = m.y, to[5] = m.z;
}

template <bool kBoth>
TAKT_LANE_INLINE void add_symmetric(const V4 (&s)[6], const V4& k, const V4& d, SymmetricSums& sums) {
  int at = 0;
#pragma GCC unroll 6
  for (int i = 0; i < 6; ++i) {
#pragma GCC unroll 6
    for (int j = i; j < 6; ++j, ++at) {
      const V4 product = s[i] * s[j];
      if constexpr (kBoth) sums.k[at] += k * product;
      sums.d[at] += d * product;
    }
  }
}

void fold(const V4 (&sums)[21], Mat6& to) {
  int at = 0;
  for (int i = 0; i < 6; ++i)
    for (int j = i; j < 6; ++j, ++at) {
      const double sum = simd4::total(sums[at]);
      to(i, j) += sum;
      if (i != j) to(j, i) += sum;
    }
}

template <bool kStick>
TAKT_LANE_INLINE void secant(const ElementRows& rows, const ElementFactors& factors, std::size_t begin,
                             std::size_t end, JacobianSums& to) {
  SymmetricSums normal = to.normal;
  PointSums k_point = to.k_point, d_point = to.d_point;
  for (std::size_t i = begin; i < end; i += 4) {
    const std::size_t at = i - begin;
    V4x3 p, n;
    V4 kn, cn, kt, ct;
    simd4::load(rows[Rows::kPx] + i, rows[Rows::kPy] + i, rows[Rows::kPz] + i, p);
    simd4::load(rows[Rows::kNx] + i, rows[Rows::kNy] + i, rows[Rows::kNz] + i, n);
    simd4::load(rows[Rows::kKn] + i, kn);
    simd4::load(rows[Rows::kCn] + i, cn);
    simd4::load(factors[Factors::kCt] + at, ct);
    V4 s[6];
    screw(n, p, s);
    if constexpr (kStick) {
      simd4::load(factors[Factors::kKt] + at, kt);
      add_point(kt, p, k_point);
      kn -= kt;
    }
    add_point(ct, p, d_point);
    add_symmetric<true>(s, kn, cn - ct, normal);
  }
  to.normal = normal, to.k_point = k_point, to.d_point = d_point;
}

void finish_secant(bool stick, const JacobianSums& sums, Mat6& K, Mat6& D) {
  K.setZero(), D.setZero();
  fold(sums.normal.k, K), fold(sums.normal.d, D);
  if (stick) K += all_directions(sums.k_point);
  D += all_directions(sums.d_point);
  K = -K, D = -D;
}

/// k += m row^T, d += m2 row2^T
TAKT_LANE_INLINE void add_outer(const V4 (&m)[6], const V4 (&row)[6], const V4 (&m2)[6], const V4 (&row2)[6],
                                JacobianSums& sums) {
#pragma GCC unroll 6
  for (int i = 0; i < 6; ++i) {
#pragma GCC unroll 6
    for (int j = 0; j < 6; ++j) {
      sums.k[6 * i + j] += m[i] * row[j];
      sums.d[6 * i + j] += m2[i] * row2[j];
    }
  }
}

template <bool kStick>
TAKT_LANE_INLINE void tangent(const Twist& V_B, const ElementRows& rows, const ElementFactors& factors,
                              std::size_t begin, std::size_t end, JacobianSums& to) {
  const V4 zero{};
  const V4x3 w{zero + V_B.w.x(), zero + V_B.w.y(), zero + V_B.w.z()};
  JacobianSums sums = to;
  for (std::size_t i = begin; i < end; i += 4) {
    const std::size_t at = i - begin;
    V4x3 p, n, t, change, f;
    V4 kn, cn, kt, ct, ktt, ctt;
    simd4::load(rows[Rows::kPx] + i, rows[Rows::kPy] + i, rows[Rows::kPz] + i, p);
    simd4::load(rows[Rows::kNx] + i, rows[Rows::kNy] + i, rows[Rows::kNz] + i, n);
    simd4::load(factors[Factors::kTx] + at, factors[Factors::kTy] + at, factors[Factors::kTz] + at, t);
    simd4::load(factors[Factors::kFx] + at, factors[Factors::kFy] + at, factors[Factors::kFz] + at, change);
    simd4::load(factors[Factors::kSx] + at, factors[Factors::kSy] + at, factors[Factors::kSz] + at, f);
    simd4::load(rows[Rows::kKn] + i, kn), simd4::load(rows[Rows::kCn] + i, cn);
    simd4::load(factors[Factors::kKt] + at, kt), simd4::load(factors[Factors::kCt] + at, ct);
    simd4::load(factors[Factors::kKtt] + at, ktt), simd4::load(factors[Factors::kCtt] + at, ctt);

    // The normal force with displacement of the centroid: penetration, and the normal velocity of a
    // point that moves on in the field of velocities. The normal belongs to the Target.
    V4x3 n_w;
    simd4::cross(n, w, n_w);
    const V4x3 slope{kn * n.x + cn * n_w.x, kn * n.y + cn * n_w.y, kn * n.z + cn * n_w.z};
    V4 row[6], force[6], s[6], scaled[6], sliding[6];
    screw(slope, p, row);
    // Change of the force: along the normal, and friction proportional to it.
    screw({change.x - n.x, change.y - n.y, change.z - n.z}, p, force);
    screw(n, p, s);
    for (int j = 0; j < 6; ++j) scaled[j] = cn * s[j];
    add_outer(force, row, force, scaled, sums);
    // Friction with displacement and velocity: in the tangential plane, less along t.
    add_symmetric<kStick>(s, kt, ct, sums.normal);
    screw(t, p, sliding);
    add_symmetric<kStick>(sliding, ktt, ctt, sums.along);
    if constexpr (kStick) add_point(kt, p, sums.k_point);
    add_point(ct, p, sums.d_point);
    sums.forces[0] += f.x, sums.forces[1] += f.y, sums.forces[2] += f.z;
    sums.turned[0] += p.x * f.x, sums.turned[1] += p.x * f.y, sums.turned[2] += p.x * f.z;
    sums.turned[3] += p.y * f.x, sums.turned[4] += p.y * f.y, sums.turned[5] += p.y * f.z;
    sums.turned[6] += p.z * f.x, sums.turned[7] += p.z * f.y, sums.turned[8] += p.z * f.z;
  }
  to = sums;
}

void finish_tangent(bool stick, const JacobianSums& sums, Mat6& K, Mat6& D) {
  K.setZero(), D.setZero();
  fold(sums.normal.k, K), fold(sums.along.k, K), fold(sums.normal.d, D), fold(sums.along.d, D);
  if (stick) K -= all_directions(sums.k_point);
  D -= all_directions(sums.d_point);
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j) {
      K(i, j) += simd4::total(sums.k[6 * i + j]);
      D(i, j) += simd4::total(sums.d[6 * i + j]);
    }
  // Forces keep their directions while their points move with the Base: dM = (a + w x p) x f.
  const double x = simd4::total(sums.forces[0]), y = simd4::total(sums.forces[1]),
               z = simd4::total(sums.forces[2]);
  K(3, 1) += z, K(3, 2) -= y, K(4, 0) -= z, K(4, 2) += x, K(5, 0) += y, K(5, 1) -= x;
  const double trace =
      simd4::total(sums.turned[0]) + simd4::total(sums.turned[4]) + simd4::total(sums.turned[8]);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      K(3 + i, 3 + j) += simd4::total(sums.turned[3 * i + j]) - (i == j ? trace : 0.0);
}

#define TAKT_ELEMENT_SECANT(name, stick)                                                                  \
  TAKT_LANE_VARIANTS void name(const ElementRows& rows, const ElementFactors& factors, std::size_t begin, \
                               std::size_t end, JacobianSums& sums) {                                     \
    secant<stick>(rows, factors, begin, end, sums);                                                       \
  }
#define TAKT_ELEMENT_TANGENT(name, stick)                                                                \
  TAKT_LANE_VARIANTS void name(const Twist& V_B, const ElementRows& rows, const ElementFactors& factors, \
                               std::size_t begin, std::size_t end, JacobianSums& sums) {                 \
    tangent<stick>(V_B, rows, factors, begin, end, sums);                                                \
  }
TAKT_ELEMENT_SECANT(regularised_secant, false)
TAKT_ELEMENT_SECANT(stick_secant, true)
TAKT_ELEMENT_TANGENT(regularised_tangent, false)
TAKT_ELEMENT_TANGENT(stick_tangent, true)
#undef TAKT_ELEMENT_SECANT
#undef TAKT_ELEMENT_TANGENT

bool sticks(const ContactLaw& law) {
  return law.friction_law == FrictionLaw::stick;
}

}  // namespace

void add_to_jacobian(const ContactLaw& law, const Twist& V_B, ElementDetail detail, const ElementRows& rows,
                     const ElementFactors& factors, std::size_t begin, std::size_t end, JacobianSums& sums) {
  if (detail == ElementDetail::tangent)
    (sticks(law) ? stick_tangent : regularised_tangent)(V_B, rows, factors, begin, end, sums);
  else
    (sticks(law) ? stick_secant : regularised_secant)(rows, factors, begin, end, sums);
}

void finish_jacobian(const ContactLaw& law, ElementDetail detail, const JacobianSums& sums, Mat6& K,
                     Mat6& D) {
  (detail == ElementDetail::tangent ? finish_tangent : finish_secant)(sticks(law), sums, K, D);
}

}  // namespace takt
