#pragma once
// Force mode of a UR controller as an admittance: along and about compliant axes of a task frame the measured wrench moves the
// tool; along the others the tool follows its program. Pure: no clock, no transport.
//
// The law of a real controller is not published. Here, for each compliant axis and cycle of dt:
//
//   (m + c dt) v' = (1 - damping) m v + gain (wanted + measured) dt          c: in contact alone
//
// `damping` and `gain` are those of force_mode_set_damping() and force_mode_set_gain_scaling(): 1 stops a tool without force at
// once, 0 keeps its speed. Mass m (in contact kMass_kg, else four times as much) and damping c are assumed; contacts of up to some
// 2e5 N/m are stable at measurements that are 10 ms old. A harder contact needs a smaller gain scaling, as on the real robot.
// Source of the functions: UR, Script Manual e-Series, force_mode().
#include <array>
#include <cstdint>
#include <string>

#include "client_lib/kinematics/inverse_kinematics.h"

namespace takt::ur {

struct ForceModeOptions {
  enum class Type : std::uint8_t {
    toward_frame = 1,    ///< y of the axes points from the TCP to the task frame's origin
    fixed = 2,           ///< the task frame
    along_velocity = 3,  ///< x is the TCP's velocity in the x-y plane of the task frame
  };
  Pose X_RK;                        ///< task frame K in the robot's base
  std::array<bool, 6> compliant{};  ///< x, y, z, about x, about y, about z
  std::array<double, 6> wrench{};   ///< that the robot exerts on its environment: N, N m
  Type type = Type::fixed;
  std::array<double, 6> speed_limit{};  ///< of compliant axes: m/s, rad/s
  double damping = 0.005, gain = 1.0;
  bool operator==(const ForceModeOptions& other) const {
    return X_RK.p == other.X_RK.p && X_RK.R == other.X_RK.R && compliant == other.compliant &&
           wrench == other.wrench && type == other.type && speed_limit == other.speed_limit &&
           damping == other.damping && gain == other.gain;
  }
};

/// From the number that programs write; any other number gives a type that problem_of() refuses.
inline ForceModeOptions::Type force_mode_type(double number) {
  return number == 1.0   ? ForceModeOptions::Type::toward_frame
         : number == 2.0 ? ForceModeOptions::Type::fixed
         : number == 3.0 ? ForceModeOptions::Type::along_velocity
                         : ForceModeOptions::Type{};
}

/// Why the options are refused; empty: they are valid.
std::string problem_of(const ForceModeOptions& options);

class ForceMode {
 public:
  static constexpr double kMass_kg = 5.0, kInertia_kg_m2 = 0.05;
  static constexpr double kContactDamping_N_s_per_m = 2000.0, kContactDamping_N_m_s = 20.0;
  /// Contact lasts from a larger force on until so long after the last one, so that a tool that bounces stays damped.
  static constexpr double kContact_N = 1.0, kContact_N_m = 0.1, kContactMemory_s = 0.5;

  /// The tool stands at X_RT, with its program at X_RT too.
  ForceMode(const ForceModeOptions& options, const Pose& X_RT)
      : options_(options), commanded_(X_RT), program_(X_RT), axes_(options.X_RK.R) {}

  /// One cycle. `program`: pose of the TCP that the program wants; `measured_R`: wrench of the environment on the tool about the
  /// TCP, in the axes of the robot's base. Returns the pose to command.
  const Pose& advance(const Pose& program, const Wrench& measured_R, double dt_s);
  const Pose& commanded() const { return commanded_; }
  /// Speed along and about each axis; 0 of those that are not compliant.
  const std::array<double, 6>& speed() const { return speed_; }
  const ForceModeOptions& options() const { return options_; }

 private:
  void turn_axes(const Vec3& program_way);

  ForceModeOptions options_;
  Pose commanded_, program_;
  Mat3 axes_;  ///< of the compliance, in R
  std::array<double, 6> speed_{};
  std::array<double, 6> contact_left_s_{};
};

}  // namespace takt::ur
