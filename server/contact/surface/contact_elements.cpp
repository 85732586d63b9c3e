#include "server/contact/surface/contact_elements.h"

#include <algorithm>
#include <cmath>

#include "server/contact/surface/element_factors.h"
#include "server/contact/surface/simd4.h"

namespace takt {
namespace {

using simd4::Transform;
using simd4::V4;
using simd4::V4x3;
using Rows = ElementRows;

struct Sums {
  V4 fx{}, fy{}, fz{}, tx{}, ty{}, tz{}, wx{}, wy{}, wz{};
  V4 elements{}, area{}, normal{}, friction{}, pressure{}, depth{}, energy{};
};

/// Of four elements: friction, its size, and what the Jacobian needs of it (ElementFactors).
struct Friction {
  V4x3 ft;
  V4 size;
  V4 kt{}, ct{}, ktt{}, ctt{};
  V4x3 t{}, change{};
};

/// (2.21) over the speed, so that it can be multiplied with the velocity.
template <ElementDetail kDetail>
TAKT_LANE_INLINE void regularised_friction(const ContactLaw& law, const V4& limit, const V4x3& vt,
                                           Friction& to) {
  const V4 zero{};
  V4 speed;
  simd4::length(vt, speed);
  const double v_eps = law.friction_velocity_m_per_s, over_v = 1.0 / v_eps;
  const auto fast = speed >= v_eps;
  const V4 over = fast ? 1.0 / speed : (2.0 - speed * over_v) * over_v;
  to.ct = limit * over;
  to.ft = {-to.ct * vt.x, -to.ct * vt.y, -to.ct * vt.z};
  to.size = to.ct * speed;
  if constexpr (kDetail == ElementDetail::tangent) {
    const auto moves = speed > 0.0;
    to.t = {moves ? vt.x / speed : zero, moves ? vt.y / speed : zero, moves ? vt.z / speed : zero};
    to.ctt = fast ? to.ct : limit * speed * (over_v * over_v);
    const V4 per_force = -law.friction * over;
    to.change = {per_force * vt.x, per_force * vt.y, per_force * vt.z};
  }
}

/// Springs stretched by x, which slip at the limit. `on`: elements with pressure.
template <ElementDetail kDetail, class Mask>
TAKT_LANE_INLINE void stick_friction(const ContactLaw& law, const V4& area, const V4x3& n, const V4x3& x,
                                     const V4& limit, const V4x3& vt, const Mask& on, Friction& to) {
  const V4 zero{};
  V4 normal_part;
  simd4::dot(n, x, normal_part);
  const V4 k = law.tangential_stiffness_Pa_per_m * area, c = law.tangential_damping_N_s_per_m3 * area;
  const V4x3 q{-(k * (x.x - normal_part * n.x) + c * vt.x), -(k * (x.y - normal_part * n.y) + c * vt.y),
               -(k * (x.z - normal_part * n.z) + c * vt.z)};
  V4 size;
  simd4::length(q, size);
  const auto slips = size > limit;
  const V4 share = slips ? limit / size : zero + 1.0;
  to.ft = {share * q.x, share * q.y, share * q.z};
  to.size = slips ? limit : size;
  if constexpr (kDetail == ElementDetail::secant) {
    V4 speed;
    simd4::length(vt, speed);
    const V4 bounded = speed > law.friction_velocity_m_per_s ? speed : zero + law.friction_velocity_m_per_s;
    to.kt = on ? (slips ? zero : k) : zero;
    to.ct = on ? (slips ? limit / bounded : c) : zero;
  } else if constexpr (kDetail == ElementDetail::tangent) {
    to.kt = on ? share * k : zero;
    to.ct = on ? share * c : zero;
    to.ktt = slips ? to.kt : zero;
    to.ctt = slips ? to.ct : zero;
    to.t = {slips ? q.x / size : zero, slips ? q.y / size : zero, slips ? q.z / size : zero};
    to.change = {law.friction * to.t.x, law.friction * to.t.y, law.friction * to.t.z};
  }
}

template <class Mask>
TAKT_LANE_INLINE void choose(const Mask& first, const V4x3& a, V4x3& b) {
  b.x = first ? a.x : b.x, b.y = first ? a.y : b.y, b.z = first ? a.z : b.z;
}

/// Where `first`, `b` becomes `a`.
template <class Mask>
TAKT_LANE_INLINE void choose(const Mask& first, const Friction& a, Friction& b) {
  choose(first, a.ft, b.ft), choose(first, a.t, b.t), choose(first, a.change, b.change);
  b.size = first ? a.size : b.size;
  b.kt = first ? a.kt : b.kt, b.ct = first ? a.ct : b.ct;
  b.ktt = first ? a.ktt : b.ktt, b.ctt = first ? a.ctt : b.ctt;
}

/// Of four elements: (2.18) to (2.20).
struct Normal {
  V4x3 p, n, v;
  V4 area, u, rate, s, s3, ramp, pressure, fn;
  double hardness = 0.0, linear_m = 0.0;
};

TAKT_LANE_INLINE void normal_forces(const ContactLaw& law, const V4x3& v0, const V4x3& w,
                                    const ElementRows& rows, std::size_t i, Normal& to) {
  const V4 zero{};
  simd4::load(rows[Rows::kPx] + i, rows[Rows::kPy] + i, rows[Rows::kPz] + i, to.p);
  simd4::load(rows[Rows::kNx] + i, rows[Rows::kNy] + i, rows[Rows::kNz] + i, to.n);
  simd4::load(rows[Rows::kArea] + i, to.area);
  simd4::load(rows[Rows::kDepth] + i, to.u);
  simd4::cross(w, to.p, to.v);
  to.v.x += v0.x, to.v.y += v0.y, to.v.z += v0.z;
  simd4::dot(to.n, to.v, to.rate);
  const bool hardens = std::isfinite(law.linear_depth_m);
  to.linear_m = hardens ? law.linear_depth_m : 0.0;
  const double over_linear = hardens ? 1.0 / to.linear_m : 0.0, over_depth = 1.0 / law.damping_depth_m;
  to.hardness = hardens ? ContactLaw::kHardening * law.stiffness_Pa_per_m : 0.0;
  to.s = to.u > law.linear_depth_m ? to.u * over_linear - 1.0 : zero;
  to.s3 = to.s * to.s * to.s;
  to.ramp = to.u >= law.damping_depth_m ? zero + 1.0 : to.u * over_depth;
  const V4 raw = law.stiffness_Pa_per_m * to.u + (to.hardness * to.linear_m) * (to.s3 * to.s) +
                 law.areal_damping_N_s_per_m3 * to.ramp * to.rate;
  to.pressure = raw > 0.0 && to.area > 0.0 ? raw : zero;
  to.fn = to.area * to.pressure;
}

/// As Mat3 * Vec3 does it.
TAKT_LANE_INLINE void rotate(const Transform& X, const V4x3& a, V4x3& to) {
  to.x = X.R[0][0] * a.x + X.R[0][1] * a.y + X.R[0][2] * a.z;
  to.y = X.R[1][0] * a.x + X.R[1][1] * a.y + X.R[1][2] * a.z;
  to.z = X.R[2][0] * a.x + (X.R[2][1] * a.y + X.R[2][2] * a.z);
}

/// As Pose * Vec3 does it.
TAKT_LANE_INLINE void place(const Transform& X, const V4x3& a, V4x3& to) {
  V4x3 turned;
  rotate(X, a, turned);
  to.x = turned.x + X.p[0], to.y = turned.y + X.p[1], to.z = turned.z + X.p[2];
}

TAKT_LANE_INLINE void load_anchors(const ElementRows& rows, std::size_t i, V4x3& to) {
  simd4::load(rows[Rows::kAx] + i, rows[Rows::kAy] + i, rows[Rows::kAz] + i, to);
}

/// Four elements from `i` on, and, for a Jacobian, their factors from `at` on. `s0`, `sw`: velocity of the Target's surface (kBelt). `X_BA`: frame of the anchors (kStick).
template <bool kStick, ElementDetail kDetail, bool kBelt>
TAKT_LANE_INLINE void four_forces(const ContactLaw& law, const V4x3& v0, const V4x3& w, const V4x3& s0,
                                  const V4x3& sw, const Transform& X_BA, ElementRows& rows, std::size_t i,
                                  ElementFactors* factors, std::size_t at, Sums& sums) {
  const V4 zero{};
  Normal normal;
  normal_forces(law, v0, w, rows, i, normal);
  const V4x3 &p = normal.p, &n = normal.n, &v = normal.v;
  const V4 &area = normal.area, &u = normal.u, &rate = normal.rate, &s = normal.s, &s3 = normal.s3,
           &ramp = normal.ramp, &pressure = normal.pressure, &fn = normal.fn;
  const double hardness = normal.hardness, linear_m = normal.linear_m;
  const auto on = pressure > 0.0;
  const V4 limit = law.friction * fn;
  V4x3 vt{v.x - rate * n.x, v.y - rate * n.y, v.z - rate * n.z};
  if constexpr (kBelt) {
    V4x3 s_p;
    simd4::cross(sw, p, s_p);
    s_p.x += s0.x, s_p.y += s0.y, s_p.z += s0.z;
    V4 along;
    simd4::dot(n, s_p, along);
    vt.x -= s_p.x - along * n.x, vt.y -= s_p.y - along * n.y, vt.z -= s_p.z - along * n.z;
  }
  Friction friction;
  if constexpr (kStick) {
    V4x3 anchor, x;
    V4 tied;
    load_anchors(rows, i, anchor);
    place(X_BA, anchor, x);
    x.x = p.x - x.x, x.y = p.y - x.y, x.z = p.z - x.z;
    simd4::load(rows[Rows::kTied] + i, tied);
    stick_friction<kDetail>(law, area, n, x, limit, vt, on, friction);
    if (simd4::total(tied) < 4.0) {
      Friction untied;
      regularised_friction<kDetail>(law, limit, vt, untied);
      choose(tied == 0.0, untied, friction);
    }
  } else {
    regularised_friction<kDetail>(law, limit, vt, friction);
  }
  const V4 energy =
      area * ((0.5 * law.stiffness_Pa_per_m) * u * u + (0.2 * hardness * linear_m * linear_m) * (s3 * s * s));
  const V4x3 f{friction.ft.x - fn * n.x, friction.ft.y - fn * n.y, friction.ft.z - fn * n.z};
  V4x3 m;
  simd4::cross(p, f, m);
  sums.fx += f.x, sums.fy += f.y, sums.fz += f.z;
  sums.tx += m.x, sums.ty += m.y, sums.tz += m.z;
  sums.wx += fn * p.x, sums.wy += fn * p.y, sums.wz += fn * p.z;
  sums.energy += energy;
  sums.elements += on ? zero + 1.0 : zero;
  sums.area += on ? area : zero;
  sums.normal += fn;
  sums.friction += friction.size;
  sums.pressure = pressure > sums.pressure ? pressure : sums.pressure;
  sums.depth = on && u > sums.depth ? u : sums.depth;
  simd4::store(fn, rows[Rows::kForce] + i);
  simd4::store(pressure, rows[Rows::kPressure] + i);
  if constexpr (kDetail != ElementDetail::forces) {
    V4 k = (law.stiffness_Pa_per_m + 4.0 * hardness * s3) * area;
    const V4 c = law.areal_damping_N_s_per_m3 * ramp * area;
    if constexpr (kDetail == ElementDetail::tangent)
      k += u >= law.damping_depth_m
               ? zero
               : area * (law.areal_damping_N_s_per_m3 * rate * (1.0 / law.damping_depth_m));
    simd4::store(on ? k : zero, rows[Rows::kKn] + i);
    simd4::store(on ? c : zero, rows[Rows::kCn] + i);
    using F = ElementFactors;
    simd4::store(friction.kt, (*factors)[F::kKt] + at);
    simd4::store(friction.ct, (*factors)[F::kCt] + at);
  }
  if constexpr (kDetail == ElementDetail::tangent) {
    using F = ElementFactors;
    ElementFactors& to = *factors;
    simd4::store(friction.ktt, to[F::kKtt] + at);
    simd4::store(friction.ctt, to[F::kCtt] + at);
    simd4::store(friction.t.x, to[F::kTx] + at), simd4::store(friction.t.y, to[F::kTy] + at),
        simd4::store(friction.t.z, to[F::kTz] + at);
    simd4::store(friction.change.x, to[F::kFx] + at), simd4::store(friction.change.y, to[F::kFy] + at),
        simd4::store(friction.change.z, to[F::kFz] + at);
    simd4::store(f.x, to[F::kSx] + at), simd4::store(f.y, to[F::kSy] + at),
        simd4::store(f.z, to[F::kSz] + at);
  }
}

template <bool kStick, ElementDetail kDetail, bool kBelt>
TAKT_LANE_INLINE void forces_of(const ContactLaw& law, const Twist& V_B, const Twist& surface_B,
                                const Transform& X_BA, ElementRows& rows, std::size_t begin, std::size_t end,
                                ElementFactors* factors, Sums& to) {
  const V4 zero{};
  const V4x3 v0{zero + V_B.v.x(), zero + V_B.v.y(), zero + V_B.v.z()};
  const V4x3 w{zero + V_B.w.x(), zero + V_B.w.y(), zero + V_B.w.z()};
  const V4x3 s0{zero + surface_B.v.x(), zero + surface_B.v.y(), zero + surface_B.v.z()};
  const V4x3 sw{zero + surface_B.w.x(), zero + surface_B.w.y(), zero + surface_B.w.z()};
  Sums sums = to;
  for (std::size_t i = begin; i < end; i += 4)
    four_forces<kStick, kDetail, kBelt>(law, v0, w, s0, sw, X_BA, rows, i, factors, i - begin, sums);
  to = sums;
}

ElementTotals totals_of(const Sums& sums) {
  ElementTotals totals;
  totals.f_B = {simd4::total(sums.fx), simd4::total(sums.fy), simd4::total(sums.fz)};
  totals.t_B = {simd4::total(sums.tx), simd4::total(sums.ty), simd4::total(sums.tz)};
  totals.weighted_p_B = {simd4::total(sums.wx), simd4::total(sums.wy), simd4::total(sums.wz)};
  totals.elastic_energy_J = simd4::total(sums.energy);
  totals.elements = simd4::total(sums.elements);
  totals.area_m2 = simd4::total(sums.area);
  totals.normal_force_N = simd4::total(sums.normal);
  totals.friction_force_N = simd4::total(sums.friction);
  totals.largest_pressure_Pa = simd4::largest(sums.pressure);
  totals.largest_penetration_m = simd4::largest(sums.depth);
  return totals;
}

// One function per variant: the compiler makes clones of functions, not of templates.
#define TAKT_ELEMENT_FORCES(name, stick, detail, belt)                                                       \
  TAKT_LANE_VARIANTS void name(const ContactLaw& law, const Twist& V_B, const Twist& surface_B,              \
                               const Transform& X_BA, ElementRows& rows, std::size_t begin, std::size_t end, \
                               ElementFactors* factors, Sums& sums) {                                        \
    forces_of<stick, ElementDetail::detail, belt>(law, V_B, surface_B, X_BA, rows, begin, end, factors,      \
                                                  sums);                                                     \
  }
TAKT_ELEMENT_FORCES(regularised_forces, false, forces, false)
TAKT_ELEMENT_FORCES(regularised_secant, false, secant, false)
TAKT_ELEMENT_FORCES(regularised_tangent, false, tangent, false)
TAKT_ELEMENT_FORCES(stick_forces, true, forces, false)
TAKT_ELEMENT_FORCES(stick_secant, true, secant, false)
TAKT_ELEMENT_FORCES(stick_tangent, true, tangent, false)
TAKT_ELEMENT_FORCES(regularised_belt_forces, false, forces, true)
TAKT_ELEMENT_FORCES(regularised_belt_secant, false, secant, true)
TAKT_ELEMENT_FORCES(regularised_belt_tangent, false, tangent, true)
TAKT_ELEMENT_FORCES(stick_belt_forces, true, forces, true)
TAKT_ELEMENT_FORCES(stick_belt_secant, true, secant, true)
TAKT_ELEMENT_FORCES(stick_belt_tangent, true, tangent, true)
#undef TAKT_ELEMENT_FORCES

using ForcesOfElements = void (*)(const ContactLaw&, const Twist&, const Twist&, const Transform&,
                                  ElementRows&, std::size_t, std::size_t, ElementFactors*, Sums&);
/// By belt, friction law, detail.
constexpr ForcesOfElements kForcesOfElements[2][2][3] = {
    {{regularised_forces, regularised_secant, regularised_tangent},
     {stick_forces, stick_secant, stick_tangent}},
    {{regularised_belt_forces, regularised_belt_secant, regularised_belt_tangent},
     {stick_belt_forces, stick_belt_secant, stick_belt_tangent}}};

ForcesOfElements forces_of_elements(const ContactLaw& law, ElementDetail detail, const Twist* surface_B) {
  return kForcesOfElements[surface_B != nullptr][law.friction_law == FrictionLaw::stick]
                          [static_cast<std::size_t>(detail)];
}

}  // namespace

void ElementRows::resize(std::size_t count) {
  count_ = count;
  padded_ = (count + 3) / 4 * 4;
  if (padded_ > stride_) {
    ++losses_;
    stride_ = padded_ + padded_ / 4 + 16;
    data_.assign(kRows * stride_, 0.0);
  }
  // Padding: elements without area contribute zero.
  for (std::size_t i = count_; i < padded_; ++i)
    for (std::size_t row = 0; row < kForce; ++row) data_[row * stride_ + i] = 0.0;
}

ElementTotals element_forces(const ContactLaw& law, const Twist& V_B, ElementRows& rows, const Pose& X_BA,
                             const Twist* surface_B) {
  Sums sums;
  forces_of_elements(law, ElementDetail::forces, surface_B)(
      law, V_B, surface_B != nullptr ? *surface_B : Twist{}, Transform(X_BA), rows, 0, rows.padded(), nullptr,
      sums);
  return totals_of(sums);
}

ElementTotals element_forces(const ContactLaw& law, const Twist& V_B, ElementDetail detail, ElementRows& rows,
                             const Pose& X_BA, const Twist* surface_B, Mat6& K, Mat6& D) {
  const ForcesOfElements forces = forces_of_elements(law, detail, surface_B);
  const Twist surface = surface_B != nullptr ? *surface_B : Twist{};
  const Transform X(X_BA);
  Sums sums;
  JacobianSums jacobian;
  ElementFactors factors;
  for (std::size_t begin = 0; begin < rows.padded(); begin += ElementFactors::kElements) {
    const std::size_t end = std::min(begin + ElementFactors::kElements, rows.padded());
    forces(law, V_B, surface, X, rows, begin, end, &factors, sums);
    add_to_jacobian(law, V_B, detail, rows, factors, begin, end, jacobian);
  }
  finish_jacobian(law, detail, jacobian, K, D);
  return totals_of(sums);
}

TAKT_LANE_VARIANTS void element_normal_forces(const ContactLaw& law, const Twist& V_B, ElementRows& rows) {
  const V4 zero{};
  const V4x3 v0{zero + V_B.v.x(), zero + V_B.v.y(), zero + V_B.v.z()};
  const V4x3 w{zero + V_B.w.x(), zero + V_B.w.y(), zero + V_B.w.z()};
  for (std::size_t i = 0; i < rows.padded(); i += 4) {
    Normal normal;
    normal_forces(law, v0, w, rows, i, normal);
    simd4::store(normal.fn, rows[Rows::kForce] + i);
  }
}

namespace {

template <bool kMoves>
TAKT_LANE_INLINE void slip_all(const ContactLaw& law, const Transform& X_TB, const Transform& X_TA,
                               const Transform& X_AT, ElementRows& rows) {
  for (std::size_t i = 0; i < rows.padded(); i += 4) {
    V4x3 p, n, anchor, at, x, n_T;
    V4 area, fn, tied;
    simd4::load(rows[Rows::kTied] + i, tied);
    if (simd4::largest(tied) == 0.0) continue;
    simd4::load(rows[Rows::kPx] + i, rows[Rows::kPy] + i, rows[Rows::kPz] + i, p);
    simd4::load(rows[Rows::kNx] + i, rows[Rows::kNy] + i, rows[Rows::kNz] + i, n);
    simd4::load(rows[Rows::kArea] + i, area);
    simd4::load(rows[Rows::kForce] + i, fn);
    load_anchors(rows, i, anchor);
    place(X_TB, p, x);
    rotate(X_TB, n, n_T);
    n_T.x = -n_T.x, n_T.y = -n_T.y, n_T.z = -n_T.z;
    if constexpr (kMoves)
      place(X_TA, anchor, at);
    else
      at = anchor;
    const V4x3 stretch{x.x - at.x, x.y - at.y, x.z - at.z};
    V4 along, size;
    simd4::dot(stretch, n_T, along);
    const V4x3 q{stretch.x - along * n_T.x, stretch.y - along * n_T.y, stretch.z - along * n_T.z};
    simd4::length(q, size);
    const V4 force = law.tangential_stiffness_Pa_per_m * area * size, limit = law.friction * fn;
    const auto slips = force > limit && tied > 0.0;
    const V4 share = limit / force;
    const V4x3 relaxed{x.x - share * q.x, x.y - share * q.y, x.z - share * q.z};
    if constexpr (kMoves)
      place(X_AT, relaxed, at);
    else
      at = relaxed;
    choose(slips, at, anchor);
    simd4::store(anchor.x, rows[Rows::kAx] + i), simd4::store(anchor.y, rows[Rows::kAy] + i),
        simd4::store(anchor.z, rows[Rows::kAz] + i);
  }
}

TAKT_LANE_VARIANTS void slip_resting(const ContactLaw& law, const Transform& X_TB, ElementRows& rows) {
  slip_all<false>(law, X_TB, X_TB, X_TB, rows);
}

TAKT_LANE_VARIANTS void slip_moving(const ContactLaw& law, const Transform& X_TB, const Transform& X_TA,
                                    const Transform& X_AT, ElementRows& rows) {
  slip_all<true>(law, X_TB, X_TA, X_AT, rows);
}

}  // namespace

void slip_anchors(const ContactLaw& law, const Pose& X_TB, ElementRows& rows, const Pose* X_TA) {
  if (X_TA == nullptr) return slip_resting(law, Transform(X_TB), rows);
  slip_moving(law, Transform(X_TB), Transform(*X_TA), Transform(X_TA->inverse()), rows);
}

TAKT_LANE_VARIANTS void plane_depths(const Vec3& normal, double offset, std::size_t count, const double* px,
                                     const double* py, const double* pz, double* depth) {
  const double x = normal.x(), y = normal.y(), z = normal.z();
  std::size_t i = 0;
  for (; i + 4 <= count; i += 4) {
    V4x3 p;
    simd4::load(px + i, py + i, pz + i, p);
    // The operations of plane_depth, in its order.
    simd4::store(offset - (x * p.x + y * p.y + z * p.z), depth + i);
  }
  for (; i < count; ++i) depth[i] = plane_depth(x, y, z, offset, px[i], py[i], pz[i]);
}

}  // namespace takt
