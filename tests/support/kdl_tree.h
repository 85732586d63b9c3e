#pragma once
// The same tree for Orocos KDL, the second opinion on dynamics. A KDL segment is a joint followed by a frame,
// in which its inertia and its wrenches are given: here the frame of the link.
#include <kdl/chain.hpp>
#include <kdl/chaindynparam.hpp>
#include <kdl/chainfdsolver_recursive_newton_euler.hpp>
#include <kdl/chainidsolver_recursive_newton_euler.hpp>
#include <kdl/tree.hpp>
#include <kdl/treeidsolver_recursive_newton_euler.hpp>
#include <map>

#include "plant_models/mechanics/multibody_tree.h"

namespace takt::test {

inline KDL::Vector kdl(const Vec3& v) {
  return {v.x(), v.y(), v.z()};
}
inline KDL::Rotation kdl(const Mat3& R) {
  return {R(0, 0), R(0, 1), R(0, 2), R(1, 0), R(1, 1), R(1, 2), R(2, 0), R(2, 1), R(2, 2)};
}
inline KDL::Frame kdl(const Pose& X) {
  return {kdl(X.R), kdl(X.p)};
}
inline KDL::RigidBodyInertia kdl(const BodyInertia& body) {
  const Mat3& I = body.I_BBcm_B;
  return KDL::RigidBodyInertia(body.mass_kg, kdl(body.p_BBcm_B),
                               KDL::RotationalInertia(I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2), I(1, 2)));
}
inline KDL::Wrench kdl(const Wrench& F) {
  return {kdl(F.f), kdl(F.t)};
}

inline KDL::Segment kdl(const TreeJoint& joint) {
  const Pose& X = joint.joint.X_PJ;
  const Vec3 axis_P = X.R * joint.joint.axis;
  const auto type =
      joint.joint.type == JointType::revolute ? KDL::Joint::JointType::RotAxis : KDL::Joint::TransAxis;
  return KDL::Segment(joint.joint.name, KDL::Joint(joint.joint.name, kdl(X.p), kdl(axis_P), type), kdl(X),
                      kdl(joint.inertia));
}

/// `floating`: six joints x, y, z, then about x, y, z stand between the root and the tree. Held at zero,
/// their forces are the wrench on the tree from its foundation.
inline KDL::Tree kdl_tree(const TreeModel& model, bool floating = false) {
  KDL::Tree tree("root");
  std::string base = "root";
  if (floating) {
    for (const auto type : {KDL::Joint::TransX, KDL::Joint::TransY, KDL::Joint::TransZ, KDL::Joint::RotX,
                            KDL::Joint::RotY, KDL::Joint::RotZ}) {
      const std::string name = "base" + std::to_string(static_cast<int>(type));
      tree.addSegment(KDL::Segment(name, KDL::Joint(name, type)), base);
      base = name;
    }
  }
  for (const TreeJoint& joint : model.joints) {
    tree.addSegment(kdl(joint),
                    joint.parent < 0 ? base : model.joints[static_cast<size_t>(joint.parent)].joint.name);
  }
  return tree;
}

/// Of a model without branches.
inline KDL::Chain kdl_chain(const TreeModel& model) {
  KDL::Chain chain;
  for (const TreeJoint& joint : model.joints) chain.addSegment(kdl(joint));
  return chain;
}

inline KDL::JntArray kdl_joints(const JointArray& values, int count) {
  KDL::JntArray result(static_cast<unsigned>(count));
  for (int i = 0; i < count; ++i) result(static_cast<unsigned>(i)) = values[static_cast<size_t>(i)];
  return result;
}

/// KDL has its own order of joints: index there of joint i here.
inline std::vector<unsigned> kdl_numbers(const TreeModel& model, const KDL::Tree& tree) {
  std::vector<unsigned> result;
  for (const TreeJoint& joint : model.joints)
    result.push_back(GetTreeElementQNr(tree.getSegment(joint.joint.name)->second));
  return result;
}

}  // namespace takt::test
