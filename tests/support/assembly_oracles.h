#pragma once
// Invariants of a random cell under any handling, checked from snapshots alone: partners against brute force,
// held Parts against the bound of a critically damped spring, falling ones against the parabola. The checks
// use fatal assertions of GoogleTest: the caller asks HasFatalFailure().
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>
#include <utility>
#include <vector>

#include "tests/support/constants.h"
#include "tests/support/grip_oracle.h"
#include "tests/support/random_assembly.h"

namespace takt::test {

inline constexpr double kStep_s = 0.001;
inline constexpr double kPole = 313.158;    // sqrt(g / 0.1 mm), 1/s: the double pole of every connection
inline constexpr double kUnclear_m = 1e-7;  // pairs so near the margin may be either
inline constexpr double kListingLimit = 20000.0;  // sequences per Part up to which all are listed
inline constexpr double kEuler = 2.718281828459;

inline Vec3 center_of_mass(const CellModel& model, const Snapshot& s, int id) {
  const ComponentSample& c = s.components[static_cast<std::size_t>(id)];
  return c.p_WB + c.q_WB * model.components[static_cast<std::size_t>(id)].p_BBcm;
}
inline Vec3 velocity_at(const Snapshot& s, int id, const Vec3& p_W) {
  const ComponentSample& c = s.components[static_cast<std::size_t>(id)];
  return c.V_WB.at(p_W - c.p_WB);
}

/// Partners by brute force, each time the simulation decides them.
class PartnerOracle {
 public:
  explicit PartnerOracle(const RandomCell& cell)
      : cell_(cell), model_(*cell.model()), grips_(cell, kUnclear_m) {}

  /// Every step, before check().
  void follow(const Snapshot& before, const Snapshot& after) { grips_.follow(before, after); }

  /// `before`: the poses on which the step from it to `after` decided.
  void check(const Snapshot& before, const Snapshot& after) {
    std::vector<std::pair<int, int>> certain, unclear;
    overlaps(before, after, certain, unclear);
    if (certain != contacts_ || !unclear.empty() || graphs_.empty()) {
      contacts_ = certain;
      graphs_.assign(1, graph(certain));
      all_ways_ = true;
      if (!unclear.empty()) {
        every_way(certain, unclear);
        contacts_.clear();
        ++unclear_steps;
      }
      counts_ = {};
      for (const ContactGraph& g : graphs_) counts_.push_back(count_sequences(g));
      answers_.clear();
    }
    for (const int part : cell_.parts) {
      const int found = after.components[static_cast<std::size_t>(part)].partner;
      const int present = before.components[static_cast<std::size_t>(part)].partner;
      bool right = false, listed = true;
      for (std::size_t i = 0; i < graphs_.size() && !right; ++i) {
        if (counts_[i][static_cast<std::size_t>(part)] > kListingLimit) {
          listed = false;
          continue;
        }
        const auto [entry, fresh] = answers_.try_emplace({i, part, present}, -1);
        if (fresh) entry->second = partner_by_listing(graphs_[i], part, present);
        right = entry->second == found;
      }
      listed = listed && (right || all_ways_);
      ++(listed ? answers : unlisted);
      if (listed) {
        ASSERT_TRUE(right) << "Part " << part << " has partner " << found << " (before: " << present
                           << ") at step " << before.step;
      }
    }
  }
  bool touched(int part) const {
    for (const ContactGraph& g : graphs_) {
      if (!g.neighbours[static_cast<std::size_t>(part)].empty()) return true;
    }
    return false;
  }

  std::uint64_t answers = 0, unlisted = 0, unclear_steps = 0;

 private:
  void overlaps(const Snapshot& before, const Snapshot& after, std::vector<std::pair<int, int>>& certain,
                std::vector<std::pair<int, int>>& unclear) const {
    std::vector<std::pair<int, OrientedBox>> others;
    for (const int id : cell_.parts) others.emplace_back(id, cell_.box(before, id));
    const std::size_t parts = others.size();
    for (const int id : cell_.grounds) others.emplace_back(id, cell_.box(before, id));
    for (std::size_t g = 0; g < cell_.palms.size(); ++g) {
      if (after.grippers[g].closed) others.emplace_back(cell_.palms[g], cell_.grasp_volume(before, g));
    }
    const auto gripper_of = [this](int id) {
      return std::find(cell_.palms.begin(), cell_.palms.end(), id) - cell_.palms.begin();
    };
    for (std::size_t a = 0; a < parts; ++a) {
      for (std::size_t b = a + 1; b < others.size(); ++b) {
        const auto g = static_cast<std::size_t>(gripper_of(others[b].first));
        const bool grips = g < cell_.palms.size();
        const bool perhaps = grips && grips_.perhaps(g, others[a].first);
        if (grips && !perhaps && !grips_.surely(g, others[a].first)) continue;
        Nearness verdict =
            nearness(others[a].second, others[b].second, model_.interaction.contact_margin_m, kUnclear_m);
        if (perhaps && verdict == Nearness::touching) verdict = Nearness::unclear;
        if (verdict == Nearness::touching) certain.emplace_back(others[a].first, others[b].first);
        if (verdict == Nearness::unclear) unclear.emplace_back(others[a].first, others[b].first);
      }
    }
  }
  /// The graphs for each combination of unclear contacts; for many of them only none and all.
  void every_way(const std::vector<std::pair<int, int>>& certain,
                 const std::vector<std::pair<int, int>>& unclear) {
    constexpr std::size_t kMaxUnclear = 6;
    all_ways_ = unclear.size() <= kMaxUnclear;
    const std::size_t ways = all_ways_ ? std::size_t{1} << unclear.size() : 2;
    for (std::size_t way = 1; way < ways; ++way) {
      std::vector<std::pair<int, int>> touching = certain;
      for (std::size_t i = 0; i < unclear.size(); ++i)
        if (!all_ways_ || (way >> i & 1U) != 0) touching.push_back(unclear[i]);
      graphs_.push_back(graph(touching));
    }
  }
  ContactGraph graph(const std::vector<std::pair<int, int>>& pairs) const {
    ContactGraph g(model_.components.size());
    for (std::size_t i = 0; i < g.vertices.size(); ++i) {
      g.vertices[i] = {model_.components[i].type, model_.components[i].hierarchy};
    }
    for (const auto& [a, b] : pairs) g.add_contact(a, b);
    for (std::vector<int>& list : g.neighbours) std::sort(list.begin(), list.end());
    return g;
  }

  const RandomCell& cell_;
  const CellModel& model_;
  GripOracle grips_;
  std::vector<std::pair<int, int>> contacts_;
  std::vector<ContactGraph> graphs_;
  bool all_ways_ = true;  ///< graphs_ has every way in which the unclear pairs may touch
  std::vector<std::vector<double>> counts_;
  std::map<std::tuple<std::size_t, int, int>, int> answers_;
};

/// The place of a held Part relative to that at capture: no further off than a critically damped spring
/// allows for the speed at capture and the acceleration of its holder.
class HoldOracle {
 public:
  explicit HoldOracle(const RandomCell& cell)
      : cell_(cell), model_(*cell.model()), holds_(model_.components.size()) {}

  void check(const Snapshot& before, const Snapshot& after) {
    for (const int part : cell_.parts) {
      const int partner = after.components[static_cast<std::size_t>(part)].partner;
      Hold& hold = holds_[static_cast<std::size_t>(part)];
      if (partner < 0 || model_.components[static_cast<std::size_t>(partner)].type == ComponentType::part) {
        hold.partner = -1;
        continue;
      }
      const Vec3 p0 = center_of_mass(model_, before, part), p1 = center_of_mass(model_, after, part);
      const ComponentSample& t0 = before.components[static_cast<std::size_t>(partner)];
      const ComponentSample& t1 = after.components[static_cast<std::size_t>(partner)];
      const ComponentSample& b0 = before.components[static_cast<std::size_t>(part)];
      const ComponentSample& b1 = after.components[static_cast<std::size_t>(part)];
      if (hold.partner != partner) {
        hold = {};
        hold.partner = partner;
        hold.p_T = t0.q_WB.conjugate() * (p0 - t0.p_WB);
        hold.q_TB = t0.q_WB.conjugate() * b0.q_WB;
        hold.slip = (velocity_at(before, partner, p0) - velocity_at(before, part, p0)).norm();
        hold.turn = (t0.V_WB.w - b0.V_WB.w).norm();
        ++captures;
      }
      hold.acceleration =
          std::max(hold.acceleration,
                   (velocity_at(after, partner, p1) - velocity_at(before, partner, p0)).norm() / kStep_s);
      hold.spin = std::max(hold.spin, (t1.V_WB.w - t0.V_WB.w).norm() / kStep_s);
      // x'' + 2 w x' + w^2 x = a from x' = v: |x| <= v / (e w) + max |a| / w^2.
      const double allowed =
          1.1 * (hold.slip / (kEuler * kPole) + hold.acceleration / (kPole * kPole)) + 1e-7;
      const double allowed_angle = 1.1 * (hold.turn / (kEuler * kPole) + hold.spin / (kPole * kPole)) + 1e-6;
      const double off = (t1.q_WB * hold.p_T + t1.p_WB - p1).norm();
      const double angle = (t1.q_WB * hold.q_TB).angularDistance(b1.q_WB);
      worst = std::max(worst, off / allowed), worst_angle = std::max(worst_angle, angle / allowed_angle);
      ASSERT_LE(off, allowed) << "Part " << part << " in " << partner << " at step " << after.step
                              << ", caught at " << hold.slip << " m/s";
      ASSERT_LE(angle, allowed_angle) << "Part " << part << " in " << partner << " at step " << after.step
                                      << ", caught at " << hold.turn << " rad/s";
    }
  }

  double worst = 0.0, worst_angle = 0.0;
  std::uint64_t captures = 0;

 private:
  struct Hold {
    int partner = -1;
    Vec3 p_T = Vec3::Zero();
    Quat q_TB = Quat::Identity();
    double slip = 0.0, turn = 0.0, acceleration = 0.0, spin = 0.0;
  };
  const RandomCell& cell_;
  const CellModel& model_;
  std::vector<Hold> holds_;
};

/// A Part without holder and without held Parts falls on a parabola; a cube turns at a constant rate. An
/// assembly without holder falls with its centre of mass on a parabola.
class FallOracle {
 public:
  explicit FallOracle(const RandomCell& cell)
      : cell_(cell), model_(*cell.model()), falls_(model_.components.size()) {}

  void check(const Snapshot& before, const Snapshot& after) {
    std::map<int, std::vector<int>> loose;  // by root: the Parts of an assembly without holder
    for (const int part : cell_.parts) {
      const int partner = after.components[static_cast<std::size_t>(part)].partner;
      if (partner < 0) loose[part].push_back(part);
      if (partner >= 0 && model_.components[static_cast<std::size_t>(partner)].type == ComponentType::part) {
        loose[partner].push_back(part);
      }
    }
    for (const int part : cell_.parts) {
      const auto entry = loose.find(part);
      if (entry == loose.end() || entry->second.size() > 1) falls_[static_cast<std::size_t>(part)].steps = 0;
    }
    for (const auto& [root, assembly] : loose) {
      if (assembly.size() == 1) {
        check_part(root, before, after);
      } else {
        Vec3 change = Vec3::Zero();
        double mass = 0.0, speed = 0.0;
        for (const int part : assembly) {
          const double m = model_.components[static_cast<std::size_t>(part)].mass_kg;
          const Vec3 v0 = velocity_at(before, part, center_of_mass(model_, before, part));
          const Vec3 v1 = velocity_at(after, part, center_of_mass(model_, after, part));
          change += m * (v1 - v0), mass += m, speed = std::max(speed, v1.norm());
        }
        ASSERT_LE((change / mass + Vec3(0.0, 0.0, kGravity_m_s2 * kStep_s)).norm(), 1e-12 * (1.0 + speed))
            << "assembly of " << root << " at step " << after.step;
        ++assembly_steps;
        largest_assembly = std::max(largest_assembly, assembly.size());
      }
    }
  }

  std::uint64_t part_steps = 0, assembly_steps = 0;
  std::size_t largest_assembly = 0;

 private:
  struct Fall {
    std::uint64_t steps = 0;  ///< since it began
    Vec3 p, v, w;
    Quat q;
  };

  void check_part(int part, const Snapshot& before, const Snapshot& after) {
    Fall& fall = falls_[static_cast<std::size_t>(part)];
    const ComponentSample& b = before.components[static_cast<std::size_t>(part)];
    const ComponentSample& a = after.components[static_cast<std::size_t>(part)];
    if (fall.steps == 0) {
      fall.p = center_of_mass(model_, before, part);
      fall.v = velocity_at(before, part, fall.p);
      fall.w = b.V_WB.w, fall.q = b.q_WB;
    }
    ++fall.steps;
    ++part_steps;
    const double t = kStep_s * static_cast<double>(fall.steps);
    const Vec3 g(0.0, 0.0, -kGravity_m_s2);
    const Vec3 p = center_of_mass(model_, after, part);
    ASSERT_LE((p - (fall.p + t * fall.v + 0.5 * t * t * g)).norm(), 1e-11 * (1.0 + p.norm()))
        << "Part " << part;
    ASSERT_LE((velocity_at(after, part, p) - (fall.v + t * g)).norm(), 1e-11 * (1.0 + fall.v.norm()));
    const Vec3& size = cell_.size(part);
    if (size.x() != size.y() || size.x() != size.z()) return;
    ASSERT_LE((a.V_WB.w - fall.w).norm(), 1e-11 * (1.0 + fall.w.norm()));
    // Error of order two in a rotation: angle^3 / 12 per step.
    const double rate = fall.w.norm(), angle = rate * kStep_s;
    const Quat turned = rate > 0.0 ? Quat(Eigen::AngleAxisd(rate * t, fall.w / rate)) * fall.q : fall.q;
    ASSERT_LE(turned.angularDistance(a.q_WB),
              angle * angle * angle / 12.0 * static_cast<double>(fall.steps) + 1e-7);
  }

  const RandomCell& cell_;
  const CellModel& model_;
  std::vector<Fall> falls_;
};

}  // namespace takt::test
