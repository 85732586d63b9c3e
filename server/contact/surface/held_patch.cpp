#include "server/contact/surface/held_patch.h"

#include <algorithm>
#include <cmath>

namespace takt {

double HeldMotion::beside_m(const Pose& X_TB_now, const Vec3& center_B, double radius_m, double& at_s) const {
  const Mat3 turned = X_TB_now.R * X_TB.R.transpose();
  const Vec3 angle(0.5 * (turned(2, 1) - turned(1, 2)), 0.5 * (turned(0, 2) - turned(2, 0)),
                   0.5 * (turned(1, 0) - turned(0, 1)));
  const Vec3 moved = X_TB_now * center_B - X_TB * center_B;
  const double squared_radius = radius_m * radius_m;
  const double speed2 = v_T.squaredNorm() + squared_radius * w_T.squaredNorm();
  const double along = moved.dot(v_T) + squared_radius * angle.dot(w_T);
  at_s = speed2 > 0.0 ? std::clamp(along / speed2, 0.0, horizon_s) : 0.0;
  return (moved - at_s * v_T).norm() + radius_m * (angle - at_s * w_T).norm();
}

void HeldPatch::clear() {
  elements_.clear();
  counts_.clear();
  for (auto& plane : planes_)
    for (auto& row : plane) row.clear();
}

void HeldPatch::add(std::int32_t element, const FaceStrip& strip) {
  if (elements_.size() % kBlock == 0) counts_.push_back(1);
  elements_.push_back(element);
  std::uint8_t planes = 1;
  while (planes < FaceStrip::kPlanes && strip.side[planes] != 0.0) ++planes;
  counts_.back() = std::max(counts_.back(), planes);
  for (std::size_t i = 0; i < FaceStrip::kPlanes; ++i) {
    planes_[i][kX].push_back(strip.normal_T[i].x());
    planes_[i][kY].push_back(strip.normal_T[i].y());
    planes_[i][kZ].push_back(strip.normal_T[i].z());
    planes_[i][kOffset].push_back(strip.offset_m[i]);
    planes_[i][kSide].push_back(strip.side[i]);
  }
}

void HeldPatch::fill(const Pose& X_TB, const Pose& X_BT, ElementRows& rows) const {
  using R = ElementRows;
  using Lane = std::array<double, kBlock>;
  const Mat3 &a = X_TB.R, &r = X_BT.R;
  const Vec3& shift = X_TB.p;
  for (std::size_t block = 0; block < counts_.size(); ++block) {
    const std::size_t begin = block * kBlock, count = std::min(kBlock, size() - begin);
    const double *px = rows[R::kPx] + begin, *py = rows[R::kPy] + begin, *pz = rows[R::kPz] + begin;
    Lane x, y, z, tx, ty, tz, height, before, on;
    const auto row = [&](std::size_t plane, Row which) { return planes_[plane][which].data() + begin; };
    const double *nx = row(0, kX), *ny = row(0, kY), *nz = row(0, kZ), *offset = row(0, kOffset);
    for (std::size_t i = 0; i < count; ++i) {
      x[i] = a(0, 0) * px[i] + a(0, 1) * py[i] + a(0, 2) * pz[i] + shift.x();
      y[i] = a(1, 0) * px[i] + a(1, 1) * py[i] + a(1, 2) * pz[i] + shift.y();
      z[i] = a(2, 0) * px[i] + a(2, 1) * py[i] + a(2, 2) * pz[i] + shift.z();
      tx[i] = nx[i], ty[i] = ny[i], tz[i] = nz[i];
      before[i] = height[i] = nx[i] * x[i] + ny[i] * y[i] + nz[i] * z[i] - offset[i];
      on[i] = 1.0;
    }
    // An edge is passed where the planes beside it have the same height, and those before it are passed.
    for (std::size_t plane = 1; plane < counts_[block]; ++plane) {
      nx = row(plane, kX), ny = row(plane, kY), nz = row(plane, kZ), offset = row(plane, kOffset);
      const double* side = row(plane, kSide);
      for (std::size_t i = 0; i < count; ++i) {
        const double h = nx[i] * x[i] + ny[i] * y[i] + nz[i] * z[i] - offset[i];
        const bool passed = on[i] * side[i] * (h - before[i]) > 0.0;
        on[i] = passed ? 1.0 : 0.0;
        before[i] = h;
        height[i] = passed ? h : height[i];
        tx[i] = passed ? nx[i] : tx[i], ty[i] = passed ? ny[i] : ty[i], tz[i] = passed ? nz[i] : tz[i];
      }
    }
    double *mx = rows[R::kNx] + begin, *my = rows[R::kNy] + begin, *mz = rows[R::kNz] + begin;
    double* depth = rows[R::kDepth] + begin;
    for (std::size_t i = 0; i < count; ++i) {
      mx[i] = -(r(0, 0) * tx[i] + r(0, 1) * ty[i] + r(0, 2) * tz[i]);
      my[i] = -(r(1, 0) * tx[i] + r(1, 1) * ty[i] + r(1, 2) * tz[i]);
      mz[i] = -(r(2, 0) * tx[i] + r(2, 1) * ty[i] + r(2, 2) * tz[i]);
      depth[i] = height[i] < 0.0 ? -height[i] : 0.0;
    }
  }
}

}  // namespace takt
