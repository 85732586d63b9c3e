#include "server/scenario/sdf_robot.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "idl/common/text.h"
#include "idl/common/xml.h"
#include "plant_models/robot/arm_kinematics.h"

namespace takt {

namespace {

constexpr double kLongWay_m = 10.0;                        ///< of a prismatic joint without limit
constexpr double kFingerSpeed = 0.1, kFingerForce = 50.0;  ///< m/s, N, of fingers that state none

std::string numbers(const Vec3& v) {
  return join(v, " ", [](double x) { return exact_text(x + 0.0); });
}

/// Fixed-axis roll, pitch, yaw.
Vec3 rpy_of(const Mat3& R) {
  const double pitch = std::atan2(-R(2, 0), std::hypot(R(0, 0), R(1, 0)));
  if (std::hypot(R(0, 0), R(1, 0)) < 1e-9) return {std::atan2(-R(1, 2), R(1, 1)), pitch, 0.0};
  return {std::atan2(R(2, 1), R(2, 2)), pitch, std::atan2(R(1, 0), R(0, 0))};
}

std::string origin(const Pose& X) {
  return "<origin xyz='" + numbers(X.p) + "' rpy='" + numbers(rpy_of(X.R)) + "'/>";
}

/// A text in an attribute.
std::string quoted(const std::string& text) {
  return "\"" + xml_escaped(text) + "\"";
}

class Builder {
 public:
  Builder(const SdfModel& model, const std::vector<std::size_t>& links,
          const std::function<std::optional<std::string>(const UrdfShape&)>& mesh_name)
      : model_(model),
        mesh_name_(mesh_name),
        own_(links.begin(), links.end()),
        above_(model.links.size()),
        world_(model.links.size()) {}

  std::optional<SdfRobot> build() {
    for (std::size_t i = 0; i < model_.joints.size(); ++i) add_joint(i);
    if (std::none_of(joints_.begin(), joints_.end(), [&](std::size_t i) { return moves(joint(i)); }))
      return std::nullopt;
    find_base();
    if (chain_below(base_) == 0) return std::nullopt;  // its moving joints are a loop
    collect(base_);
    for (const std::size_t link : own_)
      if (std::find(walk_.begin(), walk_.end(), link) == walk_.end())
        note(model_.name + ": link '" + model_.links[link].name +
             "' is left out: no joint leads to it from '" + name(base_) + "'");
    choose_flange();
    write();
    return std::move(result_);
  }

 private:
  const SdfJoint& joint(std::size_t i) const { return model_.joints[i]; }
  std::size_t parent(std::size_t i) const { return joint(i).parent.value_or(world_); }
  std::string name(std::size_t link) const {
    if (link == world_) return "world";
    std::string text = model_.links[link].name;
    for (std::size_t at = text.find("::"); at != std::string::npos; at = text.find("::"))
      text.replace(at, 2, "_");
    return text;
  }
  void note(const std::string& sentence) { result_.notes.push_back(sentence + "."); }

  void add_joint(std::size_t i) {
    const SdfJoint& j = joint(i);
    if (!own_.contains(j.child)) return;
    if (above_[j.child]) {
      note(j.place + "joint '" + j.name + "' is left out: joint '" + joint(*above_[j.child]).name +
           "' carries link '" + model_.links[j.child].name + "' already; takt has no loops of joints");
      return;
    }
    above_[j.child] = i;
    joints_.push_back(i);
  }

  void find_base() {
    base_ = world_;
    int longest = -1;
    for (const std::size_t link : own_)
      if (!above_[link] && chain_below(link) > longest) base_ = link, longest = chain_below(link);
    if (base_ != world_) {
      note(model_.name + ": its link '" + name(base_) +
           "' is free in the file; as the base of a robot it stands");
      return;
    }
    // The first link that a fixed joint holds in the world, else the world itself.
    for (const std::size_t i : joints_)
      if (!joint(i).parent && !moves(joint(i))) {
        base_ = joint(i).child;
        return;
      }
  }

  void collect(std::size_t from) {
    walk_.push_back(from);
    for (std::size_t at = 0; at < walk_.size() && walk_.size() <= own_.size() + 1; ++at)
      for (const std::size_t i : joints_)
        if (parent(i) == walk_[at] && joint(i).child != base_) walk_.push_back(joint(i).child);
  }

  std::vector<std::size_t> below(std::size_t link) const {
    std::vector<std::size_t> found;
    for (const std::size_t i : joints_)
      if (parent(i) == link && joint(i).child != base_) found.push_back(i);
    return found;
  }
  /// Moving joints of the longest chain that begins with this joint.
  int reach(std::size_t i) const { return chain_below(joint(i).child) + (moves(joint(i)) ? 1 : 0); }
  int chain_below(std::size_t link) const {
    int longest = 0;
    for (const std::size_t next : below(link)) longest = std::max(longest, reach(next));
    return longest;
  }
  /// Joints with motion that the link, or what is fixed to it, carries.
  void branches(std::size_t link, std::vector<std::size_t>& found) const {
    for (const std::size_t i : below(link)) {
      if (reach(i) == 0) continue;
      if (moves(joint(i)))
        found.push_back(i);
      else
        branches(joint(i).child, found);
    }
  }

  void choose_flange() {
    std::size_t flange = base_;
    for (int count = 0; count < kMaxJoints; ++count) {
      std::vector<std::size_t> next;
      branches(flange, next);
      if (next.empty() || (next.size() > 1 && count > 0)) break;
      const std::size_t longest = *std::max_element(
          next.begin(), next.end(), [&](std::size_t a, std::size_t b) { return reach(a) < reach(b); });
      flange = joint(longest).child;
      const SdfJoint& j = joint(longest);
      const bool free = !std::isfinite(j.lower) || !std::isfinite(j.upper);
      result_.initial_joints.push_back(free ? 0.0 : std::clamp(0.0, j.lower, j.upper));
    }
    result_.base_link = name(base_), result_.flange_link = name(flange);
    choose_fingers(flange);
  }

  /// Has the link, or what is fixed to it, a shape?
  bool has_shape(std::size_t link) const {
    if (link != world_ && !(model_.links[link].visuals.empty() && model_.links[link].collisions.empty()))
      return true;
    const std::vector<std::size_t> joints = below(link);
    return std::any_of(joints.begin(), joints.end(),
                       [&](std::size_t i) { return !moves(joint(i)) && has_shape(joint(i).child); });
  }

  void choose_fingers(std::size_t flange) {
    std::vector<std::size_t> carried;
    branches(flange, carried);
    const auto is_finger = [&](std::size_t i) {
      return joint(i).type == UrdfJointType::prismatic && reach(i) == 1 && std::isfinite(joint(i).lower) &&
             std::isfinite(joint(i).upper) && parent(i) == parent(carried[0]) && has_shape(parent(i)) &&
             has_shape(joint(i).child);
    };
    if (result_.initial_joints.empty() || carried.size() != 2 ||
        !std::all_of(carried.begin(), carried.end(), is_finger))
      return;
    for (const std::size_t i : carried) result_.fingers.push_back(joint(i).name), fingers_.insert(i);
  }

  /// Frame of the link in its URDF: that of the joint above it.
  Pose X_WU(std::size_t link) const {
    if (link == world_) return {};
    return link != base_ && above_[link] ? joint(*above_[link]).X_WJ : model_.links[link].X_WL;
  }

  void write() {
    result_.X_WR = X_WU(base_);
    result_.urdf = "<?xml version=\"1.0\"?>\n<robot name=" + quoted(model_.name) + ">\n";
    for (const std::size_t link : walk_) write_link(link);
    for (const std::size_t link : walk_)
      if (link != base_) write_joint(*above_[link]);
    result_.urdf += "</robot>\n";
  }

  void write_link(std::size_t index) {
    std::string& out = result_.urdf;
    out += "  <link name=" + quoted(name(index)) + ">\n";
    if (index != world_) {
      const SdfLink& link = model_.links[index];
      const Pose X_UL = X_WU(index).inverse() * link.X_WL;
      if (link.inertial) write_inertial(*link.inertial, X_UL);
      for (const UrdfShape& shape : link.visuals) write_shape("visual", shape, X_UL);
      for (const UrdfShape& shape : link.collisions) write_shape("collision", shape, X_UL);
    }
    out += "  </link>\n";
  }

  void write_inertial(const UrdfInertial& inertial, const Pose& X_UL) {
    const Mat3& I = inertial.at_centre.I_BBcm_B;
    const auto moment = [](const char* which, double value) {
      return " " + std::string(which) + "='" + exact_text(value) + "'";
    };
    result_.urdf += "    <inertial>" + origin(X_UL * inertial.X_LC) + "<mass value='" +
                    exact_text(inertial.at_centre.mass_kg) + "'/><inertia" + moment("ixx", I(0, 0)) +
                    moment("ixy", I(0, 1)) + moment("ixz", I(0, 2)) + moment("iyy", I(1, 1)) +
                    moment("iyz", I(1, 2)) + moment("izz", I(2, 2)) + "/></inertial>\n";
  }

  void write_shape(const char* element, const UrdfShape& shape, const Pose& X_UL) {
    std::string geometry;
    switch (shape.kind) {
      case UrdfShapeKind::box:
        geometry = "<box size='" + numbers(shape.size_m) + "'/>";
        break;
      case UrdfShapeKind::sphere:
        geometry = "<sphere radius='" + exact_text(shape.radius_m * shape.scale.maxCoeff()) + "'/>";
        break;
      case UrdfShapeKind::cylinder:
        geometry = "<cylinder radius='" + exact_text(shape.radius_m) + "' length='" +
                   exact_text(shape.length_m) + "'/>";
        break;
      case UrdfShapeKind::mesh: {
        const auto file = mesh_name_(shape);
        if (!file) return;
        geometry = "<mesh filename=" + quoted(*file) + " scale='" + numbers(shape.scale) + "'/>";
        break;
      }
    }
    if (shape.kind == UrdfShapeKind::sphere && shape.scale.maxCoeff() > shape.scale.minCoeff())
      note(model_.name + ": an ellipsoid of a robot is the sphere around it");
    result_.urdf += "    <" + std::string(element) + ">" + origin(X_UL * shape.X_LS) + "<geometry>" +
                    geometry + "</geometry></" + element + ">\n";
  }

  void write_joint(std::size_t i) {
    const SdfJoint& j = joint(i);
    const bool limited = std::isfinite(j.lower) && std::isfinite(j.upper);
    const bool slides = j.type == UrdfJointType::prismatic;
    std::string type = "fixed";
    if (moves(j) && slides)
      type = "prismatic";
    else if (moves(j))
      type = limited && j.type == UrdfJointType::revolute ? "revolute" : "continuous";
    if (slides && !limited)
      note(j.place + "joint '" + j.name + "' has no limits; " + number_text(kLongWay_m) +
           " m to each side are assumed");
    result_.urdf += "  <joint name=" + quoted(j.name) + " type='" + type + "'>" +
                    origin(X_WU(parent(i)).inverse() * j.X_WJ) + "<parent link=" + quoted(name(parent(i))) +
                    "/><child link=" + quoted(name(j.child)) + "/>";
    if (moves(j)) {
      double velocity = j.velocity, effort = j.effort;
      if (fingers_.contains(i)) {
        const auto assume = [&](double& value, double assumed, const char* what, const char* unit) {
          if (value > 0.0) return;
          value = assumed;
          note(j.place + "joint '" + j.name + "', a finger, has no " + what + "; " + number_text(assumed) +
               " " + unit + " is assumed");
        };
        assume(velocity, kFingerSpeed, "velocity", "m/s"), assume(effort, kFingerForce, "effort", "N");
      }
      const double lower = std::isfinite(j.lower) ? j.lower : -kLongWay_m,
                   upper = std::isfinite(j.upper) ? j.upper : kLongWay_m;
      result_.urdf += "<axis xyz='" + numbers(j.axis) + "'/><limit lower='" + exact_text(lower) +
                      "' upper='" + exact_text(upper) + "' velocity='" + exact_text(velocity) + "' effort='" +
                      exact_text(effort) + "'/>";
    }
    result_.urdf += "</joint>\n";
  }

  const SdfModel& model_;
  const std::function<std::optional<std::string>(const UrdfShape&)>& mesh_name_;
  const std::set<std::size_t> own_;
  std::vector<std::optional<std::size_t>> above_;  ///< by link: the joint that carries it
  const std::size_t world_;                        ///< the world as a link
  std::vector<std::size_t> joints_;                ///< those of a tree
  std::size_t base_ = 0;
  std::vector<std::size_t> walk_;  ///< links from the base on
  std::set<std::size_t> fingers_;  ///< joints
  SdfRobot result_;
};

}  // namespace

bool moves(const SdfJoint& joint) {
  if (joint.lower == joint.upper) return false;
  return joint.type == UrdfJointType::revolute || joint.type == UrdfJointType::continuous ||
         joint.type == UrdfJointType::prismatic;
}

std::optional<SdfRobot> sdf_robot(
    const SdfModel& model, const std::vector<std::size_t>& links,
    const std::function<std::optional<std::string>(const UrdfShape&)>& mesh_name) {
  return Builder(model, links, mesh_name).build();
}

}  // namespace takt
