#pragma once
// Pairs of shapes that are hard for collision libraries, each with the geometric verdict in closed form.
// Lengths in m.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "server/geometry/convex/convex_shape.h"

namespace takt::test {

struct DegenerateCase {
  std::string name;
  std::vector<Vec3> a, b;
  Pose X_WA, X_WB;
  double margin = 0.0;
  enum class Expected { apart, touching, refused } expected = Expected::apart;
};

class DegenerateCases {
 public:
  using Expected = DegenerateCase::Expected;
  using Points = std::vector<Vec3>;

  DegenerateCases() {
    faces_edges_vertices();
    size_ratios();
    far_from_origin();
    nearly_parallel();
    contained();
    identical();
    without_volume();
    needles_and_plates();
    repeated_points();
    many_vertices();
    not_finite();
  }
  const std::vector<DegenerateCase>& all() const { return cases_; }

  static Points box(double x, double y, double z) {
    Points points;
    for (int i = 0; i < 8; ++i) points.emplace_back((i & 1) ? x : -x, (i & 2) ? y : -y, (i & 4) ? z : -z);
    return points;
  }
  static Points box(double h) { return box(h, h, h); }

 private:
  static Mat3 turned(double angle, const Vec3& axis) {
    return Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix();
  }
  static std::string text(double value) {
    char buffer[32];
    std::snprintf(buffer, sizeof(buffer), "%g", value);
    return buffer;
  }
  /// Frames in which each situation is tested.
  static std::vector<std::pair<std::string, Pose>> frames() {
    return {{"as it is", Pose{}}, {"turned", Pose{turned(0.7, {1.0, 2.0, -3.0}), Vec3(0.3, -0.2, 0.1)}}};
  }
  void add(const std::string& name, const Points& a, const Pose& X_WA, const Points& b, const Pose& X_WB,
           double margin, Expected expected) {
    cases_.push_back({name, a, b, X_WA, X_WB, margin, expected});
  }
  /// B is moved along z so that the gap between the highest point of A and the lowest of B is -gap, 0, gap;
  /// thin shapes overlap by half their thickness.
  void add_gaps(const std::string& name, const Points& a, const Points& b, const Pose& X_AB, double gap,
                const Pose& X_WA) {
    double top = -1e300, bottom = 1e300, a_low = 1e300, b_high = -1e300;
    for (const Vec3& p : a) top = std::max(top, p.z()), a_low = std::min(a_low, p.z());
    for (const Vec3& p : b) {
      const double z = (X_AB.R * p).z();
      bottom = std::min(bottom, z), b_high = std::max(b_high, z);
    }
    const double depth = std::min(gap, 0.5 * (top - a_low) + 0.5 * (b_high - bottom));
    for (const auto& [what, g] : {std::pair{"overlapping", -depth}, {"touching", 0.0}, {"apart", gap}}) {
      Pose moved = X_AB;
      moved.p.z() = top - bottom + g;
      add(name + ", " + what, a, X_WA, b, X_WA * moved, 0.0, g > 0.0 ? Expected::apart : Expected::touching);
    }
  }

  void faces_edges_vertices() {
    const Mat3 edge_down = turned(0.25 * M_PI, Vec3::UnitX());
    const Mat3 corner_down = turned(std::atan(std::sqrt(2.0)), {1.0, -1.0, 0.0});
    for (const double s : {1e-6, 1e-3, 1.0, 1e3}) {
      const std::string size = " of " + text(s) + " m";
      const Points cube = box(s);
      Points roof = cube;  // the cube with its lower edge downwards, as points, so that A can have it too
      for (Vec3& p : roof) p = turned(0.25 * M_PI, Vec3::UnitY()) * p;
      const double gap = 1e-6 * s;
      const Pose X_WA{turned(0.3, {1, 1, 0}), Vec3(s, -2.0 * s, 0.5 * s)};
      add_gaps("face on face" + size, cube, cube, {Mat3::Identity(), {0.3 * s, -0.2 * s, 0}}, gap, X_WA);
      add_gaps("face on equal face" + size, cube, cube, {}, gap, X_WA);
      add_gaps("faces sharing an edge" + size, cube, cube, {Mat3::Identity(), {2.0 * s, 0, 0}}, gap, Pose{});
      add_gaps("faces sharing a vertex" + size, cube, cube, {Mat3::Identity(), {2.0 * s, 2.0 * s, 0}}, gap,
               Pose{});
      add_gaps("edge on face" + size, cube, cube, {edge_down, Vec3::Zero()}, gap, X_WA);
      add_gaps("vertex on face" + size, cube, cube, {corner_down, Vec3::Zero()}, gap, X_WA);
      add_gaps("edge across edge" + size, roof, cube, {edge_down, Vec3::Zero()}, gap, X_WA);
      add_gaps("edge along edge" + size, roof, roof, {}, gap, X_WA);
    }
  }
  void size_ratios() {
    for (const auto& [small, large] :
         {std::pair{1e-6, 1.0}, {1e-6, 1e3}, {1e-3, 1e3}, {1.0, 1e3}, {1e-6, 1e-3}})
      for (const auto& [name, X_WA] : frames())
        add_gaps("cube of " + text(small) + " on cube of " + text(large) + ", " + name, box(large),
                 box(small), {Mat3::Identity(), {0.1 * large, -0.3 * large, 0.0}}, 1e-7 * large, X_WA);
  }
  void far_from_origin() {
    for (const Vec3& far : {Vec3(1e6, 0, 0), Vec3(-1e6, 1e6, 0), Vec3(1e6, -1e6, 1e6)}) {
      add_gaps("poses at " + text(far.norm()), box(0.5), box(0.5), {Mat3::Identity(), {0.2, 0.1, 0.0}}, 1e-6,
               {Mat3::Identity(), far});
      Points moved = box(0.5);  // the same with the points far from their frame's origin
      for (Vec3& p : moved) p += far;
      for (const double gap : {-1e-6, 1e-6})
        add("points at " + text(far.norm()) + (gap > 0.0 ? ", apart" : ", overlapping"), moved,
            {Mat3::Identity(), -far}, box(0.5), {Mat3::Identity(), {0.2, 0.1, 1.0 + gap}}, 0.0,
            gap > 0.0 ? Expected::apart : Expected::touching);
    }
    for (const double far : {1e9, 1e20, 1e150, 1e300})
      add("the other at " + text(far), box(0.5), {}, box(0.5), {Mat3::Identity(), {far, -far, far}}, 0.0,
          Expected::apart);
  }
  void nearly_parallel() {
    for (const double angle : {1e-15, 1e-12, 1e-9, 1e-6, 1e-3})
      for (const Vec3& axis : {Vec3(1, 0, 0), Vec3(1, 1, 0)})
        add_gaps("faces tilted by " + text(angle) + (axis.y() > 0.0 ? " to a vertex" : " to an edge"),
                 box(0.5), box(0.4), {turned(angle, axis), {0.05, 0.02, 0.0}}, 1e-7,
                 Pose{turned(0.4, {0, 1, 1}), {1, 2, 3}});
  }
  void contained() {
    for (const double s : {0.999, 0.5, 1e-3, 1e-6, 1e-9})
      for (const Vec3& at :
           {Vec3(0, 0, 0), Vec3(0.3, -0.2, 0.1), Vec3(1.0 - s, 0, 0), Vec3(1.0 - s, 1.0 - s, 1.0 - s)})
        add("cube of " + text(s) + " inside a cube of 1 at " + text(at.norm()), box(1.0), {}, box(s),
            {Mat3::Identity(), s < 0.9 || at.x() < 0.01 ? at : Vec3::Zero()}, 0.0, Expected::touching);
  }
  std::vector<std::pair<std::string, Points>> kinds() const {
    return {{"point", {Vec3(0.1, 0.2, 0.3)}},
            {"segment", {{-0.5, 0, 0}, {0.5, 0, 0}}},
            {"triangle", {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}},
            {"square", {{-0.5, -0.5, 0}, {0.5, -0.5, 0}, {0.5, 0.5, 0}, {-0.5, 0.5, 0}}},
            {"tetrahedron", {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}},
            {"cube", box(0.5)},
            {"needle", box(0.5, 1e-9, 1e-9)},
            {"plate", box(0.5, 0.5, 1e-12)},
            {"ball", ball(200)}};
  }
  static Points ball(int count) {
    // A spiral, and the six points on the axes, so that extents along them are exactly 1.
    Points points{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
    for (int i = 0; i < count; ++i) {
      const double z = 1.0 - 2.0 * (i + 0.5) / count;
      const double angle = 2.399963229728653 * i;
      const double r = std::sqrt(1.0 - z * z);
      points.emplace_back(r * std::cos(angle), r * std::sin(angle), z);
    }
    return points;
  }
  void identical() {
    for (const auto& [kind, points] : kinds())
      for (const auto& [name, pose] : frames())
        add("a " + kind + " and itself, " + name, points, pose, points, pose, 0.0, Expected::touching);
  }
  void without_volume() {
    // In one plane, or above one another by as much as the margin, a little less, a little more.
    const Points point{{0.1, 0.1, 0}}, segment{{-0.5, 0.1, 0}, {0.5, 0.1, 0}},
        triangle{{-1, -1, 0}, {1, -1, 0}, {0, 1, 0}},
        square{{-0.5, -0.5, 0}, {0.5, -0.5, 0}, {0.5, 0.5, 0}, {-0.5, 0.5, 0}};
    const std::vector<std::pair<std::string, Points>> flat{
        {"point", point}, {"segment", segment}, {"triangle", triangle}, {"square", square}};
    for (std::size_t i = 0; i < flat.size(); ++i) {
      for (std::size_t k = i; k < flat.size(); ++k) {
        const std::string name = flat[i].first + " and " + flat[k].first;
        const Pose X_WA = frames()[1].second;
        add(name + " in one plane", flat[i].second, X_WA, flat[k].second, X_WA, 0.0, Expected::touching);
        for (const double margin : {0.0, 1e-3}) {
          for (const double slack : {-1e-6, 1e-6}) {
            if (margin + slack < 0.0) continue;
            add(name + " above one another by " + text(margin) +
                    (slack > 0.0 ? ", apart" : ", within the margin"),
                flat[i].second, X_WA, flat[k].second, X_WA * Pose{Mat3::Identity(), {0, 0, margin + slack}},
                margin, slack > 0.0 ? Expected::apart : Expected::touching);
          }
        }
      }
    }
    // Beside one another in one plane: no volume, and no common point.
    add("squares beside one another", square, {}, square, {Mat3::Identity(), {1.0 + 1e-6, 0, 0}}, 0.0,
        Expected::apart);
    add("squares sharing an edge", square, {}, square, {Mat3::Identity(), {1.0, 0, 0}}, 0.0,
        Expected::touching);
    add("segments in a row", segment, {}, segment, {Mat3::Identity(), {1.0 + 1e-6, 0, 0}}, 0.0,
        Expected::apart);
    add("segments end to end", segment, {}, segment, {Mat3::Identity(), {1.0, 0, 0}}, 0.0,
        Expected::touching);
    add("segments side by side", segment, {}, segment, {Mat3::Identity(), {0, 1e-6, 0}}, 0.0,
        Expected::apart);
  }
  void needles_and_plates() {
    for (const double thin : {1e-3, 1e-6, 1e-9, 1e-12}) {
      const double gap = 1e-7;
      const Points needle = box(1.0, thin, thin), plate = box(1.0, 1.0, thin);
      const Pose X_WA{turned(0.2, {3, 1, 2}), {0.1, 0.2, -0.4}};
      for (const double angle : {0.5 * M_PI, 1e-2})
        add_gaps("needles of " + text(thin) + " crossed by " + text(angle), needle, needle,
                 {turned(angle, Vec3::UnitZ()), {0.01, 0.0, 0.0}}, gap, X_WA);
      add_gaps("needle of " + text(thin) + " on plate", plate, needle,
               {turned(0.3, Vec3::UnitZ()), {0.1, 0.2, 0}}, gap, X_WA);
      add_gaps("plates of " + text(thin) + " stacked", plate, plate,
               {turned(0.3, Vec3::UnitZ()), {0.1, 0.2, 0}}, gap, X_WA);
      add_gaps("plate of " + text(thin) + " standing on a plate", plate, plate,
               {turned(0.5 * M_PI, Vec3::UnitX()), {0.1, 0.2, 0}}, gap, X_WA);
    }
  }
  void repeated_points() {
    Points many, inside = box(0.5), jittered, collinear = box(0.5);
    for (int k = 0; k < 10; ++k)
      for (const Vec3& p : box(0.5)) {
        many.push_back(p);
        jittered.push_back(p * (1.0 - 1e-16 * k));
      }
    for (int k = 0; k < 30; ++k) {
      inside.emplace_back(0.4 * std::sin(k), 0.4 * std::cos(2.0 * k), 0.4 * std::sin(3.0 * k));
      collinear.emplace_back(-0.5 + k / 29.0, 0.5, 0.5);
    }
    const Points coincident(20, Vec3(0.2, 0.1, 0.0));
    for (const auto& [name, points] : {std::pair{"every corner ten times", many},
                                       {"corners with jitter", jittered},
                                       {"points inside", inside},
                                       {"points on an edge", collinear}})
      add_gaps(name, points, points, {Mat3::Identity(), {0.1, 0.2, 0}}, 1e-6, frames()[1].second);
    add_gaps("coincident points on a cube", box(0.5), coincident, {}, 1e-6, frames()[1].second);
    add_gaps("coincident points on themselves", coincident, coincident, {}, 1e-6, {});
  }
  void many_vertices() {
    for (const int count : {100, 500, 2000}) {
      const std::string name = "balls of " + text(count) + " points";
      add_gaps(name, ball(count), ball(count), {}, 1e-7, frames()[1].second);
      add(name + " almost concentric", ball(count), {}, ball(count),
          {turned(1.0, {1, 2, 3}), {1e-13, -1e-14, 0}}, 0.0, Expected::touching);
    }
  }
  void not_finite() {
    const double nan = std::numeric_limits<double>::quiet_NaN(),
                 inf = std::numeric_limits<double>::infinity();
    for (const bool of_a : {true, false}) {
      for (const double bad : {nan, inf, -inf}) {
        for (int i = 0; i < 12; ++i) {
          Pose pose;
          (i < 3 ? pose.p[i] : pose.R(i / 3 - 1, i % 3)) = bad;
          add("pose of " + std::string(of_a ? "A" : "B") + " with " + text(bad) + " at " + std::to_string(i),
              box(0.5), of_a ? pose : Pose{}, i % 2 == 0 ? box(0.5) : ball(50), of_a ? Pose{} : pose, 1e-4,
              Expected::refused);
        }
      }
    }
    for (const double bad : {nan, inf, -1e-3})
      add("margin " + text(bad), box(0.5), {}, box(0.5), {}, bad, Expected::refused);
  }

  std::vector<DegenerateCase> cases_;
};

}  // namespace takt::test
