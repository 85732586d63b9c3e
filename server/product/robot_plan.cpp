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
constexpr std::size_t kMostCups = 2;
/// Diameters of suction cups (mm).
constexpr double kCups_mm[] = {1,  1.5, 2,  3,  4,  5,  6,   8,   10,  12,  16, 20,
                               25, 32,  40, 50, 63, 80, 100, 125, 160, 200, 250};
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
  if (grasp.cup_m == 0.0) return pose;
  const Pose X_GTcp{Mat3::Identity(), Vec3(0, 0, 2.0 * gripper.finger_length_m)};
  const auto cup = std::find(gripper.cups_m.begin(), gripper.cups_m.end(), grasp.cup_m);
  return pose *
         cup_mount(gripper, static_cast<std::size_t>(cup - gripper.cups_m.begin()) % kMostCups).inverse() *
         X_GTcp;
}

Pose moved(const Pose& pose, const Vec3& by) {
  return {pose.R, pose.p + by};
}

/// Of a part that no finger holds: the smallest cup that carries it, and the largest that it seals.
struct CupRange {
  double from_m = 0.0, to_m = 0.0;
};

/// Those that suit most parts, the smaller ones of equal choices.
std::vector<double> choose_cups(const std::vector<CupRange>& ranges) {
  std::set<double> sizes;
  for (const CupRange& range : ranges) sizes.insert(range.from_m);
  std::vector<double> best;
  std::ptrdiff_t most = 0;
  const auto consider = [&](const std::vector<double>& cups) {
    const auto served = std::count_if(ranges.begin(), ranges.end(), [&](const CupRange& range) {
      return std::any_of(cups.begin(), cups.end(),
                         [&](double cup) { return cup >= range.from_m && cup <= range.to_m; });
    });
    if (served > most) most = served, best = cups;
  };
  for (const double one : sizes) consider({one});
  for (auto one = sizes.begin(); one != sizes.end(); ++one)
    for (auto other = std::next(one); other != sizes.end(); ++other) consider({*one, *other});
  return best;
}

class Planner {
 public:
  /// Without `cups_m` each part that fingers do not hold has a cup of its own: to find out which are needed.
  Planner(const Product& product, const Disassembly& plan, const std::map<std::size_t, std::string>& refused,
          const std::optional<std::vector<double>>& cups_m)
      : product_(product),
        plan_(plan),
        refused_(refused),
        cups_m_(cups_m),
        removal_(product),
        group_(product.instances.size(), 0) {
    around_.original = around_.now = place(product);
    around_.moved.resize(product.instances.size());
    for (const Instance& instance : product.instances) around_.names.push_back(instance.name);
    result_.gripper.cups_m = cups_m.value_or(std::vector<double>{});
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
    around_.reach_m = result_.size_m = size.norm();
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
      if (move.cup) continue;
      result_.gripper.force_N =
          std::max(result_.gripper.force_N,
                   std::ceil(kGripMargin * mass_of(move.parts) * kGravity_m_per_s2 / kJawFriction));
    }
    result_.order = order_of(0);
    result_.tray_lower = tray_from_;
    result_.tray_upper = tray_to_ + Vec3(gap_, gap_, 0.0);
    const Vec3 middle = 0.5 * (whole_.box.lower + whole_.box.upper);
    result_.home = {Eigen::AngleAxisd(M_PI, Vec3::UnitX()).toRotationMatrix(),
                    Vec3(middle.x(), middle.y(), safe_)};
    return std::move(result_);
  }

  const std::vector<CupRange>& cup_ranges() const { return cup_ranges_; }

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
      std::set<std::size_t> company;
      std::size_t from;  ///< group
      Hindrance why;
    };
    std::vector<Pending> pending;
    const std::vector<std::set<std::size_t>> companies = planned_companies();
    for (std::size_t k = 0; k < plan_.steps.size(); ++k) {
      const RemovalStep& step = plan_.steps[k];
      const std::size_t from = group_[step.parts.front()];
      const Hindrance why = make(step, companies[k]);
      if (!why.reason.empty()) pending.push_back({step, companies[k], from, why});
    }
    for (bool progress = true; progress;) {
      progress = false;
      std::vector<Pending> left;
      for (Pending& one : pending) {
        // Parts of a group that have left it one by one are done.
        std::erase_if(one.step.parts, [&](std::size_t i) { return group_[i] != one.from; });
        if (one.step.parts.empty()) continue;
        one.why = make(one.step, one.company);
        if (one.why.reason.empty())
          progress = true;
        else
          left.push_back(std::move(one));
      }
      pending = std::move(left);
    }
    std::map<std::string, std::size_t> followers;  // by reason: its note
    for (const Pending& one : pending) {
      std::string parts;
      for (const std::size_t i : one.step.parts)
        parts += (i == one.step.parts.front() ? "" : ", ") + around_.names[i];
      if (one.why.of_order) {
        const auto [known, is_new] = followers.try_emplace(one.why.reason, result_.notes.size());
        if (!is_new) {
          std::string& note = result_.notes[known->second];
          note += (note.find("; nor ") == std::string::npos ? "; nor " : ", ") + parts;
          continue;
        }
      }
      result_.notes.push_back("The robot does not " + std::string(to_string(one.step.loosening)) + " " +
                              parts + ": " + one.why.reason);
    }
    for (const std::vector<std::size_t>& group : plan_.stuck) {
      std::string parts;
      for (const std::size_t i : group) parts += (i == group.front() ? "" : ", ") + around_.names[i];
      result_.notes.push_back("The robot leaves together " + parts + ": no straight motion parts them");
    }
  }

  /// Why a removal is not possible; without a reason: it is.
  struct Hindrance {
    std::string reason;
    bool of_order = false;  ///< the reason is a part that stays
  };

  /// By step of the plan: what was still with the parts of the step when it was planned, and does not hinder it.
  std::vector<std::set<std::size_t>> planned_companies() const {
    std::vector<std::set<std::size_t>> result;
    std::vector<std::size_t> group(group_.size(), 0);
    for (const RemovalStep& step : plan_.steps) {
      const std::size_t own = group[step.parts.front()];
      result.emplace_back();
      for (const std::size_t i : step.parts) group[i] = result.size();
      for (std::size_t i = 0; i < group.size(); ++i)
        if (group[i] == own) result.back().insert(i);
    }
    return result;
  }

  /// Makes the removal unless what stays hinders it.
  Hindrance make(const RemovalStep& step, const std::set<std::size_t>& company) {
    Hindrance why;
    for (const std::size_t i : step.parts) {
      const auto refused = refused_.find(i);
      if (refused != refused_.end()) why.reason = refused->second;
    }
    if (why.reason.empty()) why = {obstacle_of_order(step, company), true};
    if (why.reason.empty()) why = {try_to_make(step), false};
    return why;
  }

  /// What stays, as the robot could not remove it, may be in the way of the parts, or fall without them. Empty: it is not.
  std::string obstacle_of_order(const RemovalStep& step, const std::set<std::size_t>& company) {
    const std::set<std::size_t> moving(step.parts.begin(), step.parts.end());
    const auto& directions = removal_.directions();
    const auto d = static_cast<std::size_t>(
        std::find_if(directions.begin(), directions.end(),
                     [&](const Vec3& one) { return (one - step.direction_W).norm() < 1e-6; }) -
        directions.begin());
    for (std::size_t b = 0; b < group_.size(); ++b) {
      if (moving.contains(b) || company.contains(b) || group_[b] != group_[step.parts.front()]) continue;
      for (const std::size_t a : moving)
        if (d < directions.size() && removal_.blocked(a, d, b)) return around_.names[b] + " is in the way";
      if (b != plan_.base && falls(b, moving)) return around_.names[b] + " would fall";
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
    if (const auto loose = not_carried(step.parts, held))
      return around_.names[*loose] +
             " would stay behind, as it touches none of these parts that leaves later";
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
      found = with_cup(search, removing);
      if (!found) return why == search.reason() ? why : why + "; " + search.reason();
    }
    RobotMove move;
    move.held = held, move.parts = step.parts;
    from_.push_back(group_[held]);
    if (found->cup_m > 0.0)
      move.cup = static_cast<std::size_t>(
          std::find(result_.gripper.cups_m.begin(), result_.gripper.cups_m.end(), found->cup_m) -
          result_.gripper.cups_m.begin());
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
    if (!lay_down(step, *found, move)) {
      from_.pop_back();
      return "laid down, " + around_.names[held] +
             " would stand on other parts that leave with it, with no place for a post under it";
    }
    result_.moves.push_back(std::move(move));
    return "";
  }

  /// Of the parts of a group: those that leave it in the order of the moves, then those that stay in it.
  std::vector<std::size_t> order_of(std::size_t group) const {
    std::vector<std::size_t> order;
    for (std::size_t k = 0; k < result_.moves.size(); ++k) {
      if (from_[k] != group) continue;
      const std::vector<std::size_t> inner = order_of(k + 1);
      order.insert(order.end(), inner.begin(), inner.end());
    }
    for (const std::size_t i : plan_.order)
      if (group_[i] == group) order.push_back(i);
    return order;
  }

  /// A part that no chain of contacts joins to the held one, each with a part that leaves later.
  std::optional<std::size_t> not_carried(std::vector<std::size_t> parts, std::size_t held) const {
    std::sort(parts.begin(), parts.end(),
              [&](std::size_t a, std::size_t b) { return leaves_[a] > leaves_[b]; });
    std::set<std::size_t> carried{held};
    for (const std::size_t part : parts) {
      if (part == held) continue;
      const bool hangs =
          std::any_of(product_.contacts.begin(), product_.contacts.end(), [&](const Contact& contact) {
            if (contact.first != part && contact.second != part) return false;
            const std::size_t other = contact.first == part ? contact.second : contact.first;
            return carried.contains(other) && leaves_[other] > leaves_[part];
          });
      if (!hangs) return part;
      carried.insert(part);
    }
    return std::nullopt;
  }

  /// With the smallest cup that carries it.
  std::optional<Grasp> with_cup(GraspSearch& search, const Removing& removing) {
    const double least_m = cup_for(removing.mass_kg);
    if (cups_m_) {
      for (const double cup_m : *cups_m_)
        if (cup_m >= least_m)
          if (auto found = search.by_cup(removing, cup_m)) return found;
      const bool tried =
          std::any_of(cups_m_->begin(), cups_m_->end(), [&](double cup_m) { return cup_m >= least_m; });
      if (!tried) search.by_cup(removing, least_m);  // for the reason
      return std::nullopt;
    }
    std::optional<Grasp> first;
    for (const double mm : kCups_mm) {
      const double cup_m = 1e-3 * mm;
      if (cup_m < least_m) continue;
      const auto found = search.by_cup(removing, cup_m);
      if (!found) break;
      if (!first) first = found, cup_ranges_.push_back({cup_m, cup_m});
      cup_ranges_.back().to_m = cup_m;
    }
    return first;
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

  /// Onto the tray, with the grasp upwards. False, and nothing has moved, where the held part finds no footing there.
  bool lay_down(const RemovalStep& step, const Grasp& grasp, RobotMove& move) {
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
    const Aabb turned = turn(put);
    constexpr double kStands_m = 1e-6;
    std::vector<TriangleMesh> posts;
    if (around_.now[move.held].box.lower.z() - turned.lower.z() > kStands_m) {
      std::vector<PlacedInstance> group;
      std::size_t held = 0;
      for (const std::size_t i : step.parts) {
        if (i == move.held) held = group.size();
        group.push_back(around_.now[i]);
      }
      posts = posts_under(group, held, turned.lower.z());
      if (posts.empty()) {
        turn(put.inverse());
        return false;
      }
    }
    put.p = slot(turned);
    turn({Mat3::Identity(), put.p});
    for (TriangleMesh& post : posts) {
      for (Vec3& v : post.vertices) v += put.p;
      around_.fixed.push_back(placed(post));
      result_.tray_posts.push_back(std::move(post));
    }
    for (const std::size_t i : step.parts) group_[i] = result_.moves.size() + 1;
    move.put = put * move.grasp;
    move.over = at_height(move.put);
    return true;
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

  /// Diameter of the smallest one that carries it (m).
  static double cup_for(double mass_kg) {
    const double area = kGripMargin * mass_kg * kGravity_m_per_s2 / kCupPressure_Pa;
    const double least_mm = 1e3 * std::sqrt(4.0 * area / M_PI);
    const auto size = std::lower_bound(std::begin(kCups_mm), std::end(kCups_mm), least_mm);
    return 1e-3 * (size != std::end(kCups_mm) ? *size : std::ceil(least_mm));
  }

  Pose at_height(const Pose& pose) const {
    return {pose.R, Vec3(pose.p.x(), pose.p.y(), std::max(safe_, pose.p.z()))};
  }

  const Product& product_;
  const Disassembly& plan_;
  const std::map<std::size_t, std::string>& refused_;
  const std::optional<std::vector<double>>& cups_m_;
  Removal removal_;
  Surroundings around_;
  std::vector<std::size_t>
      group_;  ///< by instance: 0 in the product, else the move that brought it onto the tray
  std::vector<std::size_t> from_;    ///< by move: the group that its parts leave
  std::vector<std::size_t> leaves_;  ///< by instance: place in the order of disassembly
  std::vector<CupRange> cup_ranges_;
  BoxBuilder whole_;
  double floor_ = 0.0, safe_ = 0.0, gap_ = 0.0, row_x_ = 0.0, row_y_ = 0.0, row_end_ = 0.0, row_width_ = 0.0;
  Vec3 tray_from_ = Vec3::Zero(), tray_to_ = Vec3::Zero();
  RobotPlan result_;
};

}  // namespace

Pose cup_mount(const GripperSize& gripper, std::size_t cup) {
  const double side = cup == 0 ? 1.0 : -1.0;
  Pose X_GH{Mat3::Identity(), Vec3(side * 2.0 * gripper.finger_length_m, 0.0, 0.5 * gripper.finger_length_m)};
  X_GH.R << 0, 0, side, 0, side, 0, -1, 0, 0;  // z along the arm, which is along the x axis of the gripper
  return X_GH;
}

double cup_reach_m(double cup_m) {
  return std::clamp(0.1 * cup_m, 2e-4, 2e-3);
}

RobotPlan plan_robot(const Product& product, const Disassembly& plan,
                     const std::map<std::size_t, std::string>& refused) {
  const std::optional<std::vector<double>> open;
  Planner first(product, plan, refused, open);
  first.run();
  const std::optional<std::vector<double>> cups_m = choose_cups(first.cup_ranges());
  RobotPlan result = Planner(product, plan, refused, cups_m).run();
  const bool used = std::any_of(result.moves.begin(), result.moves.end(),
                                [](const RobotMove& move) { return move.cup.has_value(); });
  if (!used) result.gripper.cups_m.clear();
  return result;
}

}  // namespace takt::product
