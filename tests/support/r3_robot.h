#pragma once
// The six-axis robot r3 (figures: RobotR3 of the Modelica Standard Library 4.1.0, BSD 3-Clause), as data and
// as a DynamicRobot.
#include <cmath>
#include <memory>
#include <vector>

#include "plant_models/robot/detailed_drive.h"
#include "plant_models/robot/dynamic_robot.h"

namespace takt::r3 {

struct Body {
  double mass;
  Vec3 cm;
  double I11, I22, I33, I21;
};
struct Axis {
  bool about_y;  ///< else about x
  Vec3 offset;   ///< from the previous frame
  bool elastic;
  double n, J, k, w, D, R, c, d, Rv0, Rv1, peak;
  double start_deg, end_deg, speed, acceleration;
};

inline const Body kBodies[6] = {{1.0, {0, 0, 0}, 0.001, 1.16, 0.001, 0},
                                {56.5, {0.172, 0.205, 0}, 2.58, 0.64, 2.73, -0.46},
                                {26.4, {0.064, -0.034, 0}, 0.279, 0.245, 0.413, -0.070},
                                {28.7, {0, 0, 0}, 1.67, 0.081, 1.67, 0},
                                {5.2, {0, 0, 0}, 1.25, 0.81, 1.53, 0},
                                {0.5, {0.05, 0.05, 0.05}, 0.001, 0.001, 0.001, 0}};
inline const Body kLoad = {15.0, {0.1, 0.25, 0.1}, 0.001, 0.001, 0.001, 0};
inline const Axis kAxes[6] = {{true,
                               {0, 0.351, 0},
                               true,
                               -105,
                               0.0013,
                               1.1616,
                               4590,
                               0.6,
                               250,
                               43,
                               0.005,
                               0.4,
                               0.13 / 160,
                               1,
                               -60,
                               60,
                               3,
                               15},
                              {false,
                               {0, 0.324, 0.3},
                               true,
                               210,
                               0.0013,
                               1.1616,
                               5500,
                               0.6,
                               250,
                               8,
                               0.01,
                               0.5,
                               0.1 / 130,
                               1,
                               20,
                               -70,
                               1.5,
                               15},
                              {false,
                               {0, 0.65, 0},
                               true,
                               60,
                               0.0013,
                               1.1616,
                               5500,
                               0.6,
                               250,
                               58,
                               0.04,
                               0.7,
                               0.2 / 130,
                               1,
                               90,
                               -35,
                               5,
                               15},
                              {true,
                               {0, 0.414, -0.155},
                               false,
                               -99,
                               1.6e-4,
                               0.2365,
                               6250,
                               0.55,
                               250,
                               0,
                               0,
                               21.8,
                               9.8,
                               26.7 / 21.8,
                               0,
                               45,
                               3.1,
                               60},
                              {false,
                               {0, 0.186, 0},
                               false,
                               79.2,
                               1.8e-4,
                               0.2608,
                               6250,
                               0.55,
                               250,
                               0,
                               0,
                               30.1,
                               0.03,
                               39.6 / 30.1,
                               -110,
                               110,
                               3.1,
                               60},
                              {true,
                               {0, 0.125, 0},
                               false,
                               -99,
                               4.3e-5,
                               0.0842,
                               7400,
                               0.27,
                               250,
                               0,
                               0,
                               10.9,
                               3.92,
                               16.8 / 10.9,
                               0,
                               45,
                               4.1,
                               60}};
inline constexpr double kPositionGain = 5.0, kSpeedGain = 0.5, kIntegralTime = 0.05, kGravity = 9.81;

inline BodyInertia inertia_of(const Body& body) {
  Mat3 I = Vec3(body.I11, body.I22, body.I33).asDiagonal();
  I(1, 0) = I(0, 1) = body.I21;
  return {body.mass, body.cm, I};
}

inline DetailedDriveParameters drive_parameters(const Axis& axis) {
  DetailedDriveParameters p;
  p.elastic_gear = axis.elastic;
  p.gear_ratio = axis.n;
  p.motor_inertia_kg_m2 = axis.J;
  p.motor_constant_N_m_per_A = axis.k;
  p.current_loop_rad_per_s = axis.w;
  p.current_loop_damping = axis.D;
  p.resistance_ohm = axis.R;
  p.gear_stiffness_N_m_per_rad = axis.c;
  p.gear_damping_N_m_s_per_rad = axis.d;
  p.friction.zero_speed_N_m = axis.Rv0;
  p.friction.slope_N_m_s = axis.Rv1;
  p.friction.break_away = axis.peak;
  p.position_gain_per_s = kPositionGain;
  p.speed_gain_As_per_rad = kSpeedGain;
  p.speed_integral_time_s = kIntegralTime;
  return p;
}

inline ArmModel arm() {
  ArmModel arm;
  for (const Axis& axis : kAxes) {
    JointModel joint;
    joint.name = "j" + std::to_string(arm.joints.size() + 1);
    joint.X_PJ.p = axis.offset;
    joint.axis = axis.about_y ? Vec3::UnitY() : Vec3::UnitX();
    joint.lower = -2.0 * M_PI, joint.upper = 2.0 * M_PI;
    joint.max_velocity = axis.speed;
    joint.max_effort = 1e4;
    arm.joints.push_back(joint);
  }
  return arm;
}

inline DynamicRobotParameters robot_parameters() {
  DynamicRobotParameters p;
  p.robot = 0;
  p.arm = arm();
  p.gravity_W = {0.0, -kGravity, 0.0};
  for (const Body& body : kBodies) p.links.push_back(inertia_of(body));
  p.links[5] = combined(p.links[5], inertia_of(kLoad), Pose{});
  return p;
}

inline std::vector<std::unique_ptr<Drive>> drives() {
  std::vector<std::unique_ptr<Drive>> drives;
  for (const Axis& axis : kAxes) drives.push_back(std::make_unique<DetailedDrive>(drive_parameters(axis)));
  return drives;
}

inline std::vector<TrajectoryKnot> motion() {
  std::vector<double> from, to;
  std::vector<MotionLimits> limits;
  for (const Axis& axis : kAxes) {
    from.push_back(axis.start_deg * M_PI / 180.0);
    to.push_back(axis.end_deg * M_PI / 180.0);
    limits.push_back({axis.speed, axis.acceleration});
  }
  return point_to_point(0.0, from, to, limits);
}

}  // namespace takt::r3
