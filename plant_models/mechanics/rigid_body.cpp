#include "plant_models/mechanics/rigid_body.h"

#include <Eigen/LU>
#include <cmath>

namespace takt {

namespace {
using ConstVec3 = Eigen::Map<const Vec3>;
using MutVec3 = Eigen::Map<Vec3>;

Quat quaternion_of(const double* x) {
  return {x[3], x[4], x[5], x[6]};
}

// Rotation matrix of a quaternion whose length may have a small error: division by its squared length keeps R
// orthogonal.
Mat3 rotation_of(const double* x) {
  const double w = x[3], a = x[4], b = x[5], c = x[6];
  const double s = 2.0 / (w * w + a * a + b * b + c * c);
  Mat3 R;
  R << 1.0 - s * (b * b + c * c), s * (a * b - w * c), s * (a * c + w * b),  //
      s * (a * b + w * c), 1.0 - s * (a * a + c * c), s * (b * c - w * a),   //
      s * (a * c - w * b), s * (b * c + w * a), 1.0 - s * (a * a + b * b);
  return R;
}
}  // namespace

RigidBody::RigidBody(const RigidBodyParameters& parameters)
    : parameters_(parameters),
      I_inverse_B_(parameters.I_BBcm_B.inverse()),
      weight_W_(parameters.mass_kg * parameters.gravity_W) {}

void RigidBody::initial_state(double* x) const {
  set_state(parameters_.X_WB_initial, parameters_.V_WB_initial, x);
}

void RigidBody::set_state(const Pose& X_WB, const Twist& V_WB, double* x) const {
  MutVec3(x, 3) = X_WB * parameters_.p_BBcm;
  const Quat q = X_WB.quaternion();
  x[3] = q.w(), x[4] = q.x(), x[5] = q.y(), x[6] = q.z();
  MutVec3(x + 7, 3) = V_WB.at(X_WB.R * parameters_.p_BBcm);
  MutVec3(x + 10, 3) = V_WB.w;
}

void RigidBody::write_motion(double, const double* x, CellMotion& motion) const {
  BodyMotion& body = motion.bodies[static_cast<size_t>(parameters_.body)];
  body.X_WB.R = rotation_of(x);
  body.p_WBcm = ConstVec3(x);
  const Vec3 r = body.X_WB.R * parameters_.p_BBcm;  // from Bo to Bcm
  body.X_WB.p = body.p_WBcm - r;
  body.V_WB.w = ConstVec3(x + 10);
  body.V_WB.v = ConstVec3(x + 7) - body.V_WB.w.cross(r);
}

void RigidBody::derivatives(double, const double* x, const CellMotion& motion,
                            std::span<const Wrench> wrenches, double* xdot) const {
  const Wrench& F = wrenches[static_cast<size_t>(parameters_.body)];
  const Mat3& R_WB = motion.bodies[static_cast<size_t>(parameters_.body)].X_WB.R;
  const Vec3 w = ConstVec3(x + 10);
  MutVec3(xdot, 3) = ConstVec3(x + 7);

  // q' = 1/2 w q (w in world axes) + stabilisation of the length.
  const Quat q = quaternion_of(x);
  const double stabilise = kQuaternionStabilisation * (1.0 - q.squaredNorm());
  xdot[3] = 0.5 * (-w.x() * q.x() - w.y() * q.y() - w.z() * q.z()) + stabilise * q.w();
  xdot[4] = 0.5 * (w.x() * q.w() + w.y() * q.z() - w.z() * q.y()) + stabilise * q.x();
  xdot[5] = 0.5 * (w.y() * q.w() + w.z() * q.x() - w.x() * q.z()) + stabilise * q.y();
  xdot[6] = 0.5 * (w.z() * q.w() + w.x() * q.y() - w.y() * q.x()) + stabilise * q.z();

  // Newton: the weight is added to the wrench before dividing, so that a carried Part has exactly zero
  // acceleration.
  MutVec3(xdot + 7, 3) = (weight_W_ + F.f) / parameters_.mass_kg;
  // Euler in body axes.
  const Vec3 w_B = R_WB.transpose() * w;
  const Vec3 t_B = R_WB.transpose() * F.t;
  MutVec3(xdot + 10, 3) = R_WB * (I_inverse_B_ * (t_B - w_B.cross(parameters_.I_BBcm_B * w_B)));
}

void RigidBody::state_scales(double* scales) const {
  constexpr double kLength_m = 0.005, kSpeed_m_per_s = 0.05;
  // Errors of rotation count as those of the points that they move: no point of a solid box is further from the centre of
  // mass than sqrt(3) times its polar radius of gyration, and half of the inertia's trace is that radius squared per mass.
  const double radius_m = std::sqrt(1.5 * parameters_.I_BBcm_B.trace() / parameters_.mass_kg);
  for (int i = 0; i < 3; ++i) scales[i] = kLength_m;
  for (int i = 3; i < 7; ++i) scales[i] = 0.5 * kLength_m / radius_m;  // q' is half of the rotation
  for (int i = 7; i < 10; ++i) scales[i] = kSpeed_m_per_s;
  for (int i = 10; i < kStates; ++i) scales[i] = kSpeed_m_per_s / radius_m;
}

double mechanical_energy(const RigidBodyParameters& parameters, const double* x) {
  const Mat3 R_WB = rotation_of(x);
  const Vec3 v = ConstVec3(x + 7);
  const Vec3 w_B = R_WB.transpose() * ConstVec3(x + 10);
  return 0.5 * parameters.mass_kg * v.squaredNorm() + 0.5 * w_B.dot(parameters.I_BBcm_B * w_B) -
         parameters.mass_kg * parameters.gravity_W.dot(ConstVec3(x));
}

}  // namespace takt
