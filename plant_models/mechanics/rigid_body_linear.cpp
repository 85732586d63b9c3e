// A Part reduced to its six velocities: v, w.
#include "plant_models/mechanics/rigid_body.h"

namespace takt {

namespace {

using ConstVec3 = Eigen::Map<const Vec3>;
using MutVec3 = Eigen::Map<Vec3>;
using ConstVec4 = Eigen::Map<const Eigen::Vector4d>;

Mat3 cross_matrix(const Vec3& r) {
  Mat3 m;
  m << 0.0, -r.z(), r.y(), r.z(), 0.0, -r.x(), -r.y(), r.x(), 0.0;
  return m;
}

class RigidBodyLinear final : public VelocityForm {
 public:
  explicit RigidBodyLinear(const RigidBodyParameters& parameters) : parameters_(parameters) {}

  int velocity_count() const override { return 6; }
  std::vector<int> bodies() const override { return {parameters_.body}; }

  void linearise(double, const double* x, const CellMotion& motion, std::span<const Wrench>,
                 double* M) override {
    const BodyMotion& body = motion.bodies[static_cast<size_t>(parameters_.body)];
    p_W_ = body.p_WBcm;
    q_ = ConstVec4(x + 3);
    // q' = 1/2 E w.
    E_.row(0) = -q_.tail<3>().transpose();
    E_.bottomRows<3>() = -cross_matrix(q_.tail<3>());
    E_.bottomRows<3>().diagonal().array() += q_[0];
    inverse_square_ = 1.0 / q_.squaredNorm();
    Eigen::Map<Eigen::Matrix<double, 6, 6>> inertia(M);
    inertia.setZero();
    inertia.diagonal().head<3>().setConstant(parameters_.mass_kg);
    inertia.bottomRightCorner<3, 3>() = body.X_WB.R * parameters_.I_BBcm_B * body.X_WB.R.transpose();
  }

  void body_jacobian(int, const Vec3& p_W, double* J) const override {
    Eigen::Map<Eigen::Matrix<double, 6, 6>> jacobian(J);
    jacobian.setIdentity();
    jacobian.topRightCorner<3, 3>() = -cross_matrix(p_W - p_W_);
  }

  bool factorise(double a, double b, Row* rows) override {
    a_ = a, b_ = b;
    for (int i = 0; i < 6; ++i) rows[i] = {};
    return true;
  }

  // A change of the quaternion is a rotation and a change of length, q s + 1/2 E theta; E^T E is |q|^2 and
  // E^T q zero.
  void reduce(const double* r, double* d_r, double* r_u, double* right) override {
    MutVec3(d_r, 3) = ConstVec3(r);
    MutVec3(d_r + 3, 3) = 2.0 * inverse_square_ * (E_.transpose() * ConstVec4(r + 3));
    for (int i = 0; i < 6; ++i) r_u[i] = r[7 + i], right[i] = 0.0;
    theta_r_ = ConstVec3(d_r + 3);
  }

  void expand(const double* u, double* r) const override {
    // The stabilising term shrinks an error of length by twice its rate.
    const double length =
        q_.dot(ConstVec4(r + 3)) * inverse_square_ / (a_ + b_ * 2.0 * RigidBody::kQuaternionStabilisation);
    const double per_a = 1.0 / a_;
    MutVec3(r, 3) = per_a * (ConstVec3(r) + b_ * ConstVec3(u));
    Eigen::Map<Eigen::Vector4d>(r + 3) =
        length * q_ + E_ * (0.5 * per_a * (theta_r_ + b_ * ConstVec3(u + 3)));
    for (int i = 0; i < 6; ++i) r[7 + i] = u[i];
  }

 private:
  RigidBodyParameters parameters_;
  Vec3 p_W_ = Vec3::Zero(), theta_r_ = Vec3::Zero();
  Eigen::Vector4d q_{1.0, 0.0, 0.0, 0.0};  ///< w x y z
  Eigen::Matrix<double, 4, 3> E_ = Eigen::Matrix<double, 4, 3>::Zero();
  double inverse_square_ = 1.0, a_ = 1.0, b_ = 0.0;
};

}  // namespace

std::unique_ptr<VelocityForm> RigidBody::make_velocity_form() const {
  return std::make_unique<RigidBodyLinear>(parameters_);
}

}  // namespace takt
