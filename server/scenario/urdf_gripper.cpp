#include "server/scenario/urdf_gripper.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>

#include "idl/common/text.h"
#include "server/fields/rules.h"
#include "server/scenario/finger_linkage.h"
#include "server/scenario/scenario_reader.h"
#include "server/scenario/urdf_meshes.h"

namespace takt {

namespace {

constexpr double kParallel = 1e-3;     ///< of the sine between two axes
constexpr double kSameShape_m = 1e-3;  ///< of the boxes around both fingers

/// Builds the gripper in the frame H of the hand, the link that carries both fingers.
class Builder {
 public:
  Builder(const UrdfArm& arm, const std::string& flange_link)
      : robot_(arm.robot), flange_link_(flange_link), flange_(robot_.find_link(flange_link)) {}

  UrdfGripper build(const std::vector<std::string>& fingers) {
    slide(fingers) ? pick_slides(fingers) : pick_linkage(fingers);
    choose_axes();
    measure();
    collect_links();
    place_tool();
    return std::move(result_);
  }

 private:
  [[noreturn]] void fail(const std::string& reason) const { robot_.fail(0, "fingers: " + reason); }

  bool below_flange(std::size_t link) const { return is_carried(link, flange_); }
  bool is_carried(std::size_t link, std::size_t by) const {
    for (;;) {
      if (link == by) return true;
      if (!robot_.links[link].above) return false;
      link = robot_.joints[*robot_.links[link].above].parent;
    }
  }

  /// Do prismatic joints carry the fingers? Else a linkage moves them.
  bool slide(const std::vector<std::string>& fingers) const {
    const auto slides = [&](const UrdfJoint& joint) {
      return joint.type == UrdfJointType::prismatic && below_flange(joint.parent);
    };
    const auto turns = [&](const UrdfJoint& joint) {
      return joint.type != UrdfJointType::prismatic && joint.type != UrdfJointType::fixed &&
             below_flange(joint.parent) &&
             (fingers.empty() || std::find(fingers.begin(), fingers.end(), joint.name) != fingers.end());
    };
    return (fingers.empty() && std::count_if(robot_.joints.begin(), robot_.joints.end(), slides) > 1) ||
           std::none_of(robot_.joints.begin(), robot_.joints.end(), turns);
  }

  void pick_slides(const std::vector<std::string>& fingers) {
    pick(fingers);
    const UrdfJoint &left = robot_.joints[joint_[0]], &right = robot_.joints[joint_[1]];
    hand_ = left.parent;
    y_H_ = travel(0);
    for (const std::size_t i : {0U, 1U}) X_HL_[i] = robot_.joints[joint_[i]].X_PJ;
    opens_m_ = left.limit->upper + right.limit->upper;
    closes_m_ = left.limit->lower + right.limit->lower;
    result_.jaw_speed_m_per_s = std::min(left.limit->velocity, right.limit->velocity);
    result_.max_force_N = std::min(left.limit->effort, right.limit->effort);
  }

  void pick_linkage(const std::vector<std::string>& fingers) {
    const FingerLinkage linkage =
        find_finger_linkage(robot_, flange_, fingers, [&](std::size_t link) -> Vec3 {
          const Aabb box = box_of(shapes(link, {}));
          return 0.5 * (box.lower + box.upper);
        });
    linkage_ = linkage;
    joint_ = linkage.joint, hand_ = linkage.hand, y_H_ = linkage.y_H;
    for (const std::size_t i : {0U, 1U}) X_HL_[i] = pose_in_hand(robot_.joints[joint_[i]].child);
    opens_m_ = linkage.opens_m, closes_m_ = linkage.closes_m;
    const UrdfLimit& limit = *robot_.joints[linkage.drive].limit;
    result_.jaw_speed_m_per_s = 0.5 * (opens_m_ - closes_m_) / (limit.upper - limit.lower) * limit.velocity;
    // The work of the drive is that of both grip forces.
    result_.max_force_N = std::max(0.0, limit.effort) / linkage.largest_lever_m;
    if (std::max(linkage.rises_open_m, linkage.rises_closed_m) > kSameShape_m)
      result_.remarks.push_back(
          robot_.place(robot_.joints[linkage.drive].line) + "fingers: beside their opening they travel by " +
          number_text(linkage.rises_open_m, 3) + " m when they open from the middle, and " +
          number_text(linkage.rises_closed_m, 3) + " m when they close; in takt they open along a line");
  }

  Pose pose_in_hand(std::size_t link) const {
    return linkage_pose(robot_, hand_, link, linkage_->drive, linkage_->q_middle);
  }

  void pick(const std::vector<std::string>& fingers) {
    std::vector<std::size_t> found;
    std::string prismatic;
    for (std::size_t i = 0; i < robot_.joints.size(); ++i) {
      const UrdfJoint& joint = robot_.joints[i];
      const bool carried = joint.type == UrdfJointType::prismatic && below_flange(joint.parent);
      if (carried) prismatic += (prismatic.empty() ? "'" : ", '") + joint.name + "'";
    }
    for (std::size_t i = 0; i < robot_.joints.size(); ++i) {
      const UrdfJoint& joint = robot_.joints[i];
      const bool carried = joint.type == UrdfJointType::prismatic && below_flange(joint.parent);
      const bool named = std::find(fingers.begin(), fingers.end(), joint.name) != fingers.end();
      if (fingers.empty() ? carried : named) found.push_back(i);
      if (named && !carried)
        robot_.fail(joint.line, joint.describe() + ": not a prismatic joint that link '" + flange_link_ +
                                    "' carries; those are " + (prismatic.empty() ? "no joints" : prismatic));
    }
    if (found.size() != 2)
      fail("found " + std::to_string(found.size()) + " joints; allowed: two prismatic joints that link '" +
           flange_link_ + "' carries (" + (prismatic.empty() ? "it carries no prismatic joint" : prismatic) +
           "). Other grippers need body_mesh and jaw_mesh");
    // The first that is named, else the first in the file, is the left one.
    if (!fingers.empty() && robot_.joints[found[0]].name != fingers[0]) std::swap(found[0], found[1]);
    joint_ = {found[0], found[1]};
    for (const std::size_t i : joint_) {
      if (!(robot_.joints[i].axis.norm() > 1e-6))
        robot_.fail(robot_.joints[i].line,
                    robot_.joints[i].describe() + ": <axis>: allowed: a vector with a direction");
      if (!(robot_.joints[i].limit->velocity > 0.0))
        robot_.fail(robot_.joints[i].limit->line,
                    robot_.joints[i].describe() + ": <limit>: velocity: allowed: > 0");
    }
    if (robot_.joints[found[0]].parent != robot_.joints[found[1]].parent)
      fail("joints '" + robot_.joints[found[0]].name + "' and '" + robot_.joints[found[1]].name +
           "' are carried by two links; allowed: one link that carries both");
    if (travel(0).cross(travel(1)).norm() > kParallel || travel(0).dot(travel(1)) > 0.0)
      fail("joints '" + robot_.joints[found[0]].name + "' and '" + robot_.joints[found[1]].name +
           "' do not travel in opposite directions");
  }

  /// Direction in which this finger travels when its joint's position grows, in H.
  Vec3 travel(std::size_t finger) const {
    const UrdfJoint& joint = robot_.joints[joint_[finger]];
    return joint.X_PJ.R * joint.axis.normalized();
  }

  /// z is the axis of H that leads to the fingers best of those across the travel.
  void choose_axes() {
    Vec3 towards = Vec3::Zero();
    for (const Pose& X : X_HL_) towards += X.p;
    double best = -std::numeric_limits<double>::infinity();
    Vec3 z_H = Vec3::UnitZ();
    for (int axis = 0; axis < 3; ++axis) {
      for (const double sign : {1.0, -1.0}) {
        const Vec3 candidate = sign * Vec3::Unit(axis);
        if (std::abs(candidate.dot(y_H_)) > 0.5) continue;
        const double score = candidate.dot(towards) + (candidate == Vec3::UnitZ() ? 1e-9 : 0.0);
        if (score > best) best = score, z_H = candidate;
      }
    }
    z_H = (z_H - z_H.dot(y_H_) * y_H_).normalized();
    X_HG_.R.col(0) = y_H_.cross(z_H), X_HG_.R.col(1) = y_H_, X_HG_.R.col(2) = z_H;
  }

  /// Links that are fixed to `link`, itself included, with their poses in it.
  std::vector<std::pair<std::size_t, Pose>> fixed_to(std::size_t link) const {
    std::vector<std::pair<std::size_t, Pose>> found{{link, {}}};
    for (std::size_t i = 0; i < found.size(); ++i) {
      const auto [at, X] = found[i];
      for (const std::size_t joint : robot_.links[at].below)
        if (robot_.joints[joint].type == UrdfJointType::fixed)
          found.emplace_back(robot_.joints[joint].child, X * robot_.joints[joint].X_PJ);
    }
    return found;
  }

  std::vector<NamedMesh> shapes(std::size_t link, const Pose& X_GL) {
    std::vector<NamedMesh> meshes;
    for (const auto& [at, X_LK] : fixed_to(link))
      for (NamedMesh& mesh : urdf_meshes(robot_, robot_.links[at], X_GL * X_LK))
        meshes.push_back(std::move(mesh));
    for (NamedMesh& mesh : meshes) make_solid(mesh, robot_.links[link]);
    if (meshes.empty())
      robot_.fail(robot_.links[link].line,
                  "link '" + robot_.links[link].name +
                      "': found neither <collision> nor <visual>; a gripper out of a URDF needs shapes");
    return meshes;
  }

  void make_solid(NamedMesh& mesh, const UrdfLink& link) {
    const std::string where = "link '" + link.name + "', '" + mesh.name + "': ";
    try {
      const std::string problem = takt::make_solid(mesh);
      if (problem.empty()) return;
      const std::string sentence =
          robot_.place(link.line) + where + "a gripper needs a solid; its convex hull is taken: " + problem;
      if (std::find(result_.remarks.begin(), result_.remarks.end(), sentence) == result_.remarks.end())
        result_.remarks.push_back(sentence);
    } catch (const std::invalid_argument& flat) {
      robot_.fail(link.line, where + "it has neither a volume nor a hull: " + flat.what());
    }
  }

  Pose finger_pose(std::size_t finger) const { return X_HG_.inverse() * X_HL_[finger]; }

  static Aabb box_of(const std::vector<NamedMesh>& meshes) {
    TriangleMesh all;
    for (const NamedMesh& mesh : meshes)
      all.vertices.insert(all.vertices.end(), mesh.mesh.vertices.begin(), mesh.mesh.vertices.end());
    return bounds_of(all);
  }
  static void shift(std::vector<NamedMesh>& meshes, const Vec3& by) {
    for (NamedMesh& mesh : meshes)
      for (Vec3& vertex : mesh.mesh.vertices) vertex += by;
  }

  /// Places G between the grip faces, and the left finger's face in its plane y = 0.
  void measure() {
    std::array<std::vector<NamedMesh>, 2> finger;
    for (const std::size_t i : {0U, 1U}) finger[i] = shapes(robot_.joints[joint_[i]].child, finger_pose(i));
    const std::array<Aabb, 2> box{box_of(finger[0]), box_of(finger[1])};
    const double left_m = box[0].lower.y(), right_m = -box[1].upper.y();  // from y = 0, at position zero
    X_HG_.p = 0.5 * (left_m - right_m) * y_H_;
    result_.max_width_m = left_m + right_m + opens_m_;
    if (!(result_.max_width_m > 0.0))
      fail("the fingers are " + exact_text(result_.max_width_m) +
           " m apart where they are open; allowed: > 0 m");
    const double least_m = left_m + right_m + closes_m_;
    if (least_m > kSameShape_m)
      result_.remarks.push_back(robot_.place(0) + "fingers: by their limits they stay " +
                                rounded_number(least_m) + " m apart; in takt they close");
    // The right finger, turned by half a turn about z, with its face in the plane y = 0.
    const Vec3 lower(-box[1].upper.x(), -box[1].upper.y() - right_m, box[1].lower.z());
    const Vec3 upper(-box[1].lower.x(), -box[1].lower.y() - right_m, box[1].upper.z());
    const Vec3 face(0.0, left_m, 0.0);
    if ((box[0].lower - face - lower).cwiseAbs().maxCoeff() > kSameShape_m ||
        (box[0].upper - face - upper).cwiseAbs().maxCoeff() > kSameShape_m)
      result_.remarks.push_back(
          robot_.place(0) +
          "fingers: the right one is not the left one turned; takt uses the left one for both");
    result_.jaw = std::move(finger[0]);
    shift(result_.jaw, -face);
    result_.body = shapes(hand_, X_HG_.inverse());
    for (const std::size_t link : between()) {
      std::vector<NamedMesh> meshes =
          urdf_meshes(robot_, robot_.links[link], X_HG_.inverse() * pose_in_hand(link));
      for (NamedMesh& mesh : meshes) make_solid(mesh, robot_.links[link]);
      std::move(meshes.begin(), meshes.end(), std::back_inserter(result_.body));
    }
    result_.X_FG = pose_in_flange(hand_) * X_HG_;
  }

  /// Links that a linkage moves, but for the fingers: they stand at half of the opening, as a part of the body.
  std::vector<std::size_t> between() const {
    std::vector<std::size_t> found;
    if (!linkage_) return found;
    std::vector<bool> other(robot_.links.size(), false);
    for (const std::size_t link : {hand_, robot_.joints[joint_[0]].child, robot_.joints[joint_[1]].child})
      for (const auto& [at, X] : fixed_to(link)) other[at] = true;
    for (std::size_t i = 0; i < robot_.links.size(); ++i)
      if (!other[i] && is_carried(i, hand_)) found.push_back(i);
    return found;
  }

  Pose pose_in_flange(std::size_t link) const {
    Pose X;
    for (std::size_t at = link; at != flange_; at = robot_.joints[*robot_.links[at].above].parent)
      X = robot_.joints[*robot_.links[at].above].X_PJ * X;
    return X;
  }

  double mass_of(std::size_t link) const {
    double mass_kg = 0.0;
    for (const auto& [at, X] : fixed_to(link))
      if (robot_.links[at].inertial) mass_kg += robot_.links[at].inertial->at_centre.mass_kg;
    return mass_kg;
  }

  void collect_links() {
    const std::array<std::size_t, 2> finger{robot_.joints[joint_[0]].child, robot_.joints[joint_[1]].child};
    for (const std::size_t i : joint_) result_.joints.push_back(robot_.joints[i].name);
    result_.jaw_mass_kg = 0.5 * (mass_of(finger[0]) + mass_of(finger[1]));
    result_.mass_kg = mass_of(hand_) + 2.0 * result_.jaw_mass_kg;
    for (const std::size_t link : {hand_, finger[0], finger[1]})
      for (const auto& [at, X] : fixed_to(link)) result_.links.push_back(robot_.links[at].name);
    for (const std::size_t link : between()) {
      result_.links.push_back(robot_.links[link].name);
      if (robot_.links[link].inertial) result_.mass_kg += robot_.links[link].inertial->at_centre.mass_kg;
      const UrdfJoint& above = robot_.joints[*robot_.links[link].above];
      if (above.type != UrdfJointType::fixed) result_.joints.push_back(above.name);
    }
  }

  void place_tool() {
    for (const auto& [at, X_HL] : fixed_to(hand_)) {
      if (at == hand_ || robot_.links[at].name.find("tcp") == std::string::npos) continue;
      result_.X_GT = X_HG_.inverse() * X_HL;
      return;
    }
    result_.X_GT.p.z() = box_of(result_.jaw).upper.z();
  }

  const UrdfRobot& robot_;
  const std::string& flange_link_;
  const std::size_t flange_;
  std::array<std::size_t, 2> joint_{};  ///< left, right
  std::size_t hand_ = 0;
  std::optional<FingerLinkage> linkage_;   ///< none: prismatic joints carry the fingers
  std::array<Pose, 2> X_HL_;               ///< fingers as they are measured: at position zero, or half open
  double opens_m_ = 0.0, closes_m_ = 0.0;  ///< change of the distance from there to both ends
  Vec3 y_H_ = Vec3::UnitY();
  Pose X_HG_;
  UrdfGripper result_;
};

/// Links of hand and fingers are drawn, weighed and checked as the gripper.
void leave_out(UrdfArm& arm, const UrdfGripper& gripper, const std::string& flange_link) {
  const auto is_out = [&](const std::string& name) {
    return std::find(gripper.links.begin(), gripper.links.end(), name) != gripper.links.end();
  };
  for (UrdfLink& link : arm.robot.links)
    if (is_out(link.name)) link.inertial.reset(), link.collisions.clear();
  std::erase_if(arm.standing_joints, [&](const std::string& name) {
    return std::find(gripper.joints.begin(), gripper.joints.end(), name) != gripper.joints.end();
  });
  // The first of `links` belong to below_base, place by place.
  for (std::size_t i = arm.links.size(); i-- > 0;) {
    if (!is_out(arm.links[i].name) || arm.links[i].name == flange_link) continue;
    arm.links.erase(arm.links.begin() + static_cast<std::ptrdiff_t>(i));
    if (i < arm.below_base.size())
      arm.below_base.erase(arm.below_base.begin() + static_cast<std::ptrdiff_t>(i));
  }
}

/// The links that the gripper is, as the part of its mesh's name behind the file: the page does not draw them as links of the
/// robot. Messages have room for 1024 letters of it.
std::string links_of(const UrdfGripper& gripper, const std::string& name) {
  constexpr std::size_t most = 800;
  const std::string links = join(gripper.links, "+");
  return links.size() <= most ? links : name;
}

}  // namespace

UrdfGripper urdf_gripper(const UrdfArm& arm, const std::string& flange_link,
                         const std::vector<std::string>& fingers) {
  return Builder(arm, flange_link).build(fingers);
}

std::optional<Scenario> with_fingers(
    const Scenario& scenario, std::vector<UrdfArm>& arms, MeshFiles& files,
    const std::function<void(const std::string& robot, const std::string& sentence)>& remark) {
  std::optional<Scenario> result;
  for (std::size_t g = 0; g < scenario.grippers.size(); ++g) {
    if (!scenario.grippers[g].fingers) continue;
    if (!result) result = scenario;
    ScenarioGripper& gripper = result->grippers[g];
    for (std::size_t r = 0; r < scenario.robots.size(); ++r) {
      const ScenarioRobot& robot = scenario.robots[r];
      if (robot.name != gripper.robot) continue;
      UrdfGripper found = urdf_gripper(arms[r], arms[r].flange_link, gripper.fingers->joints);
      leave_out(arms[r], found, arms[r].flange_link);
      gripper.X_FG = found.X_FG;
      if (gripper.X_GT == Pose{}) gripper.X_GT = found.X_GT;
      gripper.body_mesh = robot.urdf.string() + "#" + links_of(found, gripper.name);
      gripper.jaw_mesh = gripper.body_mesh.string() + "/jaw";
      files.add(gripper.body_mesh, std::move(found.body));
      files.add(gripper.jaw_mesh, std::move(found.jaw));
      if (!(gripper.max_width_m > 0.0)) gripper.max_width_m = found.max_width_m;
      if (gripper.initial_width_m.value_or(0.0) > gripper.max_width_m)
        fail(scenario, "grippers." + gripper.name + ".initial_width_m",
             rounded_number(*gripper.initial_width_m) + " m",
             "at most the largest width by the URDF, " + rounded_number(gripper.max_width_m) + " m");
      if (!(gripper.jaw_speed_m_per_s > 0.0)) gripper.jaw_speed_m_per_s = found.jaw_speed_m_per_s;
      if (!(gripper.max_force_N > 0.0)) gripper.max_force_N = found.max_force_N;
      if (!(gripper.max_force_N > 0.0))
        fail(scenario, "grippers." + gripper.name + ".max_force_N",
             "no value, and an effort of 0 in the URDF", "a force > 0 N");
      if (!(gripper.mass_kg > 0.0)) gripper.mass_kg = found.mass_kg;
      if (!gripper.jaw_mass_kg && found.jaw_mass_kg > 0.0) gripper.jaw_mass_kg = found.jaw_mass_kg;
      for (const std::string& sentence : found.remarks) remark(robot.name, sentence);
    }
  }
  return result;
}

}  // namespace takt
