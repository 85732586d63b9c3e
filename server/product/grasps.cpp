#include "server/product/grasps.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "idl/common/text.h"

namespace takt::product {

namespace {

constexpr double kParallel = 1e-3;  ///< of the cosine
constexpr double kMargin_m = 2e-4;  ///< between gripper and other parts
constexpr double kSmallest_m = 1e-9;
constexpr int kSteps = 24;  ///< places on the way out at which the tool is looked at
constexpr const char* kMeetsSupport = "it meets the support on its way out";

double area(const Polygon& polygon) {
  Vec3 sum = Vec3::Zero();
  for (std::size_t k = 2; k < polygon.size(); ++k)
    sum += (polygon[k - 1] - polygon[0]).cross(polygon[k] - polygon[0]);
  return 0.5 * sum.norm();
}

/// From which the tool may come to what leaves along `d`: never from below.
std::vector<Vec3> sides_of(const Vec3& d) {
  std::vector<Vec3> sides;
  if (d.z() > -0.5) sides.push_back(d);
  // The tray lies on the side of x.
  for (const Vec3& side : {Vec3(0, 0, 1), Vec3(-1, 0, 0), Vec3(0, 1, 0), Vec3(0, -1, 0), Vec3(1, 0, 0)})
    if (side.dot(d) > -kParallel && side.dot(d) < 0.999) sides.push_back(side);
  return sides;
}

/// A part seen against a direction: how far it reaches along it, by place.
class TopView {
 public:
  TopView(const PlacedInstance& part, const Vec3& out) {
    axes_.row(2) = out.transpose();
    axes_.row(0) = out.unitOrthogonal().transpose();
    axes_.row(1) = out.cross(Vec3(axes_.row(0).transpose())).transpose();
    BoxBuilder all;
    for (const Triangle& t : part.triangles) {
      const Triangle seen{axes_ * t[0], axes_ * t[1], axes_ * t[2]};
      for (const Vec3& p : seen) all.add(p);
      if (normal_of(seen).z() > 0.0) triangles_.push_back(seen);
    }
    from_ = all.box.lower.head<2>();
    size_ = (all.box.upper - all.box.lower).head<2>().cwiseMax(kSmallest_m);
    cells_.resize(static_cast<std::size_t>(kCells) * kCells);
    for (std::size_t k = 0; k < triangles_.size(); ++k) {
      const Triangle& t = triangles_[k];
      const auto low = cell(t[0].cwiseMin(t[1]).cwiseMin(t[2]).head<2>()),
                 high = cell(t[0].cwiseMax(t[1]).cwiseMax(t[2]).head<2>());
      for (int i = low.x(); i <= high.x(); ++i)
        for (int j = low.y(); j <= high.y(); ++j)
          cells_[static_cast<std::size_t>(i) * kCells + static_cast<std::size_t>(j)].push_back(k);
    }
  }

  std::optional<double> height(const Eigen::Vector2d& at) const {
    std::optional<double> highest;
    if ((at.array() < from_.array()).any() || (at.array() > (from_ + size_).array()).any()) return highest;
    const Eigen::Vector2i c = cell(at);
    for (const std::size_t k :
         cells_[static_cast<std::size_t>(c.x()) * kCells + static_cast<std::size_t>(c.y())]) {
      const Triangle& t = triangles_[k];
      if (!covers(t, at.x(), at.y(), 1.0)) continue;
      const Vec3 n = normal_of(t);
      const double z = t[0].z() - (n.x() * (at.x() - t[0].x()) + n.y() * (at.y() - t[0].y())) / n.z();
      if (!highest || z > *highest) highest = z;
    }
    return highest;
  }

  Eigen::Vector2d middle() const { return from_ + 0.5 * size_; }
  Eigen::Vector2d at_share(double u, double v) const {
    return from_ + size_.cwiseProduct(Eigen::Vector2d(u, v));
  }
  Eigen::Vector2d seen(const Vec3& p) const { return (axes_ * p).head<2>(); }
  Vec3 in_world(const Eigen::Vector2d& at, double z) const {
    return axes_.transpose() * Vec3(at.x(), at.y(), z);
  }

 private:
  static constexpr int kCells = 48;
  Eigen::Vector2i cell(const Eigen::Vector2d& at) const {
    const Eigen::Vector2d share = (at - from_).cwiseQuotient(size_) * kCells;
    return share.array().floor().cwiseMax(0.0).cwiseMin(kCells - 1.0).cast<int>();
  }

  Mat3 axes_;  ///< rows
  std::vector<Triangle> triangles_;
  std::vector<std::vector<std::size_t>> cells_;
  Eigen::Vector2d from_, size_;
};

/// Height of the lip of a cup that seals there. The lip gives way by a share of its radius; within it the part may be lower,
/// as in the recess of a screw, but not open.
std::optional<double> sealed_height(const TopView& view, const Eigen::Vector2d& at, double radius) {
  constexpr int kRim = 16;
  constexpr double kGives = 0.1, kFacets_m = 2e-5;
  const auto around = [&](double share, int k) {
    const double angle = 2.0 * M_PI * k / kRim;
    return view.height(at + share * radius * Eigen::Vector2d(std::cos(angle), std::sin(angle)));
  };
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const double share : {1.0, 0.9}) {
    for (int k = 0; k < kRim; ++k) {
      const auto here = around(share, k);
      if (!here) return std::nullopt;
      low = std::min(low, *here), high = std::max(high, *here);
      if (high - low > kGives * radius + kFacets_m) return std::nullopt;
    }
  }
  for (const double share : {0.0, 0.3, 0.6})
    for (int k = 0; k < (share > 0.0 ? kRim : 1); ++k) {
      const auto here = around(share, k);
      if (!here || *here > high + kGives * radius + kFacets_m) return std::nullopt;
    }
  return high;
}

std::string millimetres(double length_m) {
  return number_text(length_m * 1e3, 3) + " mm";
}

}  // namespace

bool TurnedBox::meets(const Triangle& triangle) const {
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

Aabb TurnedBox::box() const {
  BoxBuilder builder;
  for (int corner = 0; corner < 8; ++corner)
    builder.add(axes * Vec3((corner & 1) != 0 ? upper.x() : lower.x(),
                            (corner & 2) != 0 ? upper.y() : lower.y(),
                            (corner & 4) != 0 ? upper.z() : lower.z()));
  return builder.box;
}

/// The support stands in the way of what leaves, straight out and then up.
bool GraspSearch::meets_support(const Removing& removing) const {
  const bool rises =
      removing.direction.z() > -kParallel;  // else the tool carries it aside (obstacle_on_the_way)
  const Vec3 margin = Vec3::Constant(kMargin_m);
  for (const PlacedInstance& post : around_.fixed) {
    const TurnedBox box{Mat3::Identity(), post.box.lower + margin, post.box.upper - margin};
    for (const std::size_t i : removing.moving) {
      const PlacedInstance& part = around_.now[i];
      for (int k = 1; k <= kSteps; ++k) {
        const Vec3 by = removing.way_m * k / kSteps * removing.direction;
        const Aabb there{part.box.lower + by, part.box.upper + by};
        const bool beside = ((there.lower - box.upper).head<2>().array() > 0.0).any() ||
                            ((box.lower - there.upper).head<2>().array() > 0.0).any();
        if (beside || box.upper.z() < there.lower.z()) continue;
        if (rises && k == kSteps) return true;
        if (std::any_of(part.triangles.begin(), part.triangles.end(), [&](const Triangle& t) {
              return box.meets({t[0] + by, t[1] + by, t[2] + by});
            }))
          return true;
      }
    }
  }
  return false;
}

/// Directions across `out` in which opposite faces may lie, those that the faces suggest first.
std::vector<Vec3> GraspSearch::jaw_axes(std::size_t held, const Vec3& out) const {
  std::vector<Vec3> axes;
  const auto add = [&](Vec3 axis) {
    if (std::abs(axis.dot(out)) > kParallel || axes.size() >= 16) return;
    axis = (axis - axis.dot(out) * out).normalized();
    if (std::none_of(axes.begin(), axes.end(), [&](const Vec3& a) { return std::abs(a.dot(axis)) > 0.999; }))
      axes.push_back(axis);
  };
  for (const PlacedFace& face : around_.original[held].faces) {
    const Vec3 axis = around_.moved[held].R * face.face.axis_B;
    if (face.face.kind == SurfaceKind::plane) add(axis);
    if (face.face.kind != SurfaceKind::cylinder || face.face.concave) continue;
    const Vec3 across = out.cross(axis);
    if (across.norm() > kParallel) add(across.normalized());
  }
  // Round and freeform ones.
  const Vec3 x = out.unitOrthogonal(), y = out.cross(x);
  for (int k = 0; k < 6; ++k) add(std::cos(k * M_PI / 6) * x + std::sin(k * M_PI / 6) * y);
  return axes;
}

/// What lies between the fingers: its width, and how much of both pads rests on it.
std::optional<Grasp> GraspSearch::between(const std::vector<Triangle>& upper, std::size_t held,
                                          const Vec3& out, const Vec3& jaws, double top, double depth,
                                          double at) {
  const GripperSize& g = gripper_;
  const Vec3 across = jaws.cross(-out);
  std::vector<std::pair<Polygon, double>> pieces;  // with the normal's part along the jaws
  double from = std::numeric_limits<double>::infinity(), to = -from;
  for (const Triangle& t : upper) {
    const auto [low, high] = std::minmax({t[0].dot(across), t[1].dot(across), t[2].dot(across)});
    if (low > at + 0.5 * g.finger_width_m || high < at - 0.5 * g.finger_width_m) continue;
    Polygon polygon(t.begin(), t.end());
    clip(polygon, -out, depth - top);
    if (polygon.size() > 2) clip(polygon, across, at + 0.5 * g.finger_width_m);
    if (polygon.size() > 2) clip(polygon, -across, 0.5 * g.finger_width_m - at);
    if (polygon.size() < 3) continue;
    for (const Vec3& p : polygon) from = std::min(from, p.dot(jaws)), to = std::max(to, p.dot(jaws));
    pieces.emplace_back(std::move(polygon), normal_of(t).normalized().dot(jaws));
  }
  const double width = to - from;
  if (pieces.empty() || width < kSmallest_m) return std::nullopt;
  const bool too_wide = width > g.largest_width_m - 2.0 * g.opening_m;
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
  if (too_wide) {
    narrowest_m_ = narrowest_m_ > 0.0 ? std::min(narrowest_m_, width) : width;
    return std::nullopt;
  }
  Grasp grasp{0.0, out, jaws, (top - depth) * out + 0.5 * (from + to) * jaws + at * across, width, 0.0};
  const Vec3 lever = grasp.tip - 0.5 * (around_.now[held].box.lower + around_.now[held].box.upper);
  const double size = (around_.now[held].box.upper - around_.now[held].box.lower).norm();
  grasp.score =
      held_area / pad - 0.3 * width / g.largest_width_m - 0.5 * (lever - lever.dot(out) * out).norm() / size;
  return grasp;
}

/// Fingers and body of the gripper at a tool centre point, the fingers `longer` by this; or the cup with its arm.
std::vector<TurnedBox> GraspSearch::tool_boxes(const Grasp& grasp, const Vec3& by, double longer) const {
  const GripperSize& g = gripper_;
  Mat3 axes;
  axes.col(0) = grasp.jaws.cross(-grasp.out), axes.col(1) = grasp.jaws, axes.col(2) = grasp.out;
  const Vec3 tip = axes.transpose() * (grasp.tip + by);
  // From a little inside the part on: what lies beside it with a face in the same plane would be gripped as well.
  const double inner = 0.5 * grasp.width - kMargin_m,
               outer = 0.5 * grasp.width + g.opening_m + g.finger_thickness_m + kMargin_m,
               half = 0.5 * g.finger_width_m + kMargin_m,
               body = 0.5 * g.largest_width_m + g.finger_thickness_m;
  if (grasp.cup_m > 0.0) {
    const double r = 0.5 * grasp.cup_m + kMargin_m;
    std::vector<TurnedBox> boxes;  // within the round arm
    for (const double angle : {M_PI / 8, M_PI / 4, 3 * M_PI / 8}) {
      const double x = r * std::cos(angle), y = r * std::sin(angle);
      boxes.push_back(
          {axes, tip + Vec3(-x, -y, kMargin_m), tip + Vec3(x, y, 2.0 * g.finger_length_m + longer)});
    }
    return boxes;
  }
  const double end = g.finger_length_m + longer;
  return {
      {axes, tip + Vec3(-half, inner, -kMargin_m), tip + Vec3(half, outer, end)},
      {axes, tip + Vec3(-half, -outer, -kMargin_m), tip + Vec3(half, -inner, end)},
      {axes, tip + Vec3(-2 * half, -body, g.finger_length_m), tip + Vec3(2 * half, body, end + 4 * half)}};
}

/// The first that the boxes meet; empty: none.
std::string GraspSearch::obstacle(const std::vector<TurnedBox>& boxes,
                                  const std::set<std::size_t>& without) const {
  for (const TurnedBox& box : boxes) {
    const Aabb around = box.box();
    if (around.lower.z() < around_.floor_m) return "the floor";
    const auto meets = [&](const PlacedInstance& one) {
      return near(one.box, around, 0.0) && std::any_of(one.triangles.begin(), one.triangles.end(),
                                                       [&](const Triangle& t) { return box.meets(t); });
    };
    for (std::size_t i = 0; i < around_.now.size(); ++i)
      if (!without.contains(i) && meets(around_.now[i])) return around_.names[i];
    if (std::any_of(around_.fixed.begin(), around_.fixed.end(), meets)) return "the support";
  }
  return "";
}

/// What the tool meets at the part, or with it on its way out.
std::string GraspSearch::obstacle_on_the_way(const Grasp& grasp, const Removing& removing) const {
  const std::set<std::size_t> touched = grasp.cup_m > 0.0 ? std::set<std::size_t>{} : std::set{removing.held};
  std::string met = obstacle(tool_boxes(grasp, Vec3::Zero(), around_.reach_m), touched);
  for (int k = 1; k <= kSteps && met.empty() && grasp.out.dot(removing.direction) < 0.999; ++k)
    met = obstacle(tool_boxes(grasp, removing.way_m * k / kSteps * removing.direction, 0.0), removing.moving);
  if (!met.empty() || removing.direction.z() > -kParallel) return met;
  // What leaves downwards leaves then towards the tool, past the support.
  BoxBuilder parts, aside;
  const Vec3 down = removing.way_m * removing.direction;
  for (const std::size_t i : removing.moving) {
    const Aabb& box = around_.now[i].box;
    parts.add(box.lower), parts.add(box.upper), parts.add(box.lower + down), parts.add(box.upper + down);
    for (const double way : {0.0, around_.reach_m})
      aside.add(box.lower + down + way * grasp.out), aside.add(box.upper + down + way * grasp.out);
  }
  std::set<std::size_t> all;
  for (std::size_t i = 0; i < around_.now.size(); ++i) all.insert(i);
  const Vec3 margin = Vec3::Constant(kMargin_m);
  for (const Aabb& box : {parts.box, aside.box})
    if (met.empty()) met = obstacle({{Mat3::Identity(), box.lower + margin, box.upper - margin}}, all);
  if (met.empty()) met = obstacle(tool_boxes(grasp, down, around_.reach_m), removing.moving);
  return met;
}

std::optional<Grasp> GraspSearch::by_fingers(const Removing& removing) {
  if (meets_support(removing)) {
    reason_ = kMeetsSupport;
    return std::nullopt;
  }
  narrowest_m_ = 0.0;
  std::string met;
  for (const Vec3& out : sides_of(removing.direction)) {
    const PlacedInstance& part = around_.now[removing.held];
    const Extent height = along(part, out);
    const double deepest = std::min(gripper_.finger_width_m, 0.8 * (height.to - height.from));
    std::vector<Triangle> upper;  // what the fingers can reach
    for (const Triangle& t : part.triangles)
      if (std::max({t[0].dot(out), t[1].dot(out), t[2].dot(out)}) > height.to - deepest) upper.push_back(t);
    std::vector<Grasp> candidates;
    for (const Vec3& jaws : jaw_axes(removing.held, out)) {
      const Extent across = along(part, jaws.cross(-out));
      for (const double share : {1.0, 0.5, 0.25}) {
        const double depth = std::min(share * gripper_.finger_width_m, 0.8 * (height.to - height.from));
        for (const double u : {0.5, 0.25, 0.75, 0.12, 0.88})
          if (auto one = between(upper, removing.held, out, jaws, height.to, depth,
                                 across.from + u * (across.to - across.from)))
            candidates.push_back(*one);
      }
    }
    std::stable_sort(candidates.begin(), candidates.end(),
                     [](const Grasp& a, const Grasp& b) { return a.score > b.score; });
    for (const Grasp& one : candidates) {
      const std::string obstacle = obstacle_on_the_way(one, removing);
      if (obstacle.empty()) return one;
      if (met.empty()) met = obstacle;
    }
  }
  if (!met.empty())
    reason_ = "at its faces the gripper meets " + met;
  else if (narrowest_m_ > 0.0)
    reason_ = "its narrowest opposite faces are " + millimetres(narrowest_m_) + " apart, the gripper opens " +
              millimetres(gripper_.largest_width_m - 2.0 * gripper_.opening_m);
  else
    reason_ = "no two of its faces are opposite";
  return std::nullopt;
}

/// Places for a cup on the side of `out`, best first.
std::vector<Grasp> GraspSearch::cup_places(std::size_t held, const Vec3& out, double cup_m) const {
  const TopView view(around_.now[held], out);
  std::vector<Eigen::Vector2d> places{view.middle()};
  // Heads of screws, and what else is round.
  for (const PlacedFace& face : around_.original[held].faces) {
    const bool round = face.face.kind == SurfaceKind::cylinder || face.face.kind == SurfaceKind::cone ||
                       face.face.kind == SurfaceKind::torus || face.face.kind == SurfaceKind::sphere;
    const Pose& moved = around_.moved[held];
    if (!round || places.size() > 64) continue;
    if (face.face.kind != SurfaceKind::sphere && (moved.R * face.face.axis_B).cross(out).norm() > kParallel)
      continue;
    places.push_back(view.seen(moved * face.face.point_B));
  }
  constexpr int kCells = 12;
  for (int i = 1; i < kCells; ++i)
    for (int j = 1; j < kCells; ++j) places.push_back(view.at_share(1.0 * i / kCells, 1.0 * j / kCells));
  std::vector<Grasp> result;
  for (const Eigen::Vector2d& place : places) {
    const auto height = sealed_height(view, place, 0.5 * cup_m);
    if (!height) continue;
    Grasp grasp;
    grasp.cup_m = cup_m, grasp.out = out;
    // The gripper stays beside the arm of the cup, not below it.
    grasp.jaws = std::abs(out.z()) > 0.5 ? Vec3(Vec3::UnitY()) : Vec3(Vec3::UnitZ());
    grasp.tip = view.in_world(place, *height);
    grasp.score = -(place - view.middle()).norm();
    result.push_back(grasp);
  }
  std::stable_sort(result.begin(), result.end(),
                   [](const Grasp& a, const Grasp& b) { return a.score > b.score; });
  return result;
}

std::optional<Grasp> GraspSearch::by_cup(const Removing& removing, double cup_m) {
  if (meets_support(removing)) {
    reason_ = kMeetsSupport;
    return std::nullopt;
  }
  std::string met;
  for (const Vec3& out : sides_of(removing.direction)) {
    if (out.z() < 0.5 && std::abs(out.z()) > kParallel) continue;
    for (const Grasp& one : cup_places(removing.held, out, cup_m)) {
      const std::string obstacle = obstacle_on_the_way(one, removing);
      if (obstacle.empty()) return one;
      if (met.empty()) met = obstacle;
    }
  }
  reason_ = met.empty() ? "no place on it is even enough for a cup of " + millimetres(cup_m)
                        : "the cup meets " + met;
  return std::nullopt;
}

}  // namespace takt::product
