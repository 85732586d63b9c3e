// Surface contact finds its near pairs by a broad phase and makes contacts for those alone: the same near pairs and the
// same bits as going through all pairs, whatever moves, spins or sleeps.
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "server/contact/surface/contact_interaction.h"
#include "tests/support/contact_pairs.h"
#include "tests/support/effort.h"
#include "tests/support/random_shapes.h"

namespace takt {
namespace {

using test::Random;

constexpr double kNearStep_s = 0.004;

/// Boxes of two sizes, one that is large, and a Ground, in a random place each.
class RandomHeap {
 public:
  RandomHeap(unsigned seed, int parts) : random_(seed) {
    const auto small = test::surface(test::lattice_box({0.03, 0.03, 0.03}, std::array<int, 3>{2, 2, 2}));
    const auto flat =
        test::surface(test::moved(test::lattice_box({0.05, 0.04, 0.02}, std::array<int, 3>{2, 2, 1}),
                                  {Mat3::Identity(), Vec3(0.04, 0.0, 0.01)}));
    const auto large = test::surface(test::lattice_box({0.3, 0.3, 0.04}, std::array<int, 3>{4, 4, 1}));
    ContactParameters sticking;
    sticking.friction_law = FrictionLaw::stick;
    std::vector<std::int32_t> classes;
    for (int c = 0; c < parts; ++c) {
      Component component;
      component.type = c == 0 ? ComponentType::ground : ComponentType::part;
      components_.push_back(component);
      model_.surfaces.push_back(c <= 1 ? large : c % 3 == 0 ? flat : small);
      classes.push_back(c % 2);
    }
    const ContactPairKind one{contact_law({})}, two{contact_law(sticking)};
    model_.pairs = ContactPairs(classes, {one, two, two, one}, 2);
    for (int a = 0; a < parts; ++a)
      for (int b = 0; b < parts; ++b)
        if (a < b ? (a + b) % 5 != 0 : (a + b) % 5 == 0 && a != b) model_.pairs.add(a, b);
    model_.enabled = true;
    asleep_.assign(components_.size(), 0);
    motion_.bodies.resize(components_.size());
    for (std::size_t c = 0; c < components_.size(); ++c) put(c);
  }

  /// Some move on, a few jump, and speeds change.
  void move() {
    for (std::size_t c = 1; c < components_.size(); ++c) {
      if (asleep_[c] != 0) continue;
      BodyMotion& body = motion_.bodies[c];
      if (random_.integer(0, 19) == 0) put(c);
      body.X_WB.p += 0.002 * random_.direction();
      body.V_WB = {random_.direction() * random_.log_uniform(1e-3, 30.0),
                   random_.direction() * random_.log_uniform(1e-3, 300.0)};
      body.p_WBcm = body.X_WB.p;
    }
  }
  void choose_asleep() {
    for (std::size_t c = 1; c < components_.size(); ++c) {
      asleep_[c] = random_.integer(0, 2) > 0 ? 1 : 0;
      if (asleep_[c] != 0) motion_.bodies[c].V_WB = {};
    }
  }

  bool acts(int a, int b) const { return (3 * a + 3 * b) % 7 != 0; }
  bool immobile(int c) const {
    return asleep_[static_cast<std::size_t>(c)] != 0 ||
           components_[static_cast<std::size_t>(c)].type == ComponentType::ground;
  }

  /// By the definition.
  std::vector<std::size_t> near() const {
    std::vector<std::size_t> result;
    for (std::size_t i = 0; i < model_.pairs.size(); ++i) {
      const ContactPairModel pair = model_.pairs[i];
      if (!acts(pair.base, pair.target) || (immobile(pair.base) && immobile(pair.target))) continue;
      const auto b = static_cast<std::size_t>(pair.base), t = static_cast<std::size_t>(pair.target);
      const BodyMotion &base = motion_.bodies[b], &target = motion_.bodies[t];
      const Aabb& bounds = model_.surfaces[b]->bounds_B();
      const double radius_m = bounds.lower.cwiseAbs().cwiseMax(bounds.upper.cwiseAbs()).norm();
      const double speed = (base.V_WB.v - target.V_WB.at(base.X_WB.p - target.X_WB.p)).norm() +
                           (base.V_WB.w - target.V_WB.w).norm() * radius_m;
      const Aabb x = box(b), y = box(t);
      const double gap_m = (x.lower - y.upper).cwiseMax(y.lower - x.upper).maxCoeff();
      if (!(gap_m > kNearStep_s * std::max(10.0, 2.0 * speed))) result.push_back(i);
    }
    return result;
  }

  /// With a new contact for each of all pairs.
  std::vector<Wrench> wrenches() const {
    std::vector<Wrench> sums(components_.size());
    for (const ContactPairModel& pair : model_.pairs) {
      if (!acts(pair.base, pair.target)) continue;
      const auto b = static_cast<std::size_t>(pair.base), t = static_cast<std::size_t>(pair.target);
      const BodyMotion &base = motion_.bodies[b], &target = motion_.bodies[t];
      PolygonalContact contact(model_.surfaces[b], model_.surfaces[t], pair.law);
      ContactResult result;
      contact.evaluate(relative_motion(base.X_WB, base.V_WB, target.X_WB, target.V_WB), result);
      if (result.elements == 0) continue;
      const Vec3 f = target.X_WB.R * result.F_B_T.f, m = target.X_WB.R * result.F_B_T.t;
      const auto add = [&](std::size_t c, double sign) {
        const Vec3 arm = target.X_WB.p - motion_.bodies[c].p_WBcm;
        sums[c] += {sign * f, sign * (m + arm.cross(f))};
      };
      add(b, 1.0);
      add(t, -1.0);
    }
    return sums;
  }

  const std::vector<Component>& components() const { return components_; }
  const ContactModel& model() const { return model_; }
  const CellMotion& motion() const { return motion_; }
  const std::vector<char>& asleep() const { return asleep_; }

 private:
  void put(std::size_t c) {
    BodyMotion& body = motion_.bodies[c];
    const double reach = 0.2;
    body.X_WB = {random_.rotation(), Vec3(random_.uniform(-reach, reach), random_.uniform(-reach, reach),
                                          random_.uniform(-0.2 * reach, 0.2 * reach))};
    body.p_WBcm = body.X_WB.p;
  }
  Aabb box(std::size_t c) const {
    const Aabb& box_B = model_.surfaces[c]->bounds_B();
    return BodyBox{0.5 * (box_B.lower + box_B.upper), 0.5 * (box_B.upper - box_B.lower)}.at(
        motion_.bodies[c].X_WB, 0.0);
  }

  Random random_;
  std::vector<Component> components_;
  ContactModel model_;
  CellMotion motion_;
  std::vector<char> asleep_;
};

TEST(NearPairs, AreThoseOfTheDefinitionAndPressWithTheBitsOfAllPairs) {
  std::size_t found = 0, left_out = 0, pressing = 0;
  for (unsigned seed = 1; seed <= 4 * test::effort(); ++seed) {
    RandomHeap heap(seed, 40);
    ContactInteraction contacts(heap.components(), heap.model());
    contacts.set_acting([&heap](int a, int b) { return heap.acts(a, b); });
    for (int step = 0; step < 25; ++step) {
      if (step % 5 == 4) {
        heap.choose_asleep();
        contacts.set_asleep(heap.asleep());
      }
      heap.move();
      contacts.update(heap.motion(), kNearStep_s);
      std::vector<std::size_t> moving;
      for (const PairContact* pair : contacts.moving()) moving.push_back(pair->number);
      ASSERT_EQ(moving, heap.near()) << "seed " << seed << ", step " << step;
      found += moving.size();
      left_out += heap.model().pairs.size() - moving.size();
      std::vector<Wrench> wrenches(heap.components().size());
      contacts.evaluate(heap.motion(), wrenches);
      const std::vector<Wrench> expected = heap.wrenches();
      for (std::size_t c = 0; c < wrenches.size(); ++c) {
        ASSERT_EQ(wrenches[c].f, expected[c].f) << "seed " << seed << ", step " << step << ", " << c;
        ASSERT_EQ(wrenches[c].t, expected[c].t) << "seed " << seed << ", step " << step << ", " << c;
        pressing += expected[c].f.norm() > 0.0 ? 1 : 0;
      }
    }
  }
  EXPECT_GT(found, 1000U);
  EXPECT_GT(left_out, 1000U);
  EXPECT_GT(pressing, 100U);
}

}  // namespace
}  // namespace takt
