#include "server/contact/surface/held_patch.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "server/contact/surface/simd4.h"

namespace takt {
namespace {

using simd4::Transform;
using simd4::turn;
using simd4::V4;
using simd4::V4x3;
using Rows = ElementRows;
static_assert(HeldPatch::kLanes * sizeof(double) == sizeof(V4));

constexpr HeldPatch::Plane kNothingBeside{};  // side 0

TAKT_LANE_INLINE void load(const HeldPatch::Plane& plane, V4x3& normal, V4& offset) {
  simd4::load(plane.x.data(), plane.y.data(), plane.z.data(), normal);
  simd4::load(plane.offset_m.data(), offset);
}

/// Beyond an edge beside the path: a convex one has the higher plane, one that goes inwards the lower one.
TAKT_LANE_INLINE void take_beside(const HeldPatch::Plane& beside, const V4x3& x, V4& height, V4x3& normal) {
  V4x3 n;
  V4 offset, h, side;
  load(beside, n, offset);
  simd4::load(beside.side.data(), side);
  simd4::dot(n, x, h);
  h -= offset;
  const auto counts = side * (h - height) > 0.0;
  height = counts ? h : height;
  normal.x = counts ? n.x : normal.x, normal.y = counts ? n.y : normal.y, normal.z = counts ? n.z : normal.z;
}

/// Puts the packs with an element inside into the rows, and returns the number of their elements.
TAKT_LANE_VARIANTS std::size_t fill_packs(const HeldPatch::Pack* packs, std::size_t count,
                                          const HeldPatch::Plane* all_planes, const Transform& X_TB,
                                          const Transform& X_BT, ElementRows& rows, std::int32_t* elements) {
  const V4 zero{};
  double *const px = rows[Rows::kPx], *const py = rows[Rows::kPy], *const pz = rows[Rows::kPz];
  double *const nx = rows[Rows::kNx], *const ny = rows[Rows::kNy], *const nz = rows[Rows::kNz];
  double *const area = rows[Rows::kArea], *const depth = rows[Rows::kDepth];
  std::size_t out = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const HeldPatch::Pack& pack = packs[i];
    V4x3 p, x, normal, n;
    V4 offset, height, side;
    simd4::load(pack.x.data(), pack.y.data(), pack.z.data(), p);
    turn(X_TB, p, x);
    x.x += X_TB.p[0], x.y += X_TB.p[1], x.z += X_TB.p[2];
    const HeldPatch::Plane* planes = all_planes + pack.first;
    load(planes[0], normal, offset);
    simd4::dot(normal, x, height);
    height -= offset;
    // An edge is passed where the planes beside it have the same height, and those before it are passed.
    V4 before = height;
    auto on = zero == zero;
    const bool beside = pack.stride > 1;
    if (beside) take_beside(planes[1], x, height, normal);
    for (std::uint32_t k = 1; k < pack.planes; ++k) {
      const HeldPatch::Plane* plane = planes + k * pack.stride;
      V4 h;
      load(*plane, n, offset);
      simd4::load(plane->side.data(), side);
      simd4::dot(n, x, h);
      h -= offset;
      on &= side * (h - before) > 0.0;
      before = h;
      if (beside) take_beside(plane[1], x, h, n);
      height = on ? h : height;
      normal.x = on ? n.x : normal.x, normal.y = on ? n.y : normal.y, normal.z = on ? n.z : normal.z;
    }
    const auto inside = height < 0.0;
    if ((inside[0] | inside[1] | inside[2] | inside[3]) == 0) continue;
    turn(X_BT, normal, n);
    simd4::store(p.x, px + out), simd4::store(p.y, py + out), simd4::store(p.z, pz + out);
    simd4::store(-n.x, nx + out), simd4::store(-n.y, ny + out), simd4::store(-n.z, nz + out);
    simd4::store(inside ? -height : zero, depth + out);
    std::memcpy(area + out, pack.area_m2.data(), sizeof pack.area_m2);
    std::memcpy(elements + out, pack.element.data(), sizeof pack.element);
    out += HeldPatch::kLanes;
  }
  return out;
}

}  // namespace

Pose HeldMotion::pose(double t, const Vec3& center_B) const {
  const double angle = t * w_T.norm();
  Pose X = X_TB;
  if (angle > 0.0) X.R = Eigen::AngleAxisd(angle, w_T.normalized()).toRotationMatrix() * X_TB.R;
  X.p = X_TB * center_B + t * v_T - X.R * center_B;
  return X;
}

double HeldMotion::beside_m(const Pose& X_TB_now, const Vec3& center_B, double radius_m, double& at_s) const {
  const Mat3 turned = X_TB_now.R * X_TB.R.transpose();
  Vec3 angle(0.5 * (turned(2, 1) - turned(1, 2)), 0.5 * (turned(0, 2) - turned(2, 0)),
             0.5 * (turned(1, 0) - turned(0, 1)));
  const double sine = angle.norm(), cosine = 0.5 * (turned.trace() - 1.0);
  if (sine > 0.0) angle *= std::atan2(sine, cosine) / sine;
  const Vec3 moved = X_TB_now * center_B - X_TB * center_B;
  const double squared_radius = radius_m * radius_m;
  const double speed2 = v_T.squaredNorm() + squared_radius * w_T.squaredNorm();
  const double along = moved.dot(v_T) + squared_radius * angle.dot(w_T);
  at_s = speed2 > 0.0 ? std::clamp(along / speed2, 0.0, horizon_s) : 0.0;
  return (moved - at_s * v_T).norm() + radius_m * (angle - at_s * w_T).norm();
}

void HeldPatch::clear() {
  for (Piece& piece : pieces_)
    piece.size = 0, piece.deepest_m = 0.0, piece.packs.clear(), piece.planes.clear();
}

void HeldPatch::add(std::size_t piece, std::int32_t element, const Vec3& p_B, double area_m2,
                    const FaceStrip& strip) {
  Piece& here = pieces_[piece];
  here.deepest_m = std::max(here.deepest_m, -strip.least_m);
  const std::size_t lane = here.size % kLanes;
  if (lane == 0) {
    here.packs.emplace_back();
    here.packs.back().first = static_cast<std::uint32_t>(here.planes.size());
  }
  ++here.size;
  Pack& pack = here.packs.back();
  pack.element[lane] = element;
  pack.x[lane] = p_B.x(), pack.y[lane] = p_B.y(), pack.z[lane] = p_B.z();
  pack.area_m2[lane] = area_m2;
  const auto* const end = strip.beside.begin() + strip.planes;
  if (pack.stride == 1 &&
      std::any_of(strip.beside.begin(), end, [](const ContactPatch* c) { return c != nullptr; }))
    add_beside(pack, here.planes);
  const auto put = [lane](const ContactPatch& from, Plane& to) {
    to.x[lane] = from.normal.x(), to.y[lane] = from.normal.y(), to.z[lane] = from.normal.z();
    to.offset_m[lane] = from.offset_m;
  };
  for (std::size_t i = 0; i < strip.planes; ++i) {
    if (i == pack.planes) {
      here.planes.emplace_back();
      if (pack.stride > 1) here.planes.push_back(kNothingBeside);
      ++pack.planes;
    }
    Plane* const plane = here.planes.data() + pack.first + i * pack.stride;
    put(*strip.plane[i], *plane);
    plane->side[lane] = strip.side[i];
    if (strip.beside[i] == nullptr) continue;
    put(*strip.beside[i], plane[1]);
    plane[1].side[lane] = strip.beside_side[i];
  }
}

/// Of the last pack.
void HeldPatch::add_beside(Pack& pack, std::vector<Plane>& planes) {
  pack.stride = 2;
  planes.resize(pack.first + 2 * pack.planes);
  for (std::size_t k = pack.planes; k-- > 0;) {
    planes[pack.first + 2 * k] = planes[pack.first + k];
    planes[pack.first + 2 * k + 1] = kNothingBeside;
  }
}

void HeldPatch::fill(std::size_t piece, const Pose& X_TB, const Pose& X_BT, ElementRows& rows,
                     std::vector<std::int32_t>& elements) const {
  const Piece& here = pieces_[piece];
  const std::size_t room = here.packs.size() * kLanes;
  rows.resize(room);
  elements.resize(room);
  std::size_t count = fill_packs(here.packs.data(), here.packs.size(), here.planes.data(), Transform(X_TB),
                                 Transform(X_BT), rows, elements.data());
  // The last pack may have fewer elements.
  if (count > 0 && elements[count - kLanes] == here.packs.back().element[0]) count -= room - here.size;
  elements.resize(count);
  rows.resize(count);
}

}  // namespace takt
