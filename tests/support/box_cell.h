#pragma once
// Small cells made of boxes, built in code: no files needed.
#include <memory>
#include <string>
#include <vector>

#include "server/simulation/model/cell_model.h"

namespace takt::test {

/// A solid box as convex shape, its frame at the centre of the bottom face.
inline ConvexShape box_shape(const Vec3& size_m) {
  std::vector<Vec3> corners;
  for (int i = 0; i < 8; ++i) {
    corners.emplace_back(((i & 1) ? 0.5 : -0.5) * size_m.x(), ((i & 2) ? 0.5 : -0.5) * size_m.y(),
                         ((i & 4) ? 1.0 : 0.0) * size_m.z());
  }
  return ConvexShape::from_points(corners);
}

inline Mat3 box_inertia(double mass_kg, const Vec3& s) {
  return Vec3(s.y() * s.y() + s.z() * s.z(), s.x() * s.x() + s.z() * s.z(), s.x() * s.x() + s.y() * s.y())
             .asDiagonal() *
         (mass_kg / 12.0);
}

class BoxCell {
 public:
  BoxCell() : cell_(std::make_shared<CellModel>()) {
    cell_->description.scenario = "boxes";
    gravity({0.0, 0.0, -9.80665});
  }

  BoxCell& gravity(const Vec3& g) {
    cell_->interaction.gravity_W = g;
    cell_->description.gravity_m_per_s2 = g;
    return *this;
  }
  BoxCell& step(double h) {
    cell_->step_s = h;
    cell_->description.step_s = h;
    return *this;
  }
  BoxCell& feed_forward(bool on) {
    cell_->interaction.weight_feed_forward = on;
    return *this;
  }

  int ground(const std::string& name, const Vec3& size_m, const Pose& X_WB) {
    Component c;
    c.name = name;
    c.type = ComponentType::ground;
    c.convex = {box_shape(size_m)};
    const int id = add(c);
    cell_->grounds.push_back({id, X_WB});
    return id;
  }

  int part(const std::string& name, double mass_kg, int hierarchy, const Vec3& size_m, const Pose& X_WB,
           double allowed_error_m = 1e-4) {
    Component c;
    c.name = name;
    c.type = ComponentType::part;
    c.hierarchy = hierarchy;
    c.mass_kg = mass_kg;
    c.p_BBcm = Vec3(0.0, 0.0, 0.5 * size_m.z());
    c.I_BBcm_B = box_inertia(mass_kg, size_m);
    c.convex = {box_shape(size_m)};
    c.substitute = substitute_parameters(mass_kg, c.I_BBcm_B, 9.80665, allowed_error_m, 1.0);
    const RigidBodyParameters body{static_cast<int>(cell_->components.size()),
                                   mass_kg,
                                   c.p_BBcm,
                                   c.I_BBcm_B,
                                   cell_->interaction.gravity_W,
                                   X_WB};
    cell_->parts.push_back(body);
    return add(c);
  }

  /// A "robot" of three slides x, y, z and three hinges about x, y, z, with a parallel gripper whose jaws
  /// hang below the flange: pads 40 mm wide (x), 10 mm thick, 60 mm long, tips at z = -0.06 of the flange.
  int gantry_with_gripper(const std::string& robot, const std::string& gripper, const Pose& X_WR,
                          GraspRule rule = GraspRule::on_command) {
    KinematicRobotParameters r;
    r.robot = static_cast<int>(cell_->robots.size());
    r.X_WR = X_WR;
    for (int i = 0; i < 6; ++i) {
      JointModel joint;
      joint.name = robot + "_" + std::to_string(i + 1);
      joint.type = i < 3 ? JointType::prismatic : JointType::revolute;
      joint.axis = Vec3::Unit(i % 3);
      joint.lower = -3.0, joint.upper = 3.0;
      joint.max_velocity = 2.0, joint.max_effort = 1000.0;
      r.arm.joints.push_back(joint);
    }
    cell_->robots.push_back(r);
    cell_->description.robots.push_back({robot, "", r.arm, X_WR, 0.008});

    GripperModel g;
    g.parameters.robot = r.robot;
    g.parameters.max_width_m = g.parameters.initial_width_m = 0.2;
    g.parameters.jaw_speed_m_per_s = 0.1;
    g.rule = rule;
    g.max_force_N = 100.0;
    g.face_x_lower_m = -0.02, g.face_x_upper_m = 0.02, g.face_z_lower_m = -0.06, g.face_z_upper_m = 0.0;
    std::vector<Vec3> jaw;
    for (int i = 0; i < 8; ++i) {
      jaw.emplace_back((i & 1) ? 0.02 : -0.02, (i & 2) ? 0.01 : 0.0, (i & 4) ? 0.0 : -0.06);
    }
    const int index = static_cast<int>(cell_->grippers.size());
    for (const GripperRole role : {GripperRole::palm, GripperRole::left_jaw, GripperRole::right_jaw}) {
      Component c;
      c.name = gripper + (role == GripperRole::palm       ? ""
                          : role == GripperRole::left_jaw ? "/left_jaw"
                                                          : "/right_jaw");
      c.type = ComponentType::gripper;
      c.gripper = index;
      c.role = role;
      if (role != GripperRole::palm) c.convex = {ConvexShape::from_points(jaw)};
      const int id = add(c);
      if (role == GripperRole::palm) g.parameters.palm = id;
      if (role == GripperRole::left_jaw) g.parameters.jaws[0] = id;
      if (role == GripperRole::right_jaw) g.parameters.jaws[1] = id;
    }
    cell_->grippers.push_back(g);
    GripperDescription d;
    d.name = gripper;
    d.robot = r.robot;
    d.component = g.parameters.palm;
    d.left_jaw = g.parameters.jaws[0];
    d.right_jaw = g.parameters.jaws[1];
    d.max_width_m = 0.2;
    d.max_force_N = 100.0;
    d.jaw_speed_m_per_s = 0.1;
    cell_->description.grippers.push_back(d);
    return g.parameters.palm;
  }

  CellModel& model() { return *cell_; }
  std::shared_ptr<const CellModel> build() {
    cell_->pairs = generate_pairs(cell_->components);
    return cell_;
  }

 private:
  int add(Component component) {
    component.box = component.convex.box();
    ComponentDescription d;
    d.name = component.name;
    d.type = component.type;
    d.hierarchy = component.hierarchy;
    d.mass_kg = component.mass_kg;
    d.p_BBcm = component.p_BBcm;
    cell_->description.components.push_back(d);
    cell_->components.push_back(std::move(component));
    return static_cast<int>(cell_->components.size()) - 1;
  }
  std::shared_ptr<CellModel> cell_;
};

inline Pose at(double x, double y, double z) {
  return {Mat3::Identity(), Vec3(x, y, z)};
}

}  // namespace takt::test
