#include "server/scenario/finger_linkage.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "idl/common/text.h"
#include "server/fields/field_value.h"

namespace takt {

namespace {

constexpr int kSamples = 64;
constexpr double kTurn_rad = 1e-3;  ///< by which a finger may turn
constexpr double kAside = 1e-3;     ///< part of the travel by which the fingers may leave their line
constexpr double kStill_m = 1e-6;

bool moves(const UrdfJoint& joint) {
  return joint.type == UrdfJointType::revolute || joint.type == UrdfJointType::continuous ||
         joint.type == UrdfJointType::prismatic;
}

bool is_below(const UrdfRobot& robot, std::size_t link, std::size_t above) {
  while (link != above) {
    if (!robot.links[link].above) return false;
    link = robot.joints[*robot.links[link].above].parent;
  }
  return true;
}

/// The joint that this one follows in the end, itself if it mimics none.
std::size_t leader_of(const UrdfRobot& robot, std::size_t joint) {
  for (std::size_t at = joint, steps = 0; steps <= robot.joints.size(); ++steps) {
    const std::string& name = robot.joints[at].mimics;
    if (name.empty()) return at;
    const auto next = std::find_if(robot.joints.begin(), robot.joints.end(),
                                   [&](const UrdfJoint& other) { return other.name == name; });
    if (next == robot.joints.end())
      robot.fail(robot.joints[at].line, robot.joints[at].describe() + ": <mimic>: joint: found '" + name +
                                            "', which is no joint of the file");
    at = static_cast<std::size_t>(next - robot.joints.begin());
  }
  robot.fail(robot.joints[joint].line,
             robot.joints[joint].describe() + ": <mimic>: the joints that it follows lead back to it");
}

double position_of(const UrdfRobot& robot, std::size_t joint, std::size_t drive, double q) {
  if (joint == drive) return q;
  const UrdfJoint& j = robot.joints[joint];
  if (j.mimics.empty())
    return j.limit ? std::clamp(0.0, j.limit->lower, std::max(j.limit->lower, j.limit->upper)) : 0.0;
  const auto next = std::find_if(robot.joints.begin(), robot.joints.end(),
                                 [&](const UrdfJoint& other) { return other.name == j.mimics; });
  return j.mimic_multiplier *
             position_of(robot, static_cast<std::size_t>(next - robot.joints.begin()), drive, q) +
         j.mimic_offset;
}

class Search {
 public:
  Search(const UrdfRobot& robot, std::size_t flange, const std::function<Vec3(std::size_t link)>& centre_of)
      : robot_(robot), flange_(flange), centre_of_(centre_of) {}

  FingerLinkage find(const std::vector<std::string>& fingers) {
    fingers.empty() ? choose() : take(fingers);
    find_hand();
    find_drive();
    require_parallel();
    sample();
    require_opposite();
    return found_;
  }

 private:
  [[noreturn]] void fail(const std::string& reason) const {
    robot_.fail(0, "fingers: " + reason +
                       ". For other grippers state body_mesh, jaw_mesh, max_width_m, jaw_speed_m_per_s and "
                       "max_force_N in place of fingers");
  }
  std::string name(std::size_t joint) const { return "'" + robot_.joints[joint].name + "'"; }

  /// Moving joints below the flange.
  std::vector<std::size_t> carried() const {
    std::vector<std::size_t> result;
    for (std::size_t i = 0; i < robot_.joints.size(); ++i)
      if (moves(robot_.joints[i]) && is_below(robot_, robot_.joints[i].parent, flange_)) result.push_back(i);
    return result;
  }
  bool is_last(std::size_t joint, const std::vector<std::size_t>& carried) const {
    return std::none_of(carried.begin(), carried.end(), [&](std::size_t other) {
      return is_below(robot_, robot_.joints[other].parent, robot_.joints[joint].child);
    });
  }
  bool has_shapes(std::size_t link) const {
    const UrdfLink& l = robot_.links[link];
    return !l.visuals.empty() || !l.collisions.empty() ||
           std::any_of(l.below.begin(), l.below.end(), [&](std::size_t joint) {
             return robot_.joints[joint].type == UrdfJointType::fixed &&
                    has_shapes(robot_.joints[joint].child);
           });
  }

  /// Both ends of the drive's range and the positions in between.
  double at(int sample) const {
    const UrdfLimit& limit = *robot_.joints[found_.drive].limit;
    return limit.lower + (limit.upper - limit.lower) * sample / kSamples;
  }

  /// Largest angle between two directions of a link over the range of the drive.
  double turn_of(std::size_t joint) const {
    const std::size_t link = robot_.joints[joint].child;
    const Mat3 first = pose(link, 0).R;
    double turn = 0.0;
    for (int i = 1; i <= kSamples; ++i)
      turn = std::max(turn, Eigen::AngleAxisd(first.transpose() * pose(link, i).R).angle());
    return turn;
  }
  Pose pose(std::size_t link, int sample) const {
    return linkage_pose(robot_, found_.hand, link, found_.drive, at(sample));
  }

  void choose() {
    const std::vector<std::size_t> all = carried();
    std::vector<std::size_t> last;
    std::string says;
    for (const std::size_t joint : all) {
      if (!is_last(joint, all) || !has_shapes(robot_.joints[joint].child)) continue;
      found_.drive = leader_of(robot_, joint);
      found_.hand = flange_;
      const UrdfJoint& drive = robot_.joints[found_.drive];
      if (!is_below(robot_, drive.parent, flange_) || !drive.limit ||
          !(drive.limit->lower < drive.limit->upper)) {
        says += (says.empty() ? "" : ", ") + name(joint) + " follows " + name(found_.drive) +
                ", which has no range";
        continue;
      }
      const double turn = turn_of(joint);
      if (turn <= kTurn_rad)
        last.push_back(joint);
      else
        says +=
            (says.empty() ? "" : ", ") + name(joint) + " turns its link by " + rounded_number(turn) + " rad";
    }
    std::string both;
    for (const std::size_t joint : last) both += (both.empty() ? "" : ", ") + name(joint);
    if (last.size() > 2)
      fail("the links of the joints " + both +
           " move without turning; name the two of the fingers: [LEFT, RIGHT]");
    if (last.size() < 2)
      fail("found " + std::to_string(last.size()) +
           " joints below the flange that end a finger and do not turn it; allowed: two" +
           (says.empty() ? std::string() : " (" + says + ")"));
    found_.joint = {last[0], last[1]};
  }

  void take(const std::vector<std::string>& fingers) {
    const std::vector<std::size_t> all = carried();
    for (const std::size_t side : {0U, 1U}) {
      const auto joint = std::find_if(all.begin(), all.end(),
                                      [&](std::size_t i) { return robot_.joints[i].name == fingers[side]; });
      if (joint == all.end())
        fail("found '" + fingers[side] + "'; allowed: the moving joints below the flange, " +
             join(all, ", ", [&](std::size_t i) { return name(i); }));
      found_.joint[side] = *joint;
    }
  }

  void find_hand() {
    std::size_t hand = robot_.joints[found_.joint[0]].parent;
    while (!is_below(robot_, robot_.joints[found_.joint[1]].parent, hand))
      hand = robot_.joints[*robot_.links[hand].above].parent;
    found_.hand = hand;
    for (std::size_t link = hand; link != flange_; link = robot_.joints[*robot_.links[link].above].parent)
      if (const std::size_t above = *robot_.links[link].above; moves(robot_.joints[above]))
        fail("joint " + name(above) + " moves link '" + robot_.links[hand].name +
             "', which carries both fingers; allowed: a hand that is fixed to the flange");
  }

  /// Joints from the hand to a finger, all of which must follow one drive.
  void find_drive() {
    std::optional<std::size_t> drive;
    for (const std::size_t last : found_.joint) {
      for (std::size_t link = robot_.joints[last].child; link != found_.hand;) {
        const std::size_t joint = *robot_.links[link].above;
        link = robot_.joints[joint].parent;
        if (!moves(robot_.joints[joint])) continue;
        const std::size_t leader = leader_of(robot_, joint);
        if (drive && *drive != leader)
          fail("the fingers follow the joints " + name(*drive) + " and " + name(leader) +
               "; allowed: one joint that all others mimic");
        drive = leader;
        if (!(robot_.joints[joint].axis.norm() > 1e-6))
          robot_.fail(robot_.joints[joint].line,
                      robot_.joints[joint].describe() + ": <axis>: allowed: a vector with a direction");
      }
    }
    found_.drive = *drive;
    const UrdfJoint& joint = robot_.joints[found_.drive];
    if (!is_below(robot_, joint.parent, flange_))
      fail("the fingers follow joint " + name(found_.drive) + ", which the flange does not carry");
    if (!joint.limit || !(joint.limit->lower < joint.limit->upper))
      robot_.fail(
          joint.limit ? joint.limit->line : joint.line,
          joint.describe() + ": <limit>: found no range; needed: lower < upper, as it drives the fingers");
    if (!(joint.limit->velocity > 0.0))
      robot_.fail(joint.limit->line, joint.describe() + ": <limit>: velocity: allowed: > 0");
  }

  /// From the right finger to the left one, and the point between them.
  std::pair<Vec3, Vec3> fingers_at(double q) const {
    std::array<Vec3, 2> centre;
    for (const std::size_t side : {0U, 1U}) {
      const std::size_t link = robot_.joints[found_.joint[side]].child;
      centre[side] = linkage_pose(robot_, found_.hand, link, found_.drive, q) * centre_of_(link);
    }
    return {centre[0] - centre[1], 0.5 * (centre[0] + centre[1])};
  }

  void sample() {
    for (int i = 0; i <= kSamples; ++i) {
      const auto [apart, middle] = fingers_at(at(i));
      apart_.push_back(apart), middle_.push_back(middle);
    }
  }

  void require_parallel() const {
    for (const std::size_t joint : found_.joint)
      if (const double turn = turn_of(joint); turn > kTurn_rad)
        fail("joint " + name(joint) + " turns its link by " + rounded_number(turn) +
             " rad over the range of " + name(found_.drive) + "; allowed: fingers that keep their direction");
  }

  void require_opposite() {
    const Vec3 travel = apart_.back() - apart_.front();
    if (!(travel.norm() > kStill_m))
      fail("joint " + name(found_.drive) + " moves the fingers " + name(found_.joint[0]) + " and " +
           name(found_.joint[1]) + " by the same way; allowed: opposite ways");
    Vec3 y = travel.normalized();
    double aside = 0.0, sideways = 0.0;
    for (std::size_t i = 0; i < apart_.size(); ++i) {
      const Vec3 d = apart_[i] - apart_[0];
      aside = std::max(aside, (d - d.dot(y) * y).norm());
      sideways = std::max(sideways, std::abs((middle_[i] - middle_[0]).dot(y)));
    }
    if (std::max(aside, sideways) > kAside * travel.norm() + kStill_m)
      fail("the fingers leave the line of their opening by " + rounded_number(std::max(aside, sideways)) +
           " m over the range of " + name(found_.drive) + "; allowed: opposite ways along one line");
    std::vector<double> way;
    for (const Vec3& apart : apart_) way.push_back((apart - apart_[0]).dot(y));
    if (!std::is_sorted(way.begin(), way.end()))
      fail("the opening of the fingers grows and shrinks over the range of " + name(found_.drive) +
           "; allowed: one way from one limit to the other");
    // The left finger is on the side of +y.
    const bool grows = apart_[kSamples / 2].dot(y) > 0.0;
    found_.y_H = grows ? y : Vec3(-y);
    place_ends(grows, way.back());
  }

  void place_ends(bool grows, double travel_m) {
    const double first = at(0), last = at(kSamples);
    found_.q_open = grows ? last : first, found_.q_closed = grows ? first : last;
    const auto opening = [&](double q) {
      const auto [apart, middle] = fingers_at(q);
      return std::pair(apart.dot(found_.y_H), middle);
    };
    const double closed = opening(found_.q_closed).first;
    double low = found_.q_closed, high = found_.q_open;
    for (int i = 0; i < 60; ++i) {
      const double q = 0.5 * (low + high);
      (opening(q).first - closed < 0.5 * travel_m ? low : high) = q;
    }
    found_.q_middle = 0.5 * (low + high);
    const auto [middle_m, p] = opening(found_.q_middle);
    found_.opens_m = opening(found_.q_open).first - middle_m;
    found_.closes_m = closed - middle_m;
    found_.rises_open_m = (opening(found_.q_open).second - p).norm();
    found_.rises_closed_m = (opening(found_.q_closed).second - p).norm();
    for (int i = 0; i < kSamples; ++i)
      found_.largest_lever_m =
          std::max(found_.largest_lever_m,
                   std::abs((opening(at(i + 1)).first - opening(at(i)).first) / (at(i + 1) - at(i))));
  }

  const UrdfRobot& robot_;
  const std::size_t flange_;
  const std::function<Vec3(std::size_t link)>& centre_of_;
  FingerLinkage found_;
  std::vector<Vec3> apart_, middle_;  ///< fingers_at() of each sample, in H
};

}  // namespace

Pose linkage_pose(const UrdfRobot& robot, std::size_t hand, std::size_t link, std::size_t drive, double q) {
  Pose X;
  for (std::size_t at = link; at != hand;) {
    const std::size_t above = *robot.links[at].above;
    const UrdfJoint& joint = robot.joints[above];
    Pose moved;
    if (moves(joint)) {
      leader_of(robot, above);
      const double position = position_of(robot, above, drive, q);
      const Vec3 axis = joint.axis.norm() > 1e-6 ? Vec3(joint.axis.normalized()) : Vec3::UnitX();
      if (joint.type == UrdfJointType::prismatic)
        moved.p = position * axis;
      else
        moved.R = Eigen::AngleAxisd(position, axis).toRotationMatrix();
    }
    X = joint.X_PJ * moved * X;
    at = joint.parent;
  }
  return X;
}

FingerLinkage find_finger_linkage(const UrdfRobot& robot, std::size_t flange,
                                  const std::vector<std::string>& fingers,
                                  const std::function<Vec3(std::size_t link)>& centre_of) {
  return Search(robot, flange, centre_of).find(fingers);
}

}  // namespace takt
