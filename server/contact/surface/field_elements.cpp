#include "server/contact/surface/field_elements.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace takt {
namespace {

Mat3 cross_matrix(const Vec3& a) {
  Mat3 m;
  m << 0.0, -a.z(), a.y(), a.z(), 0.0, -a.x(), -a.y(), a.x(), 0.0;
  return m;
}

/// The part of a symmetric matrix with positive eigenvalues.
Mat3 positive_part(const Mat3& m) {
  Eigen::SelfAdjointEigenSolver<Mat3> eigen;
  eigen.computeDirect(m);
  const Vec3 values = eigen.eigenvalues().cwiseMax(0.0);
  const Mat3& vectors = eigen.eigenvectors();
  return vectors * values.asDiagonal() * vectors.transpose();
}

}  // namespace

void FieldElements::find(const Pose& X_TB) {
  X_TB_ = X_TB;
  hits_.clear();
  if (!base_.clusters.empty()) visit(0);
}

void FieldElements::visit(std::size_t index) {
  const ContactCluster& cluster = base_.clusters[index];
  // The field is beside the surface by less than a spacing.
  if (target_.at_least_m(X_TB_ * cluster.center_B) - cluster.radius_m > target_.spacing_m()) return;
  if (cluster.second < 0) {
    for (std::size_t e = cluster.begin; e < cluster.end; ++e) add(e);
    return;
  }
  visit(index + 1);
  visit(static_cast<std::size_t>(cluster.second));
}

void FieldElements::add(std::size_t e) {
  DistanceField::Depth at;
  if (!target_.find(X_TB_ * base_.point(e), at)) return;
  const double size = at.gradient.norm();
  if (!(at.depth_m > 0.0 && size > 0.0)) return;
  hits_.push_back(
      {static_cast<std::int32_t>(e), at.depth_m, size, X_TB_.R.transpose() * (at.gradient / size)});
}

void FieldElements::fill(ElementRows& rows, std::vector<std::int32_t>& elements) const {
  using R = ElementRows;
  rows.resize(hits_.size());
  elements.resize(hits_.size());
  for (std::size_t i = 0; i < hits_.size(); ++i) {
    const Hit& hit = hits_[i];
    const auto e = static_cast<std::size_t>(hit.element);
    elements[i] = hit.element;
    rows[R::kPx][i] = base_.px[e], rows[R::kPy][i] = base_.py[e], rows[R::kPz][i] = base_.pz[e];
    rows[R::kNx][i] = hit.inward_B.x(), rows[R::kNy][i] = hit.inward_B.y(),
    rows[R::kNz][i] = hit.inward_B.z();
    rows[R::kArea][i] = base_.area_m2[e] * hit.size;
    rows[R::kDepth][i] = hit.depth_m;
  }
}

double FieldElements::elastic_energy_J(const ContactLaw& law) const {
  double sum = 0.0;
  for (const Hit& hit : hits_)
    sum += base_.area_m2[static_cast<std::size_t>(hit.element)] *
           elastic_layer(law, hit.depth_m).energy_J_per_m2;
  return sum;
}

// The force -A P g changes by -A (P' g g^T + P H) dx, H the second derivatives of u; that of element_forces() has -A |g| P' (g / |g|) (g
// / |g|)^T of that.
void FieldElements::add_stiffness(ElementDetail detail, const ContactLaw& law, const Twist& V_B,
                                  const ElementRows& rows, Mat6& K) const {
  using R = ElementRows;
  for (std::size_t i = 0; i < hits_.size(); ++i) {
    if (!(rows[R::kForce][i] > 0.0)) continue;
    const Hit& hit = hits_[i];
    const auto e = static_cast<std::size_t>(hit.element);
    const Vec3 x = base_.point(e);
    const Vec3& m = hit.inward_B;
    const double area = base_.area_m2[e];
    const Mat3 H = X_TB_.R.transpose() * target_.curvature(X_TB_ * x) * X_TB_.R;
    Mat3 across;
    if (detail == ElementDetail::tangent) {
      // The direction turns, and with it the normal velocity that is damped.
      const Vec3 v = V_B.v + V_B.w.cross(x);
      across = rows[R::kKn][i] * (hit.size - 1.0) * m * m.transpose() + (area * rows[R::kPressure][i]) * H +
               (rows[R::kCn][i] / hit.size) * m * ((v - m.dot(v) * m).transpose() * H);
    } else {
      across = (area * elastic_layer(law, hit.depth_m).pressure_Pa) * positive_part(H);
    }
    const Mat3 lever = cross_matrix(x);
    const Mat3 turned = across * lever;
    K.topLeftCorner<3, 3>() -= across;
    K.topRightCorner<3, 3>() += turned;
    K.bottomLeftCorner<3, 3>() -= lever * across;
    K.bottomRightCorner<3, 3>() += lever * turned;
  }
}

double FieldElements::deepest_m(Vec3& x_T, Vec3& inward_T) const {
  const auto deepest = std::max_element(hits_.begin(), hits_.end(),
                                        [](const Hit& a, const Hit& b) { return a.depth_m < b.depth_m; });
  if (deepest == hits_.end()) return 0.0;
  x_T = X_TB_ * base_.point(static_cast<std::size_t>(deepest->element));
  inward_T = X_TB_.R * deepest->inward_B;
  return deepest->depth_m;
}

}  // namespace takt
