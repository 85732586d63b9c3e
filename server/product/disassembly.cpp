#include "server/product/disassembly.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <tuple>

#include "idl/common/text.h"
#include "server/product/removal.h"
#include "server/product/support.h"

namespace takt::product {

namespace {

/// Undercuts that cover less of the shadow give way.
constexpr double kSnapShare = 0.2;
constexpr std::size_t kFirstDirections = 6;  ///< those of the world

class Planner {
 public:
  explicit Planner(Product& product)
      : product_(product),
        removal_(product),
        threads_(product.instances.size(), 0),
        neighbours_(product.instances.size()) {
    for (const Contact& contact : product.contacts)
      neighbours_[contact.first].insert(contact.second), neighbours_[contact.second].insert(contact.first);
    for (const Contact& contact : product.contacts)
      if (contact.kind == ContactKind::thread) ++threads_[contact.first], ++threads_[contact.second];
  }

  Disassembly plan() {
    std::set<std::size_t> all;
    for (std::size_t i = 0; i < product_.instances.size(); ++i) all.insert(i);
    result_.base = base_of(all);
    take_apart(all, result_.base);
    result_.order.push_back(result_.base);
    return std::move(result_);
  }

 private:
  double mass(std::size_t i) const { return removal_.placed()[i].mass_kg; }

  std::size_t heaviest(const std::set<std::size_t>& group) const {
    std::size_t best = *group.begin();
    for (const std::size_t i : group)
      if (mass(i) > mass(best)) best = i;
    return best;
  }

  /// Of those that are about the heaviest the lowest: it stands on the support.
  std::size_t base_of(const std::set<std::size_t>& all) const {
    constexpr double kAbout = 0.99;
    const auto lowest_m = [&](std::size_t i) { return removal_.placed()[i].box.lower.z(); };
    std::size_t best = heaviest(all);
    best = heaviest_that_stands(all, best);
    const double least_kg = kAbout * mass(best);
    for (const std::size_t i : all)
      if (mass(i) >= least_kg && lowest_m(i) < lowest_m(best)) best = i;
    return best;
  }

  /// Neither plate nor post can be under the heaviest where others are below it.
  std::size_t heaviest_that_stands(const std::set<std::size_t>& all, std::size_t heaviest) const {
    constexpr double kLeastShare = 0.25;
    std::vector<std::size_t> heavy;
    for (const std::size_t i : all)
      if (mass(i) >= kLeastShare * mass(heaviest)) heavy.push_back(i);
    std::stable_sort(heavy.begin(), heavy.end(),
                     [&](std::size_t a, std::size_t b) { return mass(a) > mass(b); });
    const auto stands = std::find_if(heavy.begin(), heavy.end(),
                                     [&](std::size_t i) { return can_stand(removal_.placed(), i); });
    return stands != heavy.end() ? *stands : heaviest;
  }

  /// Takes all but the base out of `group`.
  void take_apart(std::set<std::size_t> group, std::size_t base) {
    while (group.size() > 1) {
      std::optional<RemovalStep> step = next(group, base, false);
      if (!step) step = next(group, base, true);
      if (!step) {
        result_.stuck.emplace_back(group.begin(), group.end());
        const std::vector<std::size_t> inwards = from_outside(group, base);
        result_.order.insert(result_.order.end(), inwards.begin(), inwards.end());
        return;
      }
      std::set<std::size_t> leaving(step->parts.begin(), step->parts.end());
      for (const std::size_t i : leaving) group.erase(i);
      result_.steps.push_back(std::move(*step));
      if (leaving.size() > 1) {
        const std::size_t own_base = heaviest(leaving);
        take_apart(leaving, own_base);
        result_.order.push_back(own_base);
      } else {
        result_.order.push_back(*leaving.begin());
      }
    }
  }

  /// The group but for the base, those with the most parts between them and the base first: each touches one that
  /// follows, or the base.
  std::vector<std::size_t> from_outside(const std::set<std::size_t>& group, std::size_t base) const {
    std::vector<std::size_t> outwards{base};
    std::set<std::size_t> waiting = group;
    waiting.erase(base);
    for (std::size_t k = 0; k < outwards.size(); ++k)
      for (const std::size_t i : neighbours_[outwards[k]])
        if (waiting.erase(i) > 0) outwards.push_back(i);
    outwards.insert(outwards.end(), waiting.begin(), waiting.end());  // without a path to the base
    return {outwards.rbegin(), outwards.rend() - 1};
  }

  /// What leaves along `d` if `first` does: those that block it leave as well, and those that it alone joins to the base
  /// where they can. None if the base would have to, or all.
  std::optional<std::set<std::size_t>> leaving(std::size_t first, std::size_t d,
                                               const std::set<std::size_t>& group, std::size_t base,
                                               std::size_t most) {
    std::set<std::size_t> moving{first};
    if (!add_blocking(moving, {first}, d, group, base, most)) return std::nullopt;
    if (threads_[first] > 0) return moving;  // a nut leaves its bolt, which may have play in all other holes
    for (std::set<std::size_t> all = moving;;) {
      const std::vector<std::size_t>& alone = left_alone(all, group, base);
      if (alone.empty()) return all;
      all.insert(alone.begin(), alone.end());
      if (all.size() > most || !add_blocking(all, alone, d, group, base, most)) return moving;
    }
  }

  /// Adds what blocks the motion of `waiting`. False if the base does, or more than `most` would move.
  bool add_blocking(std::set<std::size_t>& moving, std::vector<std::size_t> waiting, std::size_t d,
                    const std::set<std::size_t>& group, std::size_t base, std::size_t most) {
    while (!waiting.empty()) {
      const std::size_t a = waiting.back();
      waiting.pop_back();
      for (const std::size_t b : group) {
        if (moving.contains(b) || !removal_.blocked(a, d, b)) continue;
        if (b == base || moving.size() >= most) return false;
        moving.insert(b);
        waiting.push_back(b);
      }
    }
    return true;
  }

  std::optional<RemovalStep> next(const std::set<std::size_t>& group, std::size_t base, bool unsnap) {
    struct Choice {
      std::tuple<double, std::size_t, std::size_t, int, int, int, double, std::size_t> rank;
      std::set<std::size_t> parts;
      std::size_t direction;
    };
    std::optional<Choice> best;
    std::map<std::set<std::size_t>, std::size_t> dropped_by;
    left_alone_.clear();
    for (const bool far : {false, true}) {
      for (const std::size_t i : group) {
        if (i == base) continue;
        for (std::size_t d = 0; d < removal_.directions().size(); ++d) {
          if (far != is_diagonal(i, d)) continue;
          const std::size_t most = best ? best->parts.size() : group.size() / 2 + 1;
          std::optional<std::set<std::size_t>> parts;
          double undercut_m2 = 0.0;
          if (!unsnap) {
            parts = leaving(i, d, group, base, most);
          } else if (const auto area_m2 = undercut(i, d, group)) {
            parts = std::set<std::size_t>{i};
            undercut_m2 = *area_m2;
          }
          if (!parts) continue;
          double weight = 0.0;
          int fasteners = 0;
          for (const std::size_t p : *parts)
            weight += mass(p), fasteners = std::max(fasteners, threads_[p] > 0 ? 1 : 0);
          const Vec3& direction = removal_.directions()[d];
          const int upwards = direction.z() > 0.999 ? 0 : direction.z() < -0.999 ? 2 : 1;
          const auto [known, is_new] = dropped_by.try_emplace(*parts);
          if (is_new) known->second = dropped(*parts, group, base);
          Choice choice{{undercut_m2, parts->size(), known->second, -fasteners,
                         slides(*parts, direction) ? 1 : 0, upwards, weight, i},
                        *parts,
                        d};
          if (!best || choice.rank < best->rank) best = std::move(choice);
        }
      }
      if (best) break;
    }
    if (!best) return std::nullopt;
    RemovalStep step;
    step.parts.assign(best->parts.begin(), best->parts.end());
    step.direction_W = removal_.directions()[best->direction];
    describe(step, best->parts, group, unsnap);
    return step;
  }

  /// How many of the parts that stay would fall: only those that leave hold them against gravity, or join them to the base.
  std::size_t dropped(const std::set<std::size_t>& parts, const std::set<std::size_t>& group,
                      std::size_t base) {
    std::set<std::size_t> held, left;
    for (const Contact& contact : product_.contacts) {
      if (!group.contains(contact.first) || !group.contains(contact.second)) continue;
      const bool stays = !parts.contains(contact.first) && !parts.contains(contact.second);
      for (const bool first : {true, false}) {
        const std::size_t part = first ? contact.first : contact.second;
        if (part == base || parts.contains(part) || !carries(contact, first)) continue;
        held.insert(part);
        if (stays) left.insert(part);
      }
    }
    std::set<std::size_t> fallen;
    std::set_difference(held.begin(), held.end(), left.begin(), left.end(),
                        std::inserter(fallen, fallen.end()));
    const std::vector<std::size_t>& alone = left_alone(parts, group, base);
    fallen.insert(alone.begin(), alone.end());
    return fallen.size();
  }

  /// Those that no contact joins to the base where these parts have left the group. Kept until the next step.
  const std::vector<std::size_t>& left_alone(const std::set<std::size_t>& parts,
                                             const std::set<std::size_t>& group, std::size_t base) {
    const auto [known, is_new] = left_alone_.try_emplace(parts);
    if (!is_new) return known->second;
    std::set<std::size_t> staying = group;
    for (const std::size_t part : parts) staying.erase(part);
    const std::set<std::size_t> before = joined(group, base), after = joined(staying, base);
    for (const std::size_t part : before)
      if (staying.contains(part) && !after.contains(part)) known->second.push_back(part);
    return known->second;
  }

  /// Those of the group that a chain of contacts within it joins to the base, and the base.
  std::set<std::size_t> joined(const std::set<std::size_t>& group, std::size_t base) const {
    std::set<std::size_t> result{base};
    std::vector<std::size_t> waiting{base};
    while (!waiting.empty()) {
      const std::size_t part = waiting.back();
      waiting.pop_back();
      for (const std::size_t other : neighbours_[part])
        if (group.contains(other) && result.insert(other).second) waiting.push_back(other);
    }
    return result;
  }

  /// No contact of those that leave opens along `d`.
  bool slides(const std::set<std::size_t>& parts, const Vec3& d) const {
    return std::none_of(product_.contacts.begin(), product_.contacts.end(), [&](const Contact& contact) {
      const bool first = parts.contains(contact.first), second = parts.contains(contact.second);
      if (first == second) return false;
      const double along = contact.axis_W.dot(d);
      return contact.kind == ContactKind::plane ? (first ? -along : along) > 0.999 : std::abs(along) > 0.999;
    });
  }

  /// Directions that no contact of the part suggests are tried last.
  bool is_diagonal(std::size_t i, std::size_t d) const {
    if (d < kFirstDirections) return false;
    const Vec3& direction = removal_.directions()[d];
    return std::none_of(product_.contacts.begin(), product_.contacts.end(), [&](const Contact& contact) {
      return (contact.first == i || contact.second == i) && contact.axis_W.cross(direction).norm() < 1e-3;
    });
  }

  /// Nothing but small undercuts holds the part along `d`, and something does: their area.
  std::optional<double> undercut(std::size_t i, std::size_t d, const std::set<std::size_t>& group) {
    double area_m2 = 0.0;
    for (const std::size_t b : group) {
      if (b == i) continue;
      const Removal::Undercut one = removal_.undercut(i, d, b);
      if (one.share > kSnapShare) return std::nullopt;
      area_m2 += one.area_m2;
    }
    return area_m2 > 0.0 ? std::optional(area_m2) : std::nullopt;
  }

  void describe(RemovalStep& step, const std::set<std::size_t>& moving, const std::set<std::size_t>& group,
                bool unsnap) {
    for (Contact& contact : product_.contacts) {
      const bool first = moving.contains(contact.first), second = moving.contains(contact.second);
      if (first == second || !group.contains(first ? contact.second : contact.first)) continue;
      const std::string& other = product_.instances[first ? contact.second : contact.first].name;
      const bool along = contact.axis_W.cross(step.direction_W).norm() < 1e-3;
      if (contact.kind == ContactKind::thread && along && step.loosening != Loosening::unscrew) {
        step.loosening = Loosening::unscrew;
        step.reason = "thread of pitch " + number_text(contact.pitch_m * 1e3, 3) + " mm in " + other;
      } else if (contact.kind == ContactKind::cylinder_fit && contact.clearance_m < 0.0 &&
                 step.loosening == Loosening::lift) {
        step.loosening = Loosening::pull;
        step.reason = "interference of " + number_text(-contact.clearance_m * 1e6, 3) +
                      " um in the radius with " + other;
      } else if (unsnap && contact.kind == ContactKind::plane) {
        const double sign = first ? 1.0 : -1.0;
        if (sign * contact.normals_W[0].dot(step.direction_W) < 0.5) continue;
        contact.kind = ContactKind::snap;
      }
    }
    if (!unsnap) return;
    step.loosening = Loosening::unsnap;
    if (step.reason.empty()) step.reason = "a small undercut holds it";
  }

  Product& product_;
  Removal removal_;
  std::vector<int> threads_;                       ///< by instance: number of threads
  std::vector<std::set<std::size_t>> neighbours_;  ///< by instance: those that touch it
  std::map<std::set<std::size_t>, std::vector<std::size_t>> left_alone_;
  Disassembly result_;
};

}  // namespace

Disassembly take_apart(Product& product) {
  return Planner(product).plan();
}

bool carries(const Contact& contact, bool first) {
  constexpr double kUpright = 0.1;
  if (contact.kind == ContactKind::thread || contact.kind == ContactKind::snap) return true;
  if (contact.kind == ContactKind::cylinder_fit)
    return contact.clearance_m < 0.0 || std::abs(contact.axis_W.z()) < 1.0 - kUpright;
  return contact.normals_W[0].z() * (first ? -1.0 : 1.0) > kUpright;
}

Hierarchy hierarchy(const Product& product, const Disassembly& plan) {
  Hierarchy result;
  result.numbers.assign(product.instances.size(), 1);
  std::vector<std::size_t> position(product.instances.size(), 0);
  for (std::size_t k = 0; k < plan.order.size(); ++k) position[plan.order[k]] = k;
  for (const std::size_t i : plan.order) {
    bool held = i == plan.base;
    for (const Contact& contact : product.contacts) {
      if (contact.first != i && contact.second != i) continue;
      const std::size_t other = contact.first == i ? contact.second : contact.first;
      if (position[other] < position[i])
        result.numbers[i] = std::max(result.numbers[i], result.numbers[other] + 1);
      else
        held = true;
    }
    if (!held) result.floating.push_back(i);
  }
  return result;
}

const char* to_string(Loosening loosening) {
  switch (loosening) {
    case Loosening::unscrew:
      return "unscrew";
    case Loosening::pull:
      return "pull";
    case Loosening::unsnap:
      return "unsnap";
    case Loosening::lift:
      break;
  }
  return "lift";
}

const char* to_string(ContactKind kind) {
  switch (kind) {
    case ContactKind::plane:
      return "plane";
    case ContactKind::cylinder_fit:
      return "cylinder_fit";
    case ContactKind::thread:
      return "thread";
    case ContactKind::snap:
      return "snap";
    case ContactKind::other:
      break;
  }
  return "other";
}

}  // namespace takt::product
