#include "server/product/robot_plan.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <set>

#include "server/product/grasps.h"
#include "server/product/removal.h"
#include "server/product/support.h"

namespace takt::product {

namespace {

constexpr double kLeastForce_N = 100.0;
constexpr double kJawFriction = 0.15;  ///< assumed: dry steel on steel
/// Force of the jaws over what the weight needs: for acceleration and levers.
constexpr double kGripMargin = 3.0;
constexpr double kGravity_m_per_s2 = 9.81;
constexpr double kCupPressure_Pa = 6e4;  ///< of an ejector
constexpr double kSmallestCup_m = 0.004;
constexpr double kParallel = 1e-3;  ///< of the cosine
constexpr double kClear_m = 0.005;  ///< beyond what a part leaves behind
constexpr double kNear_m = 0.02;    ///< the last way to a part

/// The tool centre point of a gripper that holds a part so. The arm of the cup points upwards where it can.
Pose tool(const Grasp& grasp, const GripperSize& gripper) {
  Pose pose{Mat3::Identity(), grasp.tip};
  pose.R.col(2) = -grasp.out;
  pose.R.col(1) = grasp.jaws;
  pose.R.col(0) = pose.R.col(1).cross(pose.R.col(2));
  if (pose.R.col(0).z() < 0.0) pose.R.col(0) *= -1.0, pose.R.col(1) *= -1.0;
  if (!grasp.by_cup) return pose;
  const Pose X_GTcp{Mat3::Identity(), Vec3(0, 0, 2.0 * gripper.finger_length_m)};
  return pose * cup_mount(gripper).inverse() * X_GTcp;
}

Pose moved(const Pose& pose, const Vec3& by) {
  return {pose.R, pose.p + by};
}

class Planner {
 public:
  Planner(const Product& product, const Disassembly& plan, const std::map<std::size_t, std::string>& refused,
          double cup_diameter_m)
      : product_(product),
        plan_(plan),
        refused_(refused),
        removal_(product),
        group_(product.instances.size(), 0) {
    around_.original = around_.now = place(product);
    around_.moved.resize(product.instances.size());
    for (const Instance& instance : product.instances) around_.names.push_back(instance.name);
    result_.gripper.cup_diameter_m = cup_diameter_m;
    result_.gripper.cup_pressure_Pa = kCupPressure_Pa;
  }

  RobotPlan run() {
    for (const PlacedInstance& instance : around_.now)
      whole_.add(instance.box.lower), whole_.add(instance.box.upper);
    size_gripper();
    const Vec3 size = whole_.box.upper - whole_.box.lower;
    const double reach = result_.gripper.finger_length_m;
    const Support support = support_of(product_, around_.now, plan_);
    for (const TriangleMesh& mesh : support.boxes) around_.fixed.push_back(placed(mesh));
    floor_ = around_.floor_m = support.floor_m;
    around_.reach_m = size.norm();
    gap_ = 2.0 * (result_.gripper.finger_thickness_m + result_.gripper.opening_m) + 0.002;
    row_x_ = whole_.box.upper.x() + 0.2 * std::max(size.x(), size.y()) + gap_;
    row_y_ = whole_.box.lower.y();
    tray_from_ = Vec3(row_x_ - gap_, row_y_ - gap_, floor_ - 0.05 * size.maxCoeff());
    tray_to_ = Vec3(row_x_, row_y_, floor_);
    row_end_ = std::max(whole_.box.upper.y(), row_y_ + 0.5 * size.maxCoeff());
    // The whole tool hangs below this height when it points down; parts hang below the tool.
    safe_ = whole_.box.upper.z() + size.maxCoeff() + 0.5 * reach;
    leaves_.assign(group_.size(), group_.size());
    for (std::size_t k = 0; k < plan_.order.size(); ++k) leaves_[plan_.order[k]] = k;
    make_all();
    result_.gripper.force_N = kLeastForce_N;
    for (const RobotMove& move : result_.moves) {
      if (move.by_cup) continue;
      result_.gripper.force_N =
          std::max(result_.gripper.force_N,
                   std::ceil(kGripMargin * mass_of(move.parts) * kGravity_m_per_s2 / kJawFriction));
    }
    result_.tray_lower = tray_from_;
    result_.tray_upper = tray_to_ + Vec3(gap_, gap_, 0.0);
    const Vec3 middle = 0.5 * (whole_.box.lower + whole_.box.upper);
    result_.home = {Eigen::AngleAxisd(M_PI, Vec3::UnitX()).toRotationMatrix(),
                    Vec3(middle.x(), middle.y(), safe_)};
    return std::move(result_);
  }

  /// Of the cup that carries all parts that find no grasp of the fingers (m).
  double wanted_cup_m() const { return wanted_cup_m_; }

 private:
  void size_gripper() {
    GripperSize& g = result_.gripper;
    double middle = std::numeric_limits<double>::infinity(), widest = 0.0;
    for (std::size_t i = 0; i < around_.now.size(); ++i) {
      if (i == plan_.base && around_.now.size() > 1) continue;
      Vec3 size = around_.now[i].box.upper - around_.now[i].box.lower;
      std::sort(size.data(), size.data() + 3);
      middle = std::min(middle, size[1]);
      widest = std::max(widest, size[1]);  // a flat part that lies is held across its middle side
    }
    const double all = (whole_.box.upper - whole_.box.lower).norm();
    g.finger_width_m = std::clamp(0.4 * middle, 0.001, 0.03);
    g.finger_thickness_m = std::max(0.5 * g.finger_width_m, 0.001);
    g.finger_length_m = std::max(0.05, 0.5 * all);
    g.opening_m = std::clamp(0.15 * middle, 0.0005, 0.005);
    g.largest_width_m = 1.3 * widest + 2.0 * g.opening_m;
  }

  /// A place on the tray for a group of this box; returns the shift of the box to it.
  Vec3 slot(const Aabb& box) {
    const Vec3 size = box.upper - box.lower;
    if (row_y_ > tray_from_.y() + 2.0 * gap_ && row_y_ + size.y() > row_end_)
      row_x_ += row_width_ + gap_, row_y_ = tray_from_.y() + gap_, row_width_ = 0.0;
    Vec3 shift = Vec3(row_x_, row_y_, floor_) - box.lower;
    row_y_ += size.y() + gap_;
    row_width_ = std::max(row_width_, size.x());
    tray_to_ = tray_to_.cwiseMax(Vec3(row_x_ + size.x(), row_y_ - gap_, floor_));
    return shift;
  }

  /// In the order of disassembly. What cannot be made yet is tried again once others have left.
  void make_all() {
    struct Pending {
      RemovalStep step;
      std::size_t from;  ///< group
      std::string why;
    };
    std::vector<Pending> pending;
    for (const RemovalStep& step : plan_.steps) {
      const std::size_t from = group_[step.parts.front()];
      const std::string why = make(step);
      if (!why.empty()) pending.push_back({step, from, why});
    }
    for (bool progress = true; progress;) {
      progress = false;
      std::vector<Pending> left;
      for (Pending& one : pending) {
        // Parts of a group that have left it one by one are done.
        std::erase_if(one.step.parts, [&](std::size_t i) { return group_[i] != one.from; });
        if (one.step.parts.empty()) continue;
        one.why = make(one.step);
        if (one.why.empty())
          progress = true;
        else
          left.push_back(std::move(one));
      }
      pending = std::move(left);
    }
    for (const Pending& one : pending) {
      std::string name = to_string(one.step.loosening);
      for (const std::size_t i : one.step.parts)
        name += (i == one.step.parts.front() ? " " : ", ") + around_.names[i];
      result_.notes.push_back("The robot does not " + name + ": " + one.why);
    }
  }

  /// Makes the removal unless what stays hinders it. Returns the reason if it is not possible, else an empty text.
  std::string make(const RemovalStep& step) {
    std::string why;
    for (const std::size_t i : step.parts) {
      const auto refused = refused_.find(i);
      if (refused != refused_.end()) why = refused->second;
    }
    if (why.empty()) why = obstacle_of_order(step);
    if (why.empty()) why = try_to_make(step);
    for (const std::size_t i : step.parts) {
      if (why.empty())
        stays_.erase(i);
      else
        stays_.insert(i);
    }
    return why;
  }

  /// What stays, as the robot could not remove it, may be in the way of the parts, or fall without them. Empty: it is not.
  std::string obstacle_of_order(const RemovalStep& step) {
    const std::set<std::size_t> moving(step.parts.begin(), step.parts.end());
    const bool out_of_order =
        std::any_of(moving.begin(), moving.end(), [&](std::size_t i) { return stays_.contains(i); });
    const auto& directions = removal_.directions();
    const auto d = static_cast<std::size_t>(
        std::find_if(directions.begin(), directions.end(),
                     [&](const Vec3& one) { return (one - step.direction_W).norm() < 1e-6; }) -
        directions.begin());
    for (std::size_t b = 0; b < group_.size(); ++b) {
      if (moving.contains(b) || group_[b] != group_[step.parts.front()]) continue;
      if (!stays_.contains(b) && !out_of_order) continue;
      for (const std::size_t a : moving)
        if (d < directions.size() && removal_.blocked(a, d, b)) return around_.names[b] + " is in the way";
      if (stays_.contains(b) && falls(b, moving)) return around_.names[b] + " would fall";
    }
    return "";
  }

  /// Only those that leave hold it: by a contact that carries it in the product, and for the partner search, in which a part
  /// is held by one that leaves later.
  bool falls(std::size_t part, const std::set<std::size_t>& leaving) const {
    bool carried[2] = {}, partner[2] = {};  // by those that leave, by those that stay
    for (const Contact& contact : product_.contacts) {
      if (contact.first != part && contact.second != part) continue;
      const bool first = contact.first == part;
      const std::size_t other = first ? contact.second : contact.first;
      if (group_[other] != group_[part]) continue;
      const int side = leaving.contains(other) ? 0 : 1;
      carried[side] = carried[side] || group_[part] != 0 || carries(contact, first);
      partner[side] = partner[side] || leaves_[other] > leaves_[part];
    }
    return (carried[0] && !carried[1]) || (partner[0] && !partner[1]);
  }

  /// Makes the move. Returns the reason if it is not possible, else an empty text.
  std::string try_to_make(const RemovalStep& step) {
    Removing removing;
    removing.moving.insert(step.parts.begin(), step.parts.end());
    removing.held = step.parts.front();
    for (const std::size_t i : step.parts)
      if (around_.now[i].mass_kg > around_.now[removing.held].mass_kg) removing.held = i;
    const std::size_t held = removing.held;
    removing.mass_kg = mass_of(step.parts);
    const Vec3 d = removing.direction = around_.moved[held].R * step.direction_W;
    // Out of the boxes of all that stays where it is.
    double way = 0.0, from = std::numeric_limits<double>::infinity();
    for (const std::size_t i : step.parts) from = std::min(from, along(around_.now[i], d).from);
    for (std::size_t i = 0; i < around_.now.size(); ++i)
      if (!removing.moving.contains(i) && group_[i] == group_[held])
        way = std::max(way, along(around_.now[i], d).to - from);
    way += kClear_m;
    removing.way_m = way;
    GraspSearch search(around_, result_.gripper);
    std::optional<Grasp> found = search.by_fingers(removing);
    if (!found) {
      const std::string why = search.reason();
      if (d.z() < -kParallel) return why + "; a cup cannot lower it";
      wanted_cup_m_ = std::max(wanted_cup_m_, cup_for(removing.mass_kg));
      if (result_.gripper.cup_diameter_m > 0.0) found = search.by_cup(removing);
      if (!found) return why == search.reason() ? why : why + "; " + search.reason();
    }
    RobotMove move;
    move.held = held, move.parts = step.parts, move.by_cup = found->by_cup;
    move.name = std::string(to_string(step.loosening)) + " " + around_.names[held];
    move.width_m = found->width;
    move.grasp = tool(*found, result_.gripper);
    move.start = moved(move.grasp, around_.reach_m * found->out);
    move.near = moved(move.grasp, std::min(kNear_m, around_.reach_m) * found->out);
    move.above = at_height(move.start);
    move.free = moved(move.grasp, std::min(way, engaged(removing.moving, d) + kClear_m) * d);
    move.out = moved(move.grasp, way * d);
    if (d.z() < -kParallel) move.aside = moved(move.out, around_.reach_m * found->out);
    move.lift = at_height(move.aside.value_or(move.out));
    lay_down(step, *found, move);
    result_.moves.push_back(std::move(move));
    return "";
  }

  /// The way out of the boxes of what stays and is touched (m).
  double engaged(const std::set<std::size_t>& moving, const Vec3& d) const {
    double way = 0.0;
    for (const Contact& contact : product_.contacts) {
      const bool first = moving.contains(contact.first);
      if (first == moving.contains(contact.second)) continue;
      const std::size_t own = first ? contact.first : contact.second,
                        other = first ? contact.second : contact.first;
      if (group_[own] != group_[other]) continue;
      way = std::max(way, along(around_.now[other], d).to - along(around_.now[own], d).from);
    }
    return way;
  }

  /// Onto the tray, with the grasp upwards.
  void lay_down(const RemovalStep& step, const Grasp& grasp, RobotMove& move) {
    Pose put{Eigen::Quaterniond::FromTwoVectors(grasp.out, Vec3::UnitZ()).toRotationMatrix(), Vec3::Zero()};
    const auto turn = [&](const Pose& by) {
      BoxBuilder all;
      for (const std::size_t i : step.parts) {
        BoxBuilder own;
        for (Triangle& t : around_.now[i].triangles)
          for (Vec3& p : t) p = by * p, own.add(p);
        around_.now[i].box = own.box;
        around_.moved[i] = by * around_.moved[i];
        all.add(own.box.lower), all.add(own.box.upper);
      }
      return all.box;
    };
    put.p = slot(turn(put));
    turn({Mat3::Identity(), put.p});
    for (const std::size_t i : step.parts) group_[i] = result_.moves.size() + 1;
    move.put = put * move.grasp;
    move.over = at_height(move.put);
  }

  static PlacedInstance placed(const TriangleMesh& mesh) {
    PlacedInstance result;
    BoxBuilder box;
    for (const auto& t : mesh.triangles) {
      result.triangles.push_back({mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]});
      for (const Vec3& p : result.triangles.back()) box.add(p);
    }
    result.box = box.box;
    return result;
  }

  double mass_of(const std::vector<std::size_t>& parts) const {
    double mass_kg = 0.0;
    for (const std::size_t i : parts) mass_kg += around_.now[i].mass_kg;
    return mass_kg;
  }

  /// In whole millimetres (m).
  static double cup_for(double mass_kg) {
    const double area = kGripMargin * mass_kg * kGravity_m_per_s2 / kCupPressure_Pa;
    return std::max(kSmallestCup_m, 1e-3 * std::ceil(1e3 * std::sqrt(4.0 * area / M_PI)));
  }

  Pose at_height(const Pose& pose) const {
    return {pose.R, Vec3(pose.p.x(), pose.p.y(), std::max(safe_, pose.p.z()))};
  }

  const Product& product_;
  const Disassembly& plan_;
  const std::map<std::size_t, std::string>& refused_;
  Removal removal_;
  Surroundings around_;
  std::vector<std::size_t>
      group_;  ///< by instance: 0 in the product, else the move that brought it onto the tray
  std::vector<std::size_t> leaves_;  ///< by instance: place in the order of disassembly
  std::set<std::size_t> stays_;      ///< parts that the robot could not remove
  double wanted_cup_m_ = 0.0;
  BoxBuilder whole_;
  double floor_ = 0.0, safe_ = 0.0, gap_ = 0.0, row_x_ = 0.0, row_y_ = 0.0, row_end_ = 0.0, row_width_ = 0.0;
  Vec3 tray_from_ = Vec3::Zero(), tray_to_ = Vec3::Zero();
  RobotPlan result_;
};

}  // namespace

Pose cup_mount(const GripperSize& gripper) {
  Pose X_GH{Mat3::Identity(), Vec3(2.0 * gripper.finger_length_m, 0.0, 0.5 * gripper.finger_length_m)};
  X_GH.R << 0, 0, 1, 0, 1, 0, -1, 0, 0;  // z along the arm, which is the x axis of the gripper
  return X_GH;
}

RobotPlan plan_robot(const Product& product, const Disassembly& plan,
                     const std::map<std::size_t, std::string>& refused) {
  // The cup follows the heaviest of the parts that need it; a larger one may bring others within reach.
  double cup_m = 0.0;
  while (true) {
    Planner planner(product, plan, refused, cup_m);
    RobotPlan result = planner.run();
    if (planner.wanted_cup_m() <= cup_m) {
      const bool used = std::any_of(result.moves.begin(), result.moves.end(),
                                    [](const RobotMove& move) { return move.by_cup; });
      if (!used) result.gripper.cup_diameter_m = 0.0;
      return result;
    }
    cup_m = planner.wanted_cup_m();
  }
}

}  // namespace takt::product
