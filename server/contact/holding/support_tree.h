#pragma once
// The carrier of each Part when Parts are connected with each other (SFA and extended SFA): a spanning tree
// of the closed connections, grown from Grippers and Grounds outwards.
//
// The carrier of a Part held directly by a Gripper or Ground is that component (Gripper first). The carrier
// of every other Part is the connected Part with the fewest connections to a support; ties: a support that is
// a Gripper, then the present carrier, then the higher hierarchy, then the lower id. A cluster without
// support falls as a whole; its tree grows from the Part of highest hierarchy, then lowest id.
#include <span>
#include <vector>

#include "server/components/component.h"
#include "server/contact/holding/partner_search.h"

namespace takt {

class StateReader;
class StateWriter;

class SupportTree {
 public:
  explicit SupportTree(const std::vector<Component>& components);

  /// Grows the tree for `parts` (ascending), which must be all Parts of their contact clusters.
  /// `closed(part, other)`: whether two touching components are connected. Does not allocate.
  template <typename Closed>
  void grow(const ContactGraph& graph, std::span<const int> parts, const Closed& closed);
  void reset();
  void save(StateWriter& out) const;
  void load(StateReader& in);

  /// Carrier of a Part, or -1 without carrier and for the root of a free cluster.
  int carrier(int part) const { return at(part).carrier; }
  /// Gripper or Ground at the end of the sequence of carriers, or -1.
  int support(int part) const { return at(part).support; }

 private:
  struct Entry {
    int carrier = -1;
    int support = -1;
    int level = -1;  ///< connections to the root; -1: not reached yet
    int present = -1;
  };
  const Entry& at(int part) const { return entries_[static_cast<std::size_t>(part)]; }
  Entry& at(int part) { return entries_[static_cast<std::size_t>(part)]; }
  bool is_gripper(int component) const {
    return component >= 0 && components_[static_cast<std::size_t>(component)].type == ComponentType::gripper;
  }
  bool better_carrier(int part, int candidate, int than) const;
  void begin(std::span<const int> parts);
  void sort_unreached(std::span<const int> parts);
  template <typename Closed>
  void spread(const ContactGraph& graph, const Closed& closed);

  const std::vector<Component>& components_;
  std::vector<Entry> entries_;
  std::vector<int> level_, next_, unreached_;
};

template <typename Closed>
void SupportTree::grow(const ContactGraph& graph, std::span<const int> parts, const Closed& closed) {
  begin(parts);
  level_.clear();
  for (const int part : parts) {
    Entry& entry = at(part);
    for (const int other : graph.neighbours[static_cast<std::size_t>(part)]) {
      const bool is_part = graph.vertices[static_cast<std::size_t>(other)].type == ComponentType::part;
      if (is_part || !closed(part, other)) continue;
      const bool first = entry.carrier == -1;
      const bool better = !first && (is_gripper(other) != is_gripper(entry.carrier) ? is_gripper(other)
                                                                                    : other == entry.present);
      if (first || better) entry.carrier = entry.support = other;
    }
    if (entry.carrier == -1) continue;
    entry.level = 1;
    level_.push_back(part);
  }
  spread(graph, closed);
  sort_unreached(parts);
  for (const int part : unreached_) {
    if (at(part).level != -1) continue;
    at(part).level = 0;
    level_.assign(1, part);
    spread(graph, closed);
  }
}

template <typename Closed>
void SupportTree::spread(const ContactGraph& graph, const Closed& closed) {
  while (!level_.empty()) {
    next_.clear();
    for (const int from : level_) {
      const int level = at(from).level + 1;
      for (const int other : graph.neighbours[static_cast<std::size_t>(from)]) {
        if (graph.vertices[static_cast<std::size_t>(other)].type != ComponentType::part) continue;
        Entry& entry = at(other);
        if ((entry.level != -1 && entry.level != level) || !closed(from, other)) continue;
        const bool first = entry.level == -1;
        if (!first && !better_carrier(other, from, entry.carrier)) continue;
        if (first) next_.push_back(other);
        entry.level = level;
        entry.carrier = from;
        entry.support = at(from).support;
      }
    }
    level_.swap(next_);
  }
}

}  // namespace takt
