#include "client_lib/gateway/ur/force_mode.h"

#include <algorithm>
#include <cmath>

namespace takt::ur {
namespace {

constexpr double kSmallestWay_m = 1e-9;
/// Mass of a tool without contact, in multiples of that in contact.
constexpr double kFreeMasses = 4.0;

/// Axes whose `first` column is along `wanted`, and whose z is as near to `z` as that allows.
Mat3 axes_with(int first, const Vec3& wanted, const Vec3& z) {
  const Vec3 a = wanted.normalized();
  Vec3 up = z - z.dot(a) * a;
  if (up.norm() < 1e-6) up = a.unitOrthogonal();
  up.normalize();
  Mat3 R;
  if (first == 0)
    R << a, up.cross(a), up;
  else
    R << a.cross(up), a, up;
  return R;
}

Mat3 turned_by(const Vec3& turn) {
  const double angle = turn.norm();
  return angle > 0.0 ? Mat3(Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix()) : Mat3::Identity();
}

}  // namespace

std::string problem_of(const ForceModeOptions& options) {
  const auto type = static_cast<int>(options.type);
  if (type < 1 || type > 3) return "force_mode: type: found " + std::to_string(type) + "; allowed: 1, 2, 3";
  for (std::size_t i = 0; i < 6; ++i)
    if (options.compliant.at(i) && !(options.speed_limit.at(i) > 0.0))
      return "force_mode: limits: found " + std::to_string(options.speed_limit.at(i)) +
             " of a compliant axis; allowed: a speed above 0";
  if (!(options.damping >= 0.0 && options.damping <= 1.0))
    return "force_mode_set_damping: found " + std::to_string(options.damping) + "; allowed: 0 to 1";
  if (!(options.gain >= 0.0 && options.gain <= 2.0))
    return "force_mode_set_gain_scaling: found " + std::to_string(options.gain) + "; allowed: 0 to 2";
  return {};
}

void ForceMode::turn_axes(const Vec3& program_way) {
  const Mat3& K = options_.X_RK.R;
  switch (options_.type) {
    case ForceModeOptions::Type::fixed:
      return;
    case ForceModeOptions::Type::toward_frame: {
      const Vec3 way = options_.X_RK.p - commanded_.p;
      if (way.norm() > kSmallestWay_m) axes_ = axes_with(1, way, K.col(2));
      return;
    }
    case ForceModeOptions::Type::along_velocity: {
      const Vec3 flat = program_way - program_way.dot(K.col(2)) * K.col(2);
      if (flat.norm() > kSmallestWay_m) axes_ = axes_with(0, flat, K.col(2));
      return;
    }
  }
}

const Pose& ForceMode::advance(const Pose& program, const Wrench& measured_R, double dt_s) {
  const Vec3 way = program.p - program_.p, turn = rotation_vector(program.R * program_.R.transpose());
  program_ = program;
  turn_axes(way);
  const Vec3 force = axes_.transpose() * measured_R.f, torque = axes_.transpose() * measured_R.t;
  Vec3 move = axes_.transpose() * way, rotate = axes_.transpose() * turn;
  for (std::size_t i = 0; i < 6; ++i) {
    const auto axis = static_cast<Eigen::Index>(i % 3);
    if (!options_.compliant.at(i)) {
      speed_.at(i) = 0.0;
      continue;
    }
    const bool linear = i < 3;
    const double measured = (linear ? force : torque)[axis];
    double& contact_s = contact_left_s_.at(i);
    contact_s = std::abs(measured) >= (linear ? kContact_N : kContact_N_m) ? kContactMemory_s
                                                                           : std::max(0.0, contact_s - dt_s);
    const bool free = contact_s <= 0.0;
    const double damping = free ? 0.0 : linear ? kContactDamping_N_s_per_m : kContactDamping_N_m_s;
    const double mass = (free ? kFreeMasses : 1.0) * (linear ? kMass_kg : kInertia_kg_m2);
    const double next = ((1.0 - options_.damping) * mass * speed_.at(i) +
                         options_.gain * (options_.wrench.at(i) + measured) * dt_s) /
                        (mass + damping * dt_s);
    const double limit = options_.speed_limit.at(i);
    speed_.at(i) = std::clamp(next, -limit, limit);
    (linear ? move : rotate)[axis] = speed_.at(i) * dt_s;
  }
  commanded_.p += axes_ * move;
  commanded_.R = turned_by(axes_ * rotate) * commanded_.R;
  return commanded_;
}

}  // namespace takt::ur
