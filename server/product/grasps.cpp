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

double area(const Polygon& polygon) {
  Vec3 sum = Vec3::Zero();
  for (std::size_t k = 2; k < polygon.size(); ++k)
    sum += (polygon[k - 1] - polygon[0]).cross(polygon[k] - polygon[0]);
  return 0.5 * sum.norm();
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

/// Directions in which the jaws can close on opposite faces, across `out`.
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
    if (across.norm() > 0.999) add(across);
    if (across.norm() > kParallel) continue;
    const Vec3 x = out.unitOrthogonal(), y = out.cross(x);
    for (int k = 0; k < 6; ++k) add(std::cos(k * M_PI / 6) * x + std::sin(k * M_PI / 6) * y);
  }
  return axes;
}

/// What lies between the fingers: its width, and how much of both pads rests on it.
std::optional<Grasp> GraspSearch::between(std::size_t held, const Vec3& out, const Vec3& jaws, double top,
                                          double depth, double at) {
  const GripperSize& g = gripper_;
  const Vec3 across = jaws.cross(-out);
  std::vector<std::pair<Polygon, double>> pieces;  // with the normal's part along the jaws
  double from = std::numeric_limits<double>::infinity(), to = -from;
  for (const Triangle& t : around_.now[held].triangles) {
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
  Grasp grasp{false, out, jaws, (top - depth) * out + 0.5 * (from + to) * jaws + at * across, width, 0.0};
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
  if (grasp.by_cup) {
    const double r = 0.5 * g.cup_diameter_m + kMargin_m;
    return {{axes, tip + Vec3(-r, -r, kMargin_m), tip + Vec3(r, r, 2.0 * g.finger_length_m + longer)}};
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
  const std::set<std::size_t> touched = grasp.by_cup ? std::set<std::size_t>{} : std::set{removing.held};
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
    reason_ = "it meets the support on its way out";
    return std::nullopt;
  }
  const Vec3& d = removing.direction;
  std::vector<Vec3> sides;
  if (d.z() > -0.5) sides.push_back(d);
  // The tray lies on the side of x.
  for (const Vec3& side : {Vec3(0, 0, 1), Vec3(-1, 0, 0), Vec3(0, 1, 0), Vec3(0, -1, 0), Vec3(1, 0, 0)})
    if (side.dot(d) > -kParallel && side.dot(d) < 0.999) sides.push_back(side);
  narrowest_m_ = 0.0;
  std::string met;
  for (const Vec3& out : sides) {
    const PlacedInstance& part = around_.now[removing.held];
    const Extent height = along(part, out);
    std::vector<Grasp> candidates;
    for (const Vec3& jaws : jaw_axes(removing.held, out)) {
      const Extent across = along(part, jaws.cross(-out));
      for (const double share : {1.0, 0.5, 0.25}) {
        const double depth = std::min(share * gripper_.finger_width_m, 0.8 * (height.to - height.from));
        for (const double u : {0.5, 0.25, 0.75, 0.12, 0.88})
          if (auto one = between(removing.held, out, jaws, height.to, depth,
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

std::optional<Grasp> GraspSearch::by_cup(const Removing& removing) {
  if (meets_support(removing)) return std::nullopt;
  const double radius = 0.5 * gripper_.cup_diameter_m;
  const Pose& moved = around_.moved[removing.held];
  const Aabb& box = around_.now[removing.held].box;
  const Vec3 middle = 0.5 * (box.lower + box.upper);
  std::vector<Grasp> candidates;
  for (const PlacedFace& face : around_.original[removing.held].faces) {
    if (face.face.kind != SurfaceKind::plane || (moved.R * face.face.axis_B).z() < 1.0 - 1e-9) continue;
    std::vector<Triangle> triangles;
    BoxBuilder area;
    for (const Triangle& t : face.triangles) {
      triangles.push_back({moved * t[0], moved * t[1], moved * t[2]});
      for (const Vec3& p : triangles.back()) area.add(p);
    }
    const auto seals = [&](double x, double y) {
      constexpr int kRim = 16;
      for (int k = 0; k <= 2 * kRim; ++k) {
        const double r = k == 0 ? 0.0 : k % 2 == 0 ? radius : 0.5 * radius, angle = M_PI * k / kRim;
        if (std::none_of(triangles.begin(), triangles.end(), [&](const Triangle& t) {
              return covers(t, x + r * std::cos(angle), y + r * std::sin(angle), 1.0);
            }))
          return false;
      }
      return true;
    };
    constexpr int kCells = 12;
    const Vec3 size = area.box.upper - area.box.lower;
    const auto add = [&](double x, double y) {
      if (!seals(x, y)) return;
      const Vec3 tip(x, y, area.box.upper.z());
      const double aside = std::hypot(x - middle.x(), y - middle.y());
      candidates.push_back({true, Vec3::UnitZ(), Vec3::UnitY(), tip, 0.0, -aside});
    };
    add(middle.x(), middle.y());
    for (int i = 1; i < kCells; ++i)
      for (int j = 1; j < kCells; ++j)
        add(area.box.lower.x() + size.x() * i / kCells, area.box.lower.y() + size.y() * j / kCells);
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Grasp& a, const Grasp& b) { return a.score > b.score; });
  std::string met;
  for (const Grasp& one : candidates) {
    const std::string obstacle = obstacle_on_the_way(one, removing);
    if (obstacle.empty()) return one;
    if (met.empty()) met = obstacle;
  }
  reason_ = met.empty() ? "no place on top of it is flat enough for a cup of " + millimetres(2.0 * radius)
                        : "on top of it the cup meets " + met;
  return std::nullopt;
}

}  // namespace takt::product
