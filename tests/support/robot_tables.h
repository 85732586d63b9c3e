#pragma once
// Three robots from their published (KR 16: assumed) tables, written down independently: the reference for
// the URDF files, and the source of the models in other libraries.
#include <cmath>
#include <string>
#include <vector>

#include "plant_models/mechanics/multibody_tree.h"

namespace takt::test {

inline constexpr double kDegree = M_PI / 180.0;

struct TableLink {
  const char* joint;
  Vec3 p, rpy, axis;  ///< of the joint in the previous link, and in its own frame
  double lower, upper, max_velocity, max_effort;
  double mass;
  Vec3 centre, tensor_rpy;
  double xx, yy, zz, xy, xz, yz;  ///< about the centre, in axes turned by tensor_rpy
};

inline TreeModel tree_of(const std::vector<TableLink>& table) {
  TreeModel tree;
  for (const TableLink& row : table) {
    TreeJoint joint;
    joint.parent = tree.joint_count() - 1;
    joint.joint.name = row.joint;
    joint.joint.X_PJ = {rotation_from_rpy(row.rpy), row.p};
    joint.joint.axis = row.axis;
    joint.joint.lower = row.lower;
    joint.joint.upper = row.upper;
    joint.joint.max_velocity = row.max_velocity;
    joint.joint.max_effort = row.max_effort;
    joint.inertia.mass_kg = row.mass;
    joint.inertia.p_BBcm_B = row.centre;
    Mat3 I;
    I << row.xx, row.xy, row.xz, row.xy, row.yy, row.yz, row.xz, row.yz, row.zz;
    const Mat3 R = rotation_from_rpy(row.tensor_rpy);
    joint.inertia.I_BBcm_B = R * I * R.transpose();
    tree.joints.push_back(joint);
  }
  return tree;
}

// clang-format off
inline std::vector<TableLink> ur10e_table() {
  const double h = M_PI / 2.0, d = kDegree;
  const Vec3 o = Vec3::Zero(), z = Vec3::UnitZ();
  return {
      {"shoulder_pan_joint", {0, 0, 0.1807}, o, z, -360 * d, 360 * d, 120 * d, 330, 7.369,
       {0.021, -0.027, 0}, {h, 0, 0}, 0.03408, 0.03529, 0.02156, 0.00002, -0.00425, 0.00008},
      {"shoulder_lift_joint", o, {h, 0, 0}, z, -360 * d, 360 * d, 120 * d, 330, 13.051,
       {-0.2327, 0, 0.158}, o, 0.02814, 0.77068, 0.76943, 0.00005, -0.01561, 0.00002},
      {"elbow_joint", {-0.6127, 0, 0}, o, z, -180 * d, 180 * d, 180 * d, 150, 3.989,
       {-0.33155, 0, 0.068}, o, 0.01014, 0.30928, 0.30646, 0.00008, 0.00916, 0.0},
      {"wrist_1_joint", {-0.57155, 0, 0.17415}, o, z, -360 * d, 360 * d, 180 * d, 54, 2.1,
       {0, -0.018, 0.007}, {h, 0, 0}, 0.00296, 0.00222, 0.00258, -0.00001, 0.0, -0.00024},
      {"wrist_2_joint", {0, -0.11985, 0}, {h, 0, 0}, z, -360 * d, 360 * d, 180 * d, 54, 1.98,
       {0, 0.018, -0.007}, {-h, 0, 0}, 0.00296, 0.00222, 0.00258, -0.00001, 0.0, -0.00024},
      {"wrist_3_joint", {0, 0.11655, 0}, {h, M_PI, M_PI}, z, -360 * d, 360 * d, 180 * d, 54, 0.615,
       {0, 0, -0.026}, o, 0.00040, 0.00041, 0.00034, 0.0, 0.0, 0.0}};
}

/// Inertial figures and torques assumed, see robots/kr16.urdf.
inline std::vector<TableLink> kr16_table() {
  const double d = kDegree;
  const Vec3 o = Vec3::Zero(), x = -Vec3::UnitX(), y = Vec3::UnitY(), z = -Vec3::UnitZ();
  return {
      {"joint_a1", {0, 0, 0.675}, o, z, -185 * d, 185 * d, 156 * d, 2671.7, 65,
       {0.10, 0, -0.10}, o, 1.9635, 2.4510, 2.2208, 0, 0, 0},
      {"joint_a2", {0.26, 0, 0}, o, y, -155 * d, 35 * d, 156 * d, 2671.7, 35,
       {0.34, 0, 0}, o, 0.2158, 2.5037, 2.4372, 0, 0, 0},
      {"joint_a3", {0.68, 0, 0}, o, y, -130 * d, 154 * d, 156 * d, 2671.7, 40,
       {0.05, 0, -0.02}, o, 0.4867, 0.8133, 0.8493, 0, 0, 0},
      {"joint_a4", {0.67, 0, -0.035}, o, x, -350 * d, 350 * d, 330 * d, 255.4, 12,
       {-0.30, 0, 0}, o, 0.0337, 0.3194, 0.3194, 0, 0, 0},
      {"joint_a5", o, o, y, -130 * d, 130 * d, 330 * d, 281.7, 7,
       {0.02, 0, 0}, o, 0.0252, 0.0126, 0.0252, 0, 0, 0},
      {"joint_a6", o, o, x, -350 * d, 350 * d, 615 * d, 48.8, 1,
       {0.13, 0, 0}, o, 0.0013, 0.0008, 0.0008, 0, 0, 0}};
}

/// y is up. The load is a body of its own. Ranges and torques are no figures of the source.
inline std::vector<TableLink> r3_table() {
  const Vec3 o = Vec3::Zero(), x = Vec3::UnitX(), y = Vec3::UnitY();
  const double t = 2 * M_PI;
  return {
      {"j1", {0, 0.351, 0}, o, y, -t, t, 3, 2439.4, 1,
       o, o, 0.001, 1.16, 0.001, 0, 0, 0},
      {"j2", {0, 0.324, 0.3}, o, x, -t, t, 1.5, 4878.7, 56.5,
       {0.172, 0.205, 0}, o, 2.58, 0.64, 2.73, -0.46, 0, 0},
      {"j3", {0, 0.65, 0}, o, x, -t, t, 5, 1393.9, 26.4,
       {0.064, -0.034, 0}, o, 0.279, 0.245, 0.413, -0.070, 0, 0},
      {"j4", {0, 0.414, -0.155}, o, y, -t, t, 3.1, 468.3, 28.7,
       o, o, 1.67, 0.081, 1.67, 0, 0, 0},
      {"j5", {0, 0.186, 0}, o, x, -t, t, 3.1, 413.1, 5.2,
       o, o, 1.25, 0.81, 1.53, 0, 0, 0},
      {"j6", {0, 0.125, 0}, o, y, -t, t, 4.1, 166.7, 0.5,
       {0.05, 0.05, 0.05}, o, 0.001, 0.001, 0.001, 0, 0, 0}};
}
// clang-format on

inline BodyInertia r3_load(const Vec3& centre = {0.1, 0.25, 0.1}) {
  return {15.0, centre, 0.001 * Mat3::Identity()};
}

/// r3 with its load on the flange, under its own gravity.
inline TreeModel r3_tree(const Vec3& load_centre = {0.1, 0.25, 0.1}) {
  TreeModel tree = tree_of(r3_table());
  tree.gravity_R = {0.0, -9.81, 0.0};
  BodyInertia& last = tree.joints.back().inertia;
  last = combined(last, r3_load(load_centre), Pose{});
  return tree;
}

}  // namespace takt::test
