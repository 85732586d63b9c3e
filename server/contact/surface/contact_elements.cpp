#include "server/contact/surface/contact_elements.h"

#include <cmath>

#include "server/contact/surface/simd4.h"

namespace takt {
namespace {

using simd4::V4;
using simd4::V4x3;
using Rows = ElementRows;

struct Sums {
  V4 fx{}, fy{}, fz{}, tx{}, ty{}, tz{}, wx{}, wy{}, wz{};
  V4 elements{}, area{}, normal{}, friction{}, pressure{}, depth{}, energy{};
};

/// Of four elements: friction, its size, and what the Jacobian needs of it (ElementRows).
struct Friction {
  V4x3 ft;
  V4 size;
  V4 kt{}, ct{}, ktt{}, ctt{};
  V4x3 t{}, change{};
};

/// (2.21) over the speed, so that it can be multiplied with the velocity.
template <ElementDetail kDetail>
TAKT_LANE_INLINE void regularised_friction(const ContactLaw& law, const V4& limit, const V4x3& vt,
                                           const V4& speed, Friction& to) {
  const V4 zero{};
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
                                     const V4& limit, const V4x3& vt, const V4& speed, const Mask& on,
                                     Friction& to) {
  const V4 zero{};
  V4 normal_part;
  simd4::dot(n, x, normal_part);
  const V4 k = law.tangential_stiffness_Pa_per_m * area, c = law.tangential_damping_N_s_per_m3 * area;
  const V4x3 q{-(k * (x.x - normal_part * n.x) + c * vt.x), -(k * (x.y - normal_part * n.y) + c * vt.y),
               -(k * (x.z - normal_part * n.z) + c * vt.z)};
  V4 size;
  simd4::dot(q, q, size);
  simd4::root(size, size);
  const auto slips = size > limit;
  const V4 share = slips ? limit / size : zero + 1.0;
  to.ft = {share * q.x, share * q.y, share * q.z};
  to.size = slips ? limit : size;
  if constexpr (kDetail == ElementDetail::secant) {
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

/// Four elements from `i` on. `s0`, `sw`: velocity of the Target's surface (kBelt).
template <bool kStick, ElementDetail kDetail, bool kBelt>
TAKT_LANE_INLINE void four_forces(const ContactLaw& law, const V4x3& v0, const V4x3& w, const V4x3& s0,
                                  const V4x3& sw, ElementRows& rows, std::size_t i, Sums& sums) {
  const V4 zero{};
  V4x3 p, n, v;
  V4 area, u;
  simd4::load(rows[Rows::kPx] + i, rows[Rows::kPy] + i, rows[Rows::kPz] + i, p);
  simd4::load(rows[Rows::kNx] + i, rows[Rows::kNy] + i, rows[Rows::kNz] + i, n);
  simd4::load(rows[Rows::kArea] + i, area);
  simd4::load(rows[Rows::kDepth] + i, u);
  simd4::cross(w, p, v);
  v.x += v0.x, v.y += v0.y, v.z += v0.z;
  V4 rate;
  simd4::dot(n, v, rate);
  // (2.18) to (2.20)
  const double over_depth = 1.0 / law.damping_depth_m;
  const bool hardens = std::isfinite(law.linear_depth_m);
  const double linear_m = hardens ? law.linear_depth_m : 0.0, over_linear = hardens ? 1.0 / linear_m : 0.0,
               hardness = hardens ? ContactLaw::kHardening * law.stiffness_Pa_per_m : 0.0;
  const V4 s = u > law.linear_depth_m ? u * over_linear - 1.0 : zero;
  const V4 s3 = s * s * s;
  const V4 ramp = u >= law.damping_depth_m ? zero + 1.0 : u * over_depth;
  const V4 raw = law.stiffness_Pa_per_m * u + (hardness * linear_m) * (s3 * s) +
                 law.areal_damping_N_s_per_m3 * ramp * rate;
  const auto on = raw > 0.0 && area > 0.0;
  const V4 pressure = on ? raw : zero;
  const V4 fn = area * pressure;
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
  V4 speed;
  simd4::dot(vt, vt, speed);
  simd4::root(speed, speed);

  Friction friction;
  if constexpr (kStick) {
    V4x3 x;
    V4 tied;
    simd4::load(rows[Rows::kXx] + i, rows[Rows::kXy] + i, rows[Rows::kXz] + i, x);
    simd4::load(rows[Rows::kTied] + i, tied);
    stick_friction<kDetail>(law, area, n, x, limit, vt, speed, on, friction);
    if (simd4::total(tied) < 4.0) {
      Friction untied;
      regularised_friction<kDetail>(law, limit, vt, speed, untied);
      choose(tied == 0.0, untied, friction);
    }
  } else {
    regularised_friction<kDetail>(law, limit, vt, speed, friction);
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
      k += u >= law.damping_depth_m ? zero : area * (law.areal_damping_N_s_per_m3 * rate * over_depth);
    simd4::store(on ? k : zero, rows[Rows::kKn] + i);
    simd4::store(on ? c : zero, rows[Rows::kCn] + i);
    simd4::store(friction.kt, rows[Rows::kKt] + i);
    simd4::store(friction.ct, rows[Rows::kCt] + i);
  }
  if constexpr (kDetail == ElementDetail::tangent) {
    simd4::store(friction.ktt, rows[Rows::kKtt] + i);
    simd4::store(friction.ctt, rows[Rows::kCtt] + i);
    simd4::store(friction.t.x, rows[Rows::kTx] + i), simd4::store(friction.t.y, rows[Rows::kTy] + i),
        simd4::store(friction.t.z, rows[Rows::kTz] + i);
    simd4::store(friction.change.x, rows[Rows::kFx] + i),
        simd4::store(friction.change.y, rows[Rows::kFy] + i);
    simd4::store(friction.change.z, rows[Rows::kFz] + i);
    simd4::store(f.x, rows[Rows::kSx] + i), simd4::store(f.y, rows[Rows::kSy] + i),
        simd4::store(f.z, rows[Rows::kSz] + i);
  }
}

template <bool kStick, ElementDetail kDetail, bool kBelt>
TAKT_LANE_INLINE void all_forces(const ContactLaw& law, const Twist& V_B, const Twist& surface_B,
                                 ElementRows& rows, ElementTotals& totals) {
  const V4 zero{};
  const V4x3 v0{zero + V_B.v.x(), zero + V_B.v.y(), zero + V_B.v.z()};
  const V4x3 w{zero + V_B.w.x(), zero + V_B.w.y(), zero + V_B.w.z()};
  const V4x3 s0{zero + surface_B.v.x(), zero + surface_B.v.y(), zero + surface_B.v.z()};
  const V4x3 sw{zero + surface_B.w.x(), zero + surface_B.w.y(), zero + surface_B.w.z()};
  Sums sums;
  for (std::size_t i = 0; i < rows.padded(); i += 4)
    four_forces<kStick, kDetail, kBelt>(law, v0, w, s0, sw, rows, i, sums);
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
}

// One function per variant: the compiler makes clones of functions, not of templates.
#define TAKT_ELEMENT_FORCES(name, stick, detail, belt)                                          \
  TAKT_LANE_VARIANTS void name(const ContactLaw& law, const Twist& V_B, const Twist& surface_B, \
                               ElementRows& rows, ElementTotals& totals) {                      \
    all_forces<stick, ElementDetail::detail, belt>(law, V_B, surface_B, rows, totals);          \
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

using ForcesOfElements = void (*)(const ContactLaw&, const Twist&, const Twist&, ElementRows&,
                                  ElementTotals&);
/// By belt, friction law, detail.
constexpr ForcesOfElements kForcesOfElements[2][2][3] = {
    {{regularised_forces, regularised_secant, regularised_tangent},
     {stick_forces, stick_secant, stick_tangent}},
    {{regularised_belt_forces, regularised_belt_secant, regularised_belt_tangent},
     {stick_belt_forces, stick_belt_secant, stick_belt_tangent}}};

}  // namespace

void ElementRows::resize(std::size_t count) {
  count_ = count;
  padded_ = (count + 3) / 4 * 4;
  if (padded_ > stride_) {
    stride_ = padded_ + padded_ / 2 + 16;
    data_.assign(kRows * stride_, 0.0);
  }
  // Padding: elements without area contribute zero.
  for (std::size_t i = count_; i < padded_; ++i)
    for (std::size_t row = 0; row < kForce; ++row) data_[row * stride_ + i] = 0.0;
}

ElementTotals element_forces(const ContactLaw& law, const Twist& V_B, ElementDetail detail, ElementRows& rows,
                             const Twist* surface_B) {
  ElementTotals totals;
  const std::size_t stick = law.friction_law == FrictionLaw::stick ? 1 : 0,
                    belt = surface_B != nullptr ? 1 : 0;
  kForcesOfElements[belt][stick][static_cast<std::size_t>(detail)](
      law, V_B, surface_B != nullptr ? *surface_B : Twist{}, rows, totals);
  return totals;
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
