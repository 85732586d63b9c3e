// The monitor, which computes as few distances as possible, reports the same as a naive one that computes
// every pair in every step: random bodies in random motion, with pauses, grips and releases, and with pairs
// that start and end to act by surface contact.
#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <vector>

#include "server/contact/clearance/clearance_monitor.h"
#include "tests/support/random_shapes.h"

namespace takt {
namespace {

constexpr int kLinks = 3, kParts = 3, kGrounds = 2;
constexpr int kComponents = kParts + kGrounds + 2;  // and one gripper for each robot

ConvexShape random_hull(test::Random& random) {
  const Vec3 stretch(random.uniform(0.05, 0.4), random.uniform(0.05, 0.4), random.uniform(0.05, 0.4));
  return ConvexShape::from_points(random.points(stretch, random.integer(0, 1) == 0));
}

ClearanceModel random_model(test::Random& random) {
  ClearanceModel model;
  model.enabled = true;
  const auto body = [&](const char* name, int robot, int joint, int component, bool moves, bool is_part) {
    CheckedBody b{name, robot, joint, component, moves, is_part, {}};
    for (int i = random.integer(1, 3); i > 0; --i)
      b.shapes.push_back({random_hull(random), random.integer(0, 2) == 0 ? 0.03 : 0.0});
    model.bodies.push_back(b);
  };
  for (int r = 0; r < 2; ++r)
    for (int j = 0; j < kLinks; ++j) body("link", r, j, -1, true, false);
  body("base", 0, -1, -1, false, false);
  for (int c = 0; c < kParts; ++c) body("part", -1, -1, c, true, true);
  for (int c = 0; c < kGrounds; ++c) body("ground", -1, -1, kParts + c, false, false);
  for (int r = 0; r < 2; ++r) body("gripper", r, -1, kParts + kGrounds + r, true, false);
  for (int a = 0; a < static_cast<int>(model.bodies.size()); ++a) {
    for (int b = a + 1; b < static_cast<int>(model.bodies.size()); ++b) {
      const CheckedBody &x = model.bodies[static_cast<std::size_t>(a)],
                        &y = model.bodies[static_cast<std::size_t>(b)];
      if ((!x.moves && !y.moves) || (x.robot < 0 && y.robot < 0)) continue;
      model.pairs.push_back({a, b, random.integer(0, 1) == 0 ? 0.0 : random.uniform(0.005, 0.1)});
    }
  }
  return model;
}

/// Moves at a speed of its own for a while, then rests or takes another one.
struct Mover {
  Pose X;
  Vec3 v = Vec3::Zero(), axis = Vec3::UnitX();
  double turn = 0.0;
  int left = 0;

  void step(test::Random& random) {
    if (left-- <= 0) {
      const bool rests = random.integer(0, 3) == 0;
      v = rests ? Vec3::Zero() : Vec3(random.log_uniform(1e-5, 1e-2) * random.direction() - 3e-3 * X.p);
      axis = random.direction();
      turn = rests ? 0.0 : random.log_uniform(1e-5, 2e-2);
      left = random.integer(5, 60);
    }
    X.p += v;
    X.R = Quat(Eigen::AngleAxisd(turn, axis).toRotationMatrix() * X.R).normalized().toRotationMatrix();
  }
};

/// Follows the rules in the header, without optimisations.
class NaiveMonitor {
 public:
  explicit NaiveMonitor(const ClearanceModel& model)
      : model_(model), states_(model.pairs.size()), holder_(kComponents, -1) {}

  std::vector<CollisionEvent> update(double t, std::uint64_t step, const CellMotion& motion,
                                     const std::vector<PartnerChange>& changes) {
    std::vector<CollisionEvent> events;
    for (const PartnerChange& change : changes)
      holder_[static_cast<std::size_t>(change.part)] = change.to < 0 ? -1 : change.to - kParts - kGrounds;
    for (std::size_t i = 0; i < states_.size(); ++i) {
      const CheckedPair& pair = model_.pairs[i];
      State& s = states_[i];
      const auto tell = [&](CollisionEvent::Kind kind, double d, double duration) {
        events.push_back({kind, t, step, pair.a, pair.b, pair.limit_m, d, duration, Vec3::Zero()});
      };
      const auto clear = [&] {
        tell(CollisionEvent::Kind::clearance_restored, s.least, t - s.since);
        s = {};
      };
      if (presses(pair) || held(pair.a, pair.b) || held(pair.b, pair.a)) {
        if (s.open) clear();
        continue;
      }
      const double d = distance(pair, motion);
      const bool overlaps = d < -ClearanceMonitor::kTouching_m;
      if (s.open) {
        s.least = std::min(s.least, d);
      } else if (overlaps || d < pair.limit_m) {
        s = {true, false, d, t};
        if (!overlaps) tell(CollisionEvent::Kind::clearance, d, 0.0);
      }
      if (!s.open) continue;
      if (overlaps && !s.overlapping) tell(CollisionEvent::Kind::collision, d, 0.0);
      s.overlapping = overlaps || (s.overlapping && d <= model_.hysteresis_m);
      if (d > pair.limit_m + model_.hysteresis_m) clear();
    }
    return events;
  }

  std::vector<std::pair<int, int>> by_contact;  ///< components

 private:
  /// One of the two is a Part, and they act by surface contact.
  bool presses(const CheckedPair& pair) const {
    const CheckedBody &a = body(pair.a), &b = body(pair.b);
    if (!a.is_part && !b.is_part) return false;
    for (const auto& [x, y] : by_contact)
      if ((a.component == x && b.component == y) || (a.component == y && b.component == x)) return true;
    return false;
  }
  struct State {
    bool open = false, overlapping = false;
    double least = 0.0, since = 0.0;
  };
  const CheckedBody& body(int i) const { return model_.bodies[static_cast<std::size_t>(i)]; }
  bool held(int part, int other) const {
    return body(part).is_part && body(other).robot >= 0 &&
           holder_[static_cast<std::size_t>(body(part).component)] == body(other).robot;
  }
  Pose pose(int i, const CellMotion& motion) const {
    const CheckedBody& b = body(i);
    if (b.component >= 0) return motion.bodies[static_cast<std::size_t>(b.component)].X_WB;
    const Pose& X_WR = motion.arms[static_cast<std::size_t>(b.robot)].base.X_WR;
    if (b.joint < 0) return X_WR;
    return X_WR *
           motion.arms[static_cast<std::size_t>(b.robot)].poses.link[static_cast<std::size_t>(b.joint)];
  }
  double distance(const CheckedPair& pair, const CellMotion& motion) const {
    double least = 1e9;
    for (const RoundedShape& a : body(pair.a).shapes)
      for (const RoundedShape& b : body(pair.b).shapes)
        least = std::min(
            least, convex_distance(a.core, pose(pair.a, motion), b.core, pose(pair.b, motion)).distance -
                       a.radius_m - b.radius_m);
    return least;
  }
  const ClearanceModel& model_;
  std::vector<State> states_;
  std::vector<int> holder_;
};

TEST(ClearanceMonitorProperty, TheMonitorReportsTheSameAsAQueryInEveryStep) {
  std::size_t reported[3] = {0, 0, 0};
  std::uint64_t asked = 0, always = 0;
  for (unsigned seed = 1; seed <= 6; ++seed) {
    test::Random random(seed);
    const ClearanceModel model = random_model(random);
    const bool rides = seed % 2 == 0;  // the second robot, on a Ground that moves
    const Pose first{random.rotation(), Vec3(-0.3, 0, 0)};
    Mover second;
    second.X = {random.rotation(), Vec3(0.3, 0, 0)};
    std::vector<std::optional<Pose>> bases{first, second.X};
    if (rides) bases[1].reset();
    ClearanceMonitor monitor(model, bases, kComponents), eager(model, bases, kComponents, true);
    NaiveMonitor naive(model);
    CellMotion motion;
    motion.bodies.resize(kComponents);
    motion.arms.resize(2);
    motion.arms[0].base.X_WR = first;
    std::vector<Mover> movers(2 * kLinks + kComponents);
    for (Mover& mover : movers) mover.X = {random.rotation(), 0.8 * random.direction()};
    std::vector<int> all;
    for (int c = 0; c < kComponents; ++c) all.push_back(c);
    for (std::uint64_t step = 0; step < 1500; ++step) {
      if (rides) second.step(random);
      motion.arms[1].base.X_WR = second.X;
      for (std::size_t i = 0; i < movers.size(); ++i) {
        const bool ground = i >= 2 * kLinks + kParts && i < 2 * kLinks + kParts + kGrounds;
        if (step > 0 && !ground) movers[i].step(random);
        if (i < 2 * kLinks)
          motion.arms[i / kLinks].poses.link[i % kLinks] = movers[i].X;
        else
          motion.bodies[i - 2 * kLinks].X_WB = movers[i].X;
      }
      std::vector<PartnerChange> changes;
      if (random.integer(0, 40) == 0)
        changes.push_back({random.integer(0, kParts - 1), -1, random.integer(-1, 1)});
      for (PartnerChange& change : changes)
        if (change.to >= 0) change.to += kParts + kGrounds;
      if (random.integer(0, 100) == 0) {
        naive.by_contact.clear();
        for (int c = 0; c < kComponents; ++c)
          for (int d = 0; d < kComponents; ++d)
            if (c != d && random.integer(0, 3) == 0) naive.by_contact.emplace_back(c, d);
        const auto acts = [&naive](int x, int y) {
          return std::any_of(naive.by_contact.begin(), naive.by_contact.end(), [&](const auto& pair) {
            return std::minmax(pair.first, pair.second) == std::minmax(x, y);
          });
        };
        monitor.set_by_contact(acts);
        eager.set_by_contact(acts);
      }
      const double t = 0.001 * static_cast<double>(step);
      monitor.update(t, step, motion, all, changes);
      eager.update(t, step, motion, all, changes);
      const auto expected = naive.update(t, step, motion, changes);
      ASSERT_EQ(monitor.events().size(), expected.size()) << "seed " << seed << " step " << step;
      ASSERT_EQ(eager.events().size(), expected.size()) << "seed " << seed << " step " << step;
      for (std::size_t i = 0; i < expected.size(); ++i) {
        const CollisionEvent &seldom = monitor.events()[i], &often = eager.events()[i];
        EXPECT_EQ(seldom.kind, expected[i].kind);
        EXPECT_EQ(seldom.a, expected[i].a);
        EXPECT_EQ(seldom.b, expected[i].b);
        EXPECT_NEAR(seldom.distance_m, expected[i].distance_m, 1e-12);
        EXPECT_NEAR(seldom.duration_s, expected[i].duration_s, 1e-12);
        EXPECT_EQ(seldom.distance_m, often.distance_m);
        EXPECT_EQ(seldom.p_W, often.p_W);
        ++reported[static_cast<int>(seldom.kind)];
      }
    }
    asked += monitor.counts().pairs_asked;
    always += eager.counts().pairs_asked;
  }
  EXPECT_GT(reported[0], 100U);
  EXPECT_GT(reported[1], 100U);
  EXPECT_GT(reported[2], 100U);
  EXPECT_LT(asked, always / 2) << "nothing was saved";
}

}  // namespace
}  // namespace takt
