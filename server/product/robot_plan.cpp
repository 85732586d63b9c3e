#include "server/product/robot_plan.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <set>

#include "server/product/geometry.h"

namespace takt::product {

namespace {

constexpr double kParallel = 1e-3;  ///< of the cosine
constexpr double kMargin_m = 2e-4;  ///< between gripper and other parts
constexpr double kSmallest_m = 1e-9;
constexpr double kLeastForce_N = 100.0;
constexpr double kJawFriction = 0.15;  ///< assumed: dry steel on steel
constexpr double kGripMargin =
    3.0;  ///< force of the jaws over what the weight needs: acceleration and levers
constexpr double kGravity_m_per_s2 = 9.81;

using Polygon = std::vector<Vec3>;

/// The part of a polygon with n . p <= offset.
void clip(Polygon& polygon, const Vec3& n, double offset) {
  Polygon result;
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const Vec3 &p = polygon[k], &q = polygon[(k + 1) % polygon.size()];
    const double a = n.dot(p) - offset, b = n.dot(q) - offset;
    if (a <= 0.0) result.push_back(p);
    if ((a < 0.0 && b > 0.0) || (a > 0.0 && b < 0.0)) result.push_back(p + a / (a - b) * (q - p));
  }
  polygon = std::move(result);
}

double area(const Polygon& polygon) {
  Vec3 sum = Vec3::Zero();
  for (std::size_t k = 2; k < polygon.size(); ++k)
    sum += (polygon[k - 1] - polygon[0]).cross(polygon[k] - polygon[0]);
  return 0.5 * sum.norm();
}

/// A box with axes of its own; `lower` and `upper` are coordinates along them, from the origin of the world.
struct TurnedBox {
  Mat3 axes;  ///< columns
  Vec3 lower, upper;

  bool meets(const Triangle& triangle) const {
    Polygon polygon;
    for (const Vec3& p : triangle) polygon.push_back(axes.transpose() * p);
    for (int k = 0; k < 3; ++k) {
      const auto [low, high] = std::minmax({polygon[0][k], polygon[1][k], polygon[2][k]});
      if (low >= upper[k] || high <= lower[k]) return false;
    }
    for (int k = 0; k < 3 && polygon.size() > 2; ++k) {
      clip(polygon, Vec3::Unit(k), upper[k]);
      clip(polygon, -Vec3::Unit(k), -lower[k]);
    }
    return polygon.size() > 2;
  }
  Aabb box() const {
    BoxBuilder builder;
    for (int corner = 0; corner < 8; ++corner)
      builder.add(axes * Vec3((corner & 1) != 0 ? upper.x() : lower.x(),
                              (corner & 2) != 0 ? upper.y() : lower.y(),
                              (corner & 4) != 0 ? upper.z() : lower.z()));
    return builder.box;
  }
};

struct Grasp {
  Vec3 out, jaws, tip;  ///< from the part towards the tool; jaw axis; tool centre point
  double width = 0.0, score = 0.0;
};

Pose tool(const Grasp& grasp) {
  Mat3 R;
  R.col(2) = -grasp.out;
  R.col(1) = grasp.jaws;
  R.col(0) = R.col(1).cross(R.col(2));
  return {R, grasp.tip};
}

Pose moved(const Pose& pose, const Vec3& by) {
  return {pose.R, pose.p + by};
}

class Planner {
 public:
  Planner(const Product& product, const Disassembly& plan)
      : product_(product),
        plan_(plan),
        original_(place(product)),
        now_(original_),
        turns_(product.instances.size(), Mat3::Identity()) {}

  RobotPlan run() {
    for (const PlacedInstance& instance : now_)
      whole_.add(instance.box.lower), whole_.add(instance.box.upper);
    size_gripper();
    const Vec3 size = whole_.box.upper - whole_.box.lower;
    const double reach = result_.gripper.finger_length_m;
    floor_ = whole_.box.lower.z();
    gap_ = 2.0 * (result_.gripper.finger_thickness_m + result_.gripper.opening_m) + 0.002;
    row_x_ = whole_.box.upper.x() + 0.2 * std::max(size.x(), size.y()) + gap_;
    row_y_ = whole_.box.lower.y();
    tray_from_ = Vec3(row_x_ - gap_, row_y_ - gap_, floor_ - 0.05 * size.maxCoeff());
    tray_to_ = Vec3(row_x_, row_y_, floor_);
    row_end_ = std::max(whole_.box.upper.y(), row_y_ + 0.5 * size.maxCoeff());
    // The whole tool hangs below this height when it points down; parts hang below the tool.
    safe_ = whole_.box.upper.z() + size.maxCoeff() + 0.5 * reach;
    for (const RemovalStep& step : plan_.steps)
      if (!make(step)) break;
    result_.gripper.force_N = kLeastForce_N;
    for (const RobotMove& move : result_.moves) {
      double mass_kg = 0.0;
      for (const std::size_t i : move.parts) mass_kg += now_[i].mass_kg;
      result_.gripper.force_N = std::max(result_.gripper.force_N,
                                         std::ceil(kGripMargin * mass_kg * kGravity_m_per_s2 / kJawFriction));
    }
    result_.tray_lower = tray_from_;
    result_.tray_upper = tray_to_ + Vec3(gap_, gap_, 0.0);
    const Vec3 middle = 0.5 * (whole_.box.lower + whole_.box.upper);
    result_.home = {Eigen::AngleAxisd(M_PI, Vec3::UnitX()).toRotationMatrix(),
                    Vec3(middle.x(), middle.y(), safe_)};
    return std::move(result_);
  }

 private:
  void size_gripper() {
    GripperSize& g = result_.gripper;
    double middle = std::numeric_limits<double>::infinity(), widest = 0.0;
    for (std::size_t i = 0; i < now_.size(); ++i) {
      if (i == plan_.base && now_.size() > 1) continue;
      Vec3 size = now_[i].box.upper - now_[i].box.lower;
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

  /// Directions in which the jaws can close on opposite faces, across `out`.
  std::vector<Vec3> jaw_axes(std::size_t held, const Vec3& out) const {
    std::vector<Vec3> axes;
    const auto add = [&](Vec3 axis) {
      if (std::abs(axis.dot(out)) > kParallel || axes.size() >= 16) return;
      axis = (axis - axis.dot(out) * out).normalized();
      if (std::none_of(axes.begin(), axes.end(),
                       [&](const Vec3& a) { return std::abs(a.dot(axis)) > 0.999; }))
        axes.push_back(axis);
    };
    for (const PlacedFace& face : original_[held].faces) {
      const Vec3 axis = turns_[held] * face.face.axis_B;
      if (face.face.kind == SurfaceKind::plane) add(axis);
      if (face.face.kind != SurfaceKind::cylinder || face.face.concave) continue;
      const Vec3 across = out.cross(axis);
      if (across.norm() > 0.999) add(across);
      if (across.norm() > kParallel) continue;
      const Vec3 x = out.unitOrthogonal(), y = out.cross(x);
      for (int k = 0; k < 6; ++k) add(std::cos(k * M_PI / 6) * x + std::sin(k * M_PI / 6) * y);
    }
    return axes;
  }

  /// What lies between the fingers: its width, and how much of both pads rests on it.
  std::optional<Grasp> between(std::size_t held, const Vec3& out, const Vec3& jaws, double top, double depth,
                               double at) const {
    const GripperSize& g = result_.gripper;
    const Vec3 across = jaws.cross(-out);
    std::vector<std::pair<Polygon, double>> pieces;  // with the normal's part along the jaws
    double from = std::numeric_limits<double>::infinity(), to = -from;
    for (const Triangle& t : now_[held].triangles) {
      Polygon polygon(t.begin(), t.end());
      clip(polygon, -out, depth - top);
      if (polygon.size() > 2) clip(polygon, across, at + 0.5 * g.finger_width_m);
      if (polygon.size() > 2) clip(polygon, -across, 0.5 * g.finger_width_m - at);
      if (polygon.size() < 3) continue;
      for (const Vec3& p : polygon) from = std::min(from, p.dot(jaws)), to = std::max(to, p.dot(jaws));
      pieces.emplace_back(std::move(polygon), normal_of(t).normalized().dot(jaws));
    }
    const double width = to - from;
    if (pieces.empty() || width < kSmallest_m || width > g.largest_width_m - 2.0 * g.opening_m)
      return std::nullopt;
    double low = 0.0, high = 0.0;
    for (const auto& [polygon, along] : pieces) {
      if (std::abs(along) < 0.9) continue;
      double mean = 0.0;
      for (const Vec3& p : polygon) mean += p.dot(jaws) / static_cast<double>(polygon.size());
      if (along > 0.0 && to - mean < 0.06 * width) high += area(polygon);
      if (along < 0.0 && mean - from < 0.06 * width) low += area(polygon);
    }
    const double pad = g.finger_width_m * g.finger_width_m, held_area = std::min({low, high, pad});
    if (held_area < 0.02 * pad) return std::nullopt;
    Grasp grasp{out, jaws, (top - depth) * out + 0.5 * (from + to) * jaws + at * across, width, 0.0};
    const Vec3 lever = grasp.tip - centre(held);
    const double size = (now_[held].box.upper - now_[held].box.lower).norm();
    grasp.score = held_area / pad - 0.3 * width / g.largest_width_m -
                  0.5 * (lever - lever.dot(out) * out).norm() / size;
    return grasp;
  }

  Vec3 centre(std::size_t i) const { return 0.5 * (now_[i].box.lower + now_[i].box.upper); }

  /// Fingers and body of the gripper at a tool centre point; the fingers `longer` by this.
  std::vector<TurnedBox> tool_boxes(const Grasp& grasp, const Vec3& by, double longer) const {
    const GripperSize& g = result_.gripper;
    Mat3 axes;
    axes.col(0) = grasp.jaws.cross(-grasp.out), axes.col(1) = grasp.jaws, axes.col(2) = grasp.out;
    const Vec3 tip = axes.transpose() * (grasp.tip + by);
    const double inner = 0.5 * grasp.width + kMargin_m,
                 outer = 0.5 * grasp.width + g.opening_m + g.finger_thickness_m + kMargin_m,
                 half = 0.5 * g.finger_width_m + kMargin_m,
                 body = 0.5 * g.largest_width_m + g.finger_thickness_m;
    const double end = g.finger_length_m + longer;
    return {
        {axes, tip + Vec3(-half, inner, -kMargin_m), tip + Vec3(half, outer, end)},
        {axes, tip + Vec3(-half, -outer, -kMargin_m), tip + Vec3(half, -inner, end)},
        {axes, tip + Vec3(-2 * half, -body, g.finger_length_m), tip + Vec3(2 * half, body, end + 4 * half)}};
  }

  bool free(const std::vector<TurnedBox>& boxes, const std::set<std::size_t>& without) const {
    for (const TurnedBox& box : boxes) {
      const Aabb around = box.box();
      if (around.lower.z() < floor_) return false;
      for (std::size_t i = 0; i < now_.size(); ++i) {
        if (without.contains(i) || !near(now_[i].box, around, 0.0)) continue;
        for (const Triangle& t : now_[i].triangles)
          if (box.meets(t)) return false;
      }
    }
    return true;
  }

  std::optional<Grasp> grasp(std::size_t held, const std::set<std::size_t>& moving, const Vec3& d,
                             double way) const {
    std::vector<Vec3> sides{d};
    for (const Vec3& side : {Vec3(0, 0, 1), Vec3(1, 0, 0), Vec3(-1, 0, 0), Vec3(0, 1, 0), Vec3(0, -1, 0)})
      if (side.dot(d) > -kParallel && side.dot(d) < 0.999) sides.push_back(side);
    for (const Vec3& out : sides) {
      double low = std::numeric_limits<double>::infinity(), top = -low;
      for (const Triangle& t : now_[held].triangles)
        for (const Vec3& p : t) low = std::min(low, p.dot(out)), top = std::max(top, p.dot(out));
      std::vector<Grasp> candidates;
      for (const Vec3& jaws : jaw_axes(held, out)) {
        const Vec3 across = jaws.cross(-out);
        double left = std::numeric_limits<double>::infinity(), right = -left;
        for (const Triangle& t : now_[held].triangles)
          for (const Vec3& p : t)
            left = std::min(left, p.dot(across)), right = std::max(right, p.dot(across));
        for (const double share : {1.0, 0.5, 0.25}) {
          const double depth = std::min(share * result_.gripper.finger_width_m, 0.8 * (top - low));
          for (const double u : {0.5, 0.25, 0.75, 0.12, 0.88})
            if (auto one = between(held, out, jaws, top, depth, left + u * (right - left)))
              candidates.push_back(*one);
        }
      }
      std::stable_sort(candidates.begin(), candidates.end(),
                       [](const Grasp& a, const Grasp& b) { return a.score > b.score; });
      const double beyond = (whole_.box.upper - whole_.box.lower).norm();
      for (const Grasp& one : candidates) {
        if (!free(tool_boxes(one, Vec3::Zero(), beyond), {held})) continue;
        constexpr int kSteps = 24;
        bool clear = true;
        for (int k = 1; k <= kSteps && clear && out.dot(d) < 0.999; ++k)
          clear = free(tool_boxes(one, way * k / kSteps * d, 0.0), moving);
        if (clear) return one;
      }
    }
    return std::nullopt;
  }

  /// A place on the tray for a group of this box; returns the shift of the box to it.
  Vec3 slot(const Aabb& box) {
    const Vec3 size = box.upper - box.lower;
    if (row_y_ > tray_from_.y() + 2.0 * gap_ && row_y_ + size.y() > row_end_)
      row_x_ += row_width_ + gap_, row_y_ = tray_from_.y() + gap_, row_width_ = 0.0;
    const Vec3 shift = Vec3(row_x_, row_y_, floor_) - box.lower;
    row_y_ += size.y() + gap_;
    row_width_ = std::max(row_width_, size.x());
    tray_to_ = tray_to_.cwiseMax(Vec3(row_x_ + size.x(), row_y_ - gap_, floor_));
    return shift;
  }

  bool make(const RemovalStep& step) {
    const std::set<std::size_t> moving(step.parts.begin(), step.parts.end());
    std::size_t held = step.parts.front();
    for (const std::size_t i : step.parts)
      if (now_[i].mass_kg > now_[held].mass_kg) held = i;
    const Vec3 d = turns_[held] * step.direction_W;
    RobotMove move;
    move.held = held, move.parts = step.parts;
    move.name = std::string(to_string(step.loosening)) + " " + product_.instances[held].name;
    const auto refuse = [&](const std::string& why) {
      result_.notes.push_back("The robot program ends before '" + move.name + "': " + why);
      return false;
    };
    if (d.z() < -0.5)
      return refuse("the part leaves downwards, where the support is; turn the product with --up");
    // Out of the boxes of all that stays where it is.
    double way = 0.0, from = std::numeric_limits<double>::infinity();
    for (const std::size_t i : step.parts)
      for (const Triangle& t : now_[i].triangles)
        for (const Vec3& p : t) from = std::min(from, p.dot(d));
    for (std::size_t i = 0; i < now_.size(); ++i) {
      if (moving.contains(i) || on_tray(i) != on_tray(held)) continue;
      for (const Triangle& t : now_[i].triangles)
        for (const Vec3& p : t) way = std::max(way, p.dot(d) - from);
    }
    way += 0.005;
    const std::optional<Grasp> found = grasp(held, moving, d, way);
    if (!found)
      return refuse("no two opposite faces of the part are within the stroke and free for the fingers");
    move.width_m = found->width;
    move.grasp = tool(*found);
    const double back = (whole_.box.upper - whole_.box.lower).norm();
    move.start = moved(move.grasp, back * found->out);
    move.above = at_height(move.start);
    move.out = moved(move.grasp, way * d);
    move.lift = at_height(move.out);
    const Mat3 turn = Eigen::Quaterniond::FromTwoVectors(found->out, Vec3::UnitZ()).toRotationMatrix();
    BoxBuilder box;
    for (const std::size_t i : step.parts) {
      for (Triangle& t : now_[i].triangles)
        for (Vec3& p : t) p = turn * p, box.add(p);
      turns_[i] = turn * turns_[i];
      tray_.insert(i);
    }
    const Vec3 shift = slot(box.box);
    for (const std::size_t i : step.parts) {
      BoxBuilder own;
      for (Triangle& t : now_[i].triangles)
        for (Vec3& p : t) p += shift, own.add(p);
      now_[i].box = own.box;
    }
    move.put = {turn * move.grasp.R, turn * move.grasp.p + shift};
    move.over = at_height(move.put);
    result_.moves.push_back(std::move(move));
    return true;
  }

  bool on_tray(std::size_t i) const { return tray_.contains(i); }
  Pose at_height(const Pose& pose) const {
    return {pose.R, Vec3(pose.p.x(), pose.p.y(), std::max(safe_, pose.p.z()))};
  }

  const Product& product_;
  const Disassembly& plan_;
  const std::vector<PlacedInstance> original_;
  std::vector<PlacedInstance> now_;  ///< where the triangles are at present; faces stay those of the product
  std::vector<Mat3> turns_;          ///< by instance: how it is turned against the product
  std::set<std::size_t> tray_;
  BoxBuilder whole_;
  double floor_ = 0.0, safe_ = 0.0, gap_ = 0.0, row_x_ = 0.0, row_y_ = 0.0, row_end_ = 0.0, row_width_ = 0.0;
  Vec3 tray_from_ = Vec3::Zero(), tray_to_ = Vec3::Zero();
  RobotPlan result_;
};

}  // namespace

RobotPlan plan_robot(const Product& product, const Disassembly& plan) {
  return Planner(product, plan).run();
}

}  // namespace takt::product
