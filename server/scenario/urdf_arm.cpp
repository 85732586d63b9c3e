#include "server/scenario/urdf_arm.h"

#include <algorithm>
#include <iterator>
#include <numbers>
#include <string_view>

#include "idl/common/text.h"
#include "server/scenario/urdf_shape_inertias.h"

namespace takt {

namespace {

bool has_link(const UrdfRobot& robot, std::string_view name) {
  return std::any_of(robot.links.begin(), robot.links.end(),
                     [&](const UrdfLink& link) { return link.name == name; });
}

/// The link that a key of the scenario's robot names.
std::size_t link_of(const UrdfRobot& robot, const std::string& key, const std::string& name) {
  if (!has_link(robot, name))
    robot.fail(0, "the robot's key " + key + ": found '" + name +
                      "', which is no link of this file; allowed: " + list_names(robot.links));
  return robot.find_link(name);
}

/// Whether a joint, or one below it, moves; by joint.
std::vector<bool> leads_to_motion(const UrdfRobot& robot) {
  std::vector<bool> leads(robot.joints.size(), false);
  for (std::size_t i = 0; i < robot.joints.size(); ++i) {
    if (robot.joints[i].type == UrdfJointType::fixed) continue;
    for (std::size_t joint = i; !leads[joint];) {
      leads[joint] = true;
      const std::optional<std::size_t>& above = robot.links[robot.joints[joint].parent].above;
      if (!above) break;
      joint = *above;
    }
  }
  return leads;
}

std::size_t end_of_motion(const UrdfRobot& robot, std::size_t base) {
  const std::vector<bool> leads = leads_to_motion(robot);
  std::size_t link = base;
  for (bool moved = false;;) {
    const std::vector<std::size_t>& below = robot.links[link].below;
    std::vector<std::size_t> next;
    std::copy_if(below.begin(), below.end(), std::back_inserter(next),
                 [&](std::size_t i) { return leads[i]; });
    if (next.size() > 1 && !moved)
      robot.fail(robot.links[link].line,
                 "link '" + robot.links[link].name + "' carries several chains of moving joints: " +
                     join(next, ", ", [&](std::size_t i) { return robot.joints[i].name; }) +
                     "; the robot's keys base_link and flange_link name the ends of one. Links: " +
                     list_names(robot.links));
    if (next.empty() && below.size() == 1) next = below;
    if (next.size() != 1) return link;
    moved = moved || robot.joints[next.front()].type != UrdfJointType::fixed;
    link = robot.joints[next.front()].child;
  }
}

bool is_below(const UrdfRobot& robot, std::size_t link, std::size_t base) {
  while (link != base && robot.links[link].above) link = robot.joints[*robot.links[link].above].parent;
  return link == base;
}

class ArmBuilder {
 public:
  explicit ArmBuilder(UrdfRobot robot) { result_.robot = std::move(robot); }

  UrdfArm build(const std::string& base_link, const std::string& flange_link) {
    const auto [base, flange, assumed] = urdf_ends(result_.robot, base_link, flange_link);
    result_.base_link = links()[base].name, result_.flange_link = links()[flange].name;
    add_chain(base, flange);
    if (assumed)
      result_.remarks.push_back(result_.robot.place(links()[base].line) + "the arm is the chain from '" +
                                result_.base_link + "' to '" + result_.flange_link +
                                "', by the tree of the file; base_link and flange_link name others");
    let_others_stand();
    add_links(base, {result_.base_link, -1, {}}, kNoJoint);
    result_.below_base = walked_;
    Pose X_RL;
    for (std::size_t link = base; links()[link].above;) {
      const std::size_t above = *links()[link].above;
      link = joints()[above].parent;
      X_RL = X_RL * X_PL(above).inverse();
      add_links(link, {links()[link].name, -1, X_RL}, above);
      if (links()[link].name == kWorldLink) remark_world(links()[base], X_RL.inverse());
    }
    return std::move(result_);
  }

 private:
  static constexpr std::size_t kNoJoint = static_cast<std::size_t>(-1);
  static constexpr std::string_view kWorldLink =
      "world";  ///< by convention of ROS the frame of all that stands

  const std::vector<UrdfLink>& links() const { return result_.robot.links; }
  const std::vector<UrdfJoint>& joints() const { return result_.robot.joints; }

  [[noreturn]] void fail(const UrdfJoint& joint, const std::string& reason) const {
    result_.robot.fail(joint.line, joint.describe() + reason);
  }

  /// Pose of the link below a joint that is not on the chain in the link above it.
  Pose X_PL(std::size_t i) const {
    const UrdfJoint& joint = joints()[i];
    const double q = result_.standing[i];
    if (q == 0.0) return joint.X_PJ;
    const Vec3 axis = joint.axis.normalized();
    if (joint.type == UrdfJointType::prismatic) return joint.X_PJ * Pose{Mat3::Identity(), q * axis};
    return joint.X_PJ * Pose{Eigen::AngleAxisd(q, axis).toRotationMatrix(), Vec3::Zero()};
  }

  void remark_world(const UrdfLink& base, const Pose& X_WR) {
    if (X_WR.p.norm() < 1e-9 && (X_WR.R - Mat3::Identity()).norm() < 1e-9) return;
    result_.remarks.push_back(result_.robot.place(base.line) + "the file places link '" + base.name +
                              "' at (" + join(X_WR.p, ", ", [](double x) { return number_text(x, 6); }) +
                              ") m in its link 'world'; pose places '" + base.name +
                              "' in the cell. base_link: world keeps the place of the file");
  }

  void let_others_stand() {
    std::vector<double>& q = result_.standing;
    q.assign(joints().size(), 0.0);
    for (std::size_t i = 0; i < joints().size(); ++i) {
      const UrdfJoint& joint = joints()[i];
      if (joint.type == UrdfJointType::fixed || moving_[i] >= 0) continue;
      const bool limited = joint.type == UrdfJointType::revolute || joint.type == UrdfJointType::prismatic;
      if (limited && !(joint.limit->lower <= joint.limit->upper))
        result_.robot.fail(joint.limit->line, joint.describe() + ": <limit>: found lower " +
                                                  exact_text(joint.limit->lower) + ", upper " +
                                                  exact_text(joint.limit->upper) +
                                                  "; lower must not be above upper");
      if (limited) q[i] = std::clamp(0.0, joint.limit->lower, joint.limit->upper);
      if (limited && q[i] != 0.0 && !(joint.axis.norm() > 1e-6))
        fail(joint, ": <axis>: xyz: found (" + join(joint.axis, ", ", exact_text) +
                        "); allowed: a vector with a direction");
      result_.standing_joints.push_back(joint.name);
    }
    follow_mimics();
  }

  /// Joints that mimic a joint beside the chain stand where that one leads them. A chain of mimics has fewer members
  /// than the file has joints.
  void follow_mimics() {
    for (std::size_t round = 0; round < joints().size(); ++round) {
      bool changed = false;
      for (std::size_t i = 0; i < joints().size(); ++i) {
        const UrdfJoint& joint = joints()[i];
        if (joint.mimics.empty() || moving_[i] >= 0) continue;
        for (std::size_t k = 0; k < joints().size(); ++k) {
          if (joints()[k].name != joint.mimics || k == i) continue;
          const double q = joint.mimic_multiplier * result_.standing[k] + joint.mimic_offset;
          changed = changed || q != result_.standing[i];
          result_.standing[i] = q;
        }
      }
      if (!changed) return;
    }
  }

  void add_chain(std::size_t base, std::size_t flange) {
    std::vector<std::size_t> chain;
    for (std::size_t link = flange; link != base; link = joints()[chain.back()].parent) {
      if (!links()[link].above)
        result_.robot.fail(links()[flange].line,
                           "link '" + links()[flange].name + "' is not below link '" + links()[base].name +
                               "': the chain of parents ends at '" + links()[link].name + "'");
      chain.push_back(*links()[link].above);
    }
    moving_.assign(joints().size(), -1);
    ArmModel& arm = result_.arm;
    Pose X_PJ;  // from the last moving link, or the base, over the fixed joints in between
    for (auto at = chain.rbegin(); at != chain.rend(); ++at) {
      const UrdfJoint& joint = joints()[*at];
      X_PJ = X_PJ * joint.X_PJ;
      if (joint.type == UrdfJointType::fixed) continue;
      if (arm.joint_count() == kMaxJoints)
        fail(joint, " is moving joint number " + std::to_string(kMaxJoints + 1) + " of the chain; at most " +
                        std::to_string(kMaxJoints) + " are allowed");
      moving_[*at] = arm.joint_count();
      arm.joints.push_back(joint_model(joint));
      arm.joints.back().X_PJ = X_PJ;
      X_PJ = Pose{};
    }
    if (arm.joints.empty())
      result_.robot.fail(0, "the chain from '" + links()[base].name + "' to '" + links()[flange].name +
                                "' has no moving joint");
    arm.X_JF = X_PJ;
  }

  /// Exporters of CAD programs write 0 where no limit is stated, and a continuous joint needs none.
  double assumed_velocity(const UrdfJoint& joint, int line) {
    const bool slides = joint.type == UrdfJointType::prismatic;
    result_.remarks.push_back(result_.robot.place(line) + joint.describe() +
                              ": the file states no velocity above 0; " +
                              (slides ? "1 m/s is assumed" : "pi rad/s is assumed"));
    return slides ? 1.0 : std::numbers::pi;
  }

  JointModel joint_model(const UrdfJoint& joint) {
    // Exporters of CAD programs write two zeros where no range is stated.
    const bool unstated = joint.type == UrdfJointType::revolute && joint.limit && joint.limit->lower == 0.0 &&
                          joint.limit->upper == 0.0;
    const bool continuous = joint.type == UrdfJointType::continuous || unstated;
    if (joint.type != UrdfJointType::revolute && joint.type != UrdfJointType::prismatic && !continuous)
      fail(joint, ": the type is not allowed in an arm; allowed: revolute, continuous, prismatic, fixed");
    if (!joint.mimics.empty())
      fail(joint,
           ": it mimics joint '" + joint.mimics +
               "'; joints of an arm move on their own, only those of fingers and beside the arm may mimic "
               "others. flange_link: " +
               links()[joint.parent].name +
               " ends the arm before it; type=\"fixed\" in the file lets it stand");
    if (!(joint.axis.norm() > 1e-6))
      fail(joint, ": <axis>: xyz: found (" + join(joint.axis, ", ", exact_text) +
                      "); allowed: a vector with a direction");
    const UrdfLimit limit = joint.limit.value_or(UrdfLimit{0.0, 0.0, 0.0, 0.0, joint.line});
    const auto require = [&](bool allowed, const std::string& reason) {
      if (!allowed) result_.robot.fail(limit.line, joint.describe() + ": <limit>: " + reason);
    };
    require(continuous || limit.lower < limit.upper, "found lower " + exact_text(limit.lower) + ", upper " +
                                                         exact_text(limit.upper) +
                                                         "; lower must be below upper");
    if (unstated)
      result_.remarks.push_back(result_.robot.place(limit.line) + joint.describe() +
                                ": lower and upper are 0; one turn to each side is assumed");
    JointModel model;
    model.name = joint.name;
    model.type = joint.type == UrdfJointType::prismatic ? JointType::prismatic : JointType::revolute;
    model.axis = joint.axis.normalized();
    model.lower = continuous ? -2.0 * std::numbers::pi : limit.lower;
    model.upper = continuous ? 2.0 * std::numbers::pi : limit.upper;
    model.max_velocity = limit.velocity > 0.0 ? limit.velocity : assumed_velocity(joint, limit.line);
    model.max_effort = std::max(0.0, limit.effort);  // 0: unlimited
    return model;
  }

  /// Adds `first`, a link at `place`, and all links below it; skips the links carried by `left_out`, which
  /// exist already.
  void add_links(std::size_t first, RobotLink place, std::size_t left_out) {
    std::vector<std::pair<std::size_t, RobotLink>> waiting{{first, std::move(place)}};
    while (!waiting.empty()) {
      const auto [link, here] = std::move(waiting.back());
      waiting.pop_back();
      walked_.push_back(link);
      for (auto joint = links()[link].below.rbegin(); joint != links()[link].below.rend(); ++joint) {
        if (*joint == left_out) continue;
        const std::size_t child = joints()[*joint].child;
        RobotLink below{links()[child].name, moving_[*joint], {}};
        if (below.joint < 0) below.joint = here.joint, below.X_JL = here.X_JL * X_PL(*joint);
        waiting.emplace_back(child, std::move(below));
      }
      result_.links.push_back(here);
    }
  }

  UrdfArm result_;
  std::vector<int> moving_;  ///< by joint of the file: the arm's joint, or -1
  std::vector<std::size_t> walked_;
};

void require_meshes(const UrdfRobot& robot, const UrdfLink& link) {
  for (const auto* shapes : {&link.visuals, &link.collisions}) {
    for (const UrdfShape& shape : *shapes) {
      if (shape.kind != UrdfShapeKind::mesh || !package_of(shape.filename).empty() || robot.mesh_file(shape))
        continue;
      robot.fail(shape.line, "link '" + link.name + "': <mesh>: filename: found '" + shape.filename +
                                 "'; there is no such file beside the URDF file");
    }
  }
}

}  // namespace

UrdfEnds urdf_ends(const UrdfRobot& robot, const std::string& base_link, const std::string& flange_link) {
  constexpr const char *kBase = "base_link", *kFlange = "tool0";
  UrdfEnds ends;
  if (!base_link.empty() || has_link(robot, kBase)) {
    ends.base = link_of(robot, "base_link", base_link.empty() ? kBase : base_link);
  } else {
    while (robot.links[ends.base].above) ends.base = robot.joints[*robot.links[ends.base].above].parent;
    ends.assumed = true;
  }
  if (!flange_link.empty() ||
      (has_link(robot, kFlange) && is_below(robot, robot.find_link(kFlange), ends.base))) {
    ends.flange = link_of(robot, "flange_link", flange_link.empty() ? kFlange : flange_link);
  } else {
    ends.flange = end_of_motion(robot, ends.base);
    ends.assumed = true;
  }
  return ends;
}

UrdfArm read_urdf_arm(const std::filesystem::path& file, const std::string& base_link,
                      const std::string& flange_link, const PackageFolders& packages) {
  return ArmBuilder(read_urdf(file, packages)).build(base_link, flange_link);
}

UrdfInertias urdf_inertias(const UrdfArm& arm, std::optional<double> mass_kg) {
  const UrdfRobot& robot = arm.robot;
  for (const UrdfLink& link : robot.links) require_meshes(robot, link);
  UrdfInertias result;
  std::vector<std::optional<BodyInertia>> of_shapes(arm.below_base.size());
  if (mass_kg) of_shapes = urdf_shape_inertias(arm, *mass_kg);
  result.links.resize(arm.arm.joints.size());
  std::vector<bool> found(arm.arm.joints.size(), false);
  for (std::size_t i = 0; i < arm.below_base.size(); ++i) {
    const UrdfLink& link = robot.links[arm.below_base[i]];
    if (of_shapes[i] && arm.links[i].joint >= 0) {
      const auto joint = static_cast<std::size_t>(arm.links[i].joint);
      result.links[joint] = combined(result.links[joint], *of_shapes[i], arm.links[i].X_JL);
      found[joint] = true;
    }
    if (!link.inertial) continue;
    const std::string where = "link '" + link.name + "': <inertial>: ";
    const std::string problem = inertia_problem(link.inertial->at_centre);
    if (!problem.empty()) robot.fail(link.inertial->line, where + problem);
    if (arm.links[i].joint < 0) continue;  // the base does not move
    const auto joint = static_cast<std::size_t>(arm.links[i].joint);
    const std::string remark = inertia_remark(link.inertial->at_centre);
    if (!remark.empty())
      result.remarks.push_back(robot.place(link.inertial->line) + where + remark + "; it is used as it is");
    result.links[joint] =
        combined(result.links[joint], link.inertial->at_centre, arm.links[i].X_JL * link.inertial->X_LC);
    found[joint] = true;
  }
  for (std::size_t i = 0; i < arm.below_base.size(); ++i) {
    const int joint = arm.links[i].joint;
    if (joint < 0 || found[static_cast<std::size_t>(joint)]) continue;
    robot.fail(robot.links[arm.below_base[i]].line,
               "link '" + arm.links[i].name +
                   "': found no <inertial>, neither on it nor on what is fixed to it, but joint '" +
                   arm.arm.joints[static_cast<std::size_t>(joint)].name +
                   "' moves it and dynamics are needed here; needed: <inertial> with <mass> and <inertia>" +
                   (mass_kg ? ", or shapes with a volume"
                            : ", or the robot's key mass_kg, which links share by their shapes"));
  }
  std::vector<std::string> shares;
  for (std::size_t i = 0; i < of_shapes.size(); ++i)
    if (of_shapes[i])
      shares.push_back(arm.links[i].name + " " + number_text(of_shapes[i]->mass_kg, 3) + " kg");
  if (!shares.empty())
    result.remarks.push_back(
        "links without <inertial> share mass_kg by the volume of their shapes, at even density: " +
        join(shares, ", "));
  return result;
}

}  // namespace takt
