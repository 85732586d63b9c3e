#include "server/contact/holding/support_tree.h"

#include <algorithm>

#include "plant_models/state_bytes.h"

namespace takt {

SupportTree::SupportTree(const std::vector<Component>& components)
    : components_(components), entries_(components.size()) {
  for (auto* list : {&level_, &next_, &unreached_}) list->reserve(components.size());
}

void SupportTree::reset() {
  std::fill(entries_.begin(), entries_.end(), Entry{});
}

void SupportTree::save(StateWriter& out) const {
  for (const Entry& entry : entries_) out.put(entry.carrier), out.put(entry.support);
}

void SupportTree::load(StateReader& in) {
  for (Entry& entry : entries_) {
    entry = {};
    entry.carrier = in.index(entries_.size(), "a carrier");
    entry.support = in.index(entries_.size(), "a support");
  }
}

void SupportTree::begin(std::span<const int> parts) {
  for (const int part : parts) at(part) = {-1, -1, -1, at(part).carrier};
}

bool SupportTree::better_carrier(int part, int candidate, int than) const {
  const bool by_gripper = is_gripper(at(candidate).support);
  if (by_gripper != is_gripper(at(than).support)) return by_gripper;
  const int present = at(part).present;
  if (candidate == present || than == present) return candidate == present;
  const int rank = components_[static_cast<std::size_t>(candidate)].hierarchy;
  const int other_rank = components_[static_cast<std::size_t>(than)].hierarchy;
  return rank != other_rank ? rank > other_rank : candidate < than;
}

void SupportTree::sort_unreached(std::span<const int> parts) {
  unreached_.clear();
  for (const int part : parts)
    if (at(part).level == -1) unreached_.push_back(part);
  std::sort(unreached_.begin(), unreached_.end(), [this](int a, int b) {
    const int rank_a = components_[static_cast<std::size_t>(a)].hierarchy;
    const int rank_b = components_[static_cast<std::size_t>(b)].hierarchy;
    return rank_a != rank_b ? rank_a > rank_b : a < b;
  });
}

}  // namespace takt
