// Attachments by the user, and saving and loading of the interaction.
//
// Not saved: verdicts, the broad phase, hints and the counts of work. A verdict depends on shapes and poses
// alone and hints only prove it, so the first stage after load() tests all pairs and finds the same contacts.
#include <algorithm>
#include <string>

#include "plant_models/state_bytes.h"
#include "server/contact/holding/component_interaction.h"
#include "server/contact/holding/ground_support.h"

namespace takt {
namespace {

/// Of a saved contact.
constexpr std::uint64_t kHangsFlag = std::uint64_t{1} << 63U;

}  // namespace

void ComponentInteraction::mark_changed(int component) {
  const auto c = static_cast<std::size_t>(component);
  if (graph_.vertices[c].type != ComponentType::part || reached_[c] != 0) return;
  reached_[c] = 1;
  changed_parts_.push_back(component);
}

bool ComponentInteraction::attached(int a, int b) const {
  return graph_.holds[static_cast<std::size_t>(a)] == b || graph_.holds[static_cast<std::size_t>(b)] == a;
}

std::string ComponentInteraction::attach(int part, int component) {
  const auto name = [this](int id) { return components_[static_cast<std::size_t>(id)].name; };
  for (int at = component; at != -1; at = attached_to(at)) {
    if (at != part) continue;
    return name(part) + " cannot be attached to " + name(component) +
           (at == component ? ", which is itself"
                            : ", which is attached to it, directly or through others: detach that first");
  }
  if (attached_to(part) != component) {
    if (attached_to(part) != -1) detach(part);
    graph_.holds[static_cast<std::size_t>(part)] = shown_graph_.holds[static_cast<std::size_t>(part)] =
        component;
    add_attached_edge(part);
  }
  connections_.recompute_gains(part, Connections::Renewal::own);
  mark_changed(part);
  mark_changed(component);
  return {};
}

void ComponentInteraction::detach(int part) {
  const int component = attached_to(part);
  graph_.holds[static_cast<std::size_t>(part)] = shown_graph_.holds[static_cast<std::size_t>(part)] = -1;
  const int pair = find_pair(part, component);
  GroundContacts{components_, parameters_, collision_world_, pairs_,
                 by_contact_, in_contact_, graph_,           shown_graph_}
      .drop_unsupported(part);
  const bool touch = pair >= 0 && in_contact_[static_cast<std::size_t>(pair)] == kHolds;
  if (!touch || by_contact_[static_cast<std::size_t>(pair)] != 0) graph_.remove_contact(part, component);
  if (any_by_contact_ && !touch) shown_graph_.remove_contact(part, component);
  mark_changed(part);
  mark_changed(component);
}

void ComponentInteraction::add_attached_edge(int part) {
  graph_.add_contact(part, attached_to(part));
  if (any_by_contact_) shown_graph_.add_contact(part, attached_to(part));
}

void ComponentInteraction::reconsider_attached() {
  for (const int part : parts_)
    if (attached_to(part) != -1) mark_changed(part);
}

void ComponentInteraction::put_elsewhere(int part) {
  connections_.recompute_gains(part, Connections::Renewal::all);
  mark_changed(part);
  for (const PairConnection& pair : connections_.all()) {
    if (pair.connection.partner == part) mark_changed(pair.base);
    if (pair.base == part) mark_changed(pair.connection.partner);
  }
}

void ComponentInteraction::rebuild_graphs() {
  graph_.clear_contacts();
  shown_graph_.clear_contacts();
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    if (in_contact_[i] != kHolds) continue;
    const int base = pairs_.base(i), target = pairs_.target(i);
    shown_graph_.add_contact(base, target);
    if (by_contact_[i] == 0) graph_.add_contact(base, target);
  }
  for (const int part : parts_)
    if (attached_to(part) != -1) add_attached_edge(part);
}

void ComponentInteraction::save_attached(StateWriter& out) const {
  for (const int component : graph_.holds) out.put(component);
}

void ComponentInteraction::load_attached(StateReader& in) {
  const std::size_t n = components_.size();
  for (std::size_t i = 0; i < n; ++i) {
    const int component = in.index(n, "what a Part is attached to");
    graph_.holds[i] = shown_graph_.holds[i] = component;
    if (component != -1 && components_[i].type != ComponentType::part)
      in.fail(components_[i].name + " is attached, but is no Part");
  }
  for (const int part : parts_) {
    std::size_t length = 0;
    for (int at = part; at != -1; at = attached_to(at))
      if (++length > n) in.fail("what Parts are attached to goes in a circle");
  }
}

void ComponentInteraction::save(StateWriter& out) const {
  const std::size_t n = components_.size();
  for (std::size_t i = 0; i < n; ++i) out.put(collision_world_.pose(static_cast<int>(i)));
  for (std::size_t i = 0; i < n; ++i) {
    if (components_[i].role != GripperRole::palm) continue;
    out.put_size(holds_[i].size());
    for (const int part : holds_[i]) out.put(part);
    if (holds_[i].empty()) continue;
    const std::vector<Vec3>& corners = collision_world_.shapes(static_cast<int>(i)).front().vertices;
    out.put(corners.front()), out.put(corners.back());
  }
  for (const int partner : shown_partner_) out.put(partner);
  out.put_size(pairs_.size() -
               static_cast<std::size_t>(std::count(in_contact_.begin(), in_contact_.end(), 0)));
  for (std::size_t i = 0; i < pairs_.size(); ++i)
    if (in_contact_[i] != 0) out.put(i | (in_contact_[i] == kHangs ? kHangsFlag : 0));
  out.put_size(changed_parts_.size());
  for (const int part : changed_parts_) out.put(part);
  connections_.save(out);
}

void ComponentInteraction::load(StateReader& in) {
  const std::size_t n = components_.size();
  for (std::size_t i = 0; i < n; ++i) collision_world_.set_pose(static_cast<int>(i), in.pose("a pose"));
  std::fill(held_.begin(), held_.end(), 0);
  for (std::vector<int>& held : holds_) held.clear();
  for (std::size_t i = 0; i < n; ++i) {
    if (components_[i].role != GripperRole::palm) continue;
    for (std::size_t k = in.size(parts_.size(), "held Parts"); k > 0; --k) {
      const int part = in.index(n, "a held Part");
      const int pair = part == -1 ? -1 : find_pair(part, static_cast<int>(i));
      if (pair < 0 || (!holds_[i].empty() && holds_[i].back() >= part))
        in.fail("what " + components_[i].name + " holds is no Part, or not in order");
      holds_[i].push_back(part);
      held_[static_cast<std::size_t>(pair)] = 1;
    }
    if (holds_[i].empty()) continue;
    const Vec3 lower_G = in.vector("a grasp volume"), upper_G = in.vector("a grasp volume");
    collision_world_.set_box(static_cast<int>(i), lower_G, upper_G);
  }
  for (int& partner : shown_partner_) partner = in.index(n, "a partner");
  std::fill(in_contact_.begin(), in_contact_.end(), 0);
  const std::size_t contacts = in.size(pairs_.size(), "contacts");
  for (std::size_t i = 0; i < contacts; ++i) {
    const auto saved = in.get<std::uint64_t>();
    const std::uint64_t pair = saved & ~kHangsFlag;
    if (pair >= pairs_.size()) in.fail("a contact is of no pair of the cell");
    in_contact_[static_cast<std::size_t>(pair)] = pair == saved ? kHolds : kHangs;
  }
  std::fill(reached_.begin(), reached_.end(), 0);
  changed_parts_.clear();
  const std::size_t changed = in.size(parts_.size(), "changed Parts");
  for (std::size_t i = 0; i < changed; ++i) {
    const int part = in.index(n, "a changed Part");
    if (part == -1) in.fail("a changed Part has no valid index");
    mark_changed(part);
  }
  rebuild_graphs();
  connections_.load(in);
  begun_ = false;
  known_calls_ = 0;
}

}  // namespace takt
