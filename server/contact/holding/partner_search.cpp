#include "server/contact/holding/partner_search.h"

#include <algorithm>
#include <utility>

namespace takt {

void ContactGraph::clear_contacts() {
  for (auto& list : neighbours) list.clear();
}

void ContactGraph::add_contact(int a, int b) {
  for (const auto& [at, other] : {std::pair{a, b}, std::pair{b, a}}) {
    auto& list = neighbours[static_cast<std::size_t>(at)];
    const auto place = std::lower_bound(list.begin(), list.end(), other);
    if (place == list.end() || *place != other) list.insert(place, other);
  }
}

void ContactGraph::remove_contact(int a, int b) {
  for (const auto& [at, other] : {std::pair{a, b}, std::pair{b, a}}) {
    auto& list = neighbours[static_cast<std::size_t>(at)];
    const auto it = std::lower_bound(list.begin(), list.end(), other);
    if (it != list.end() && *it == other) list.erase(it);
  }
}

PartnerSearch::PartnerSearch(std::size_t component_count) : visited_(component_count, 0) {
  level_.reserve(component_count);
  next_.reserve(component_count);
}

int PartnerSearch::find(const ContactGraph& graph, int part, int present) {
  if (++mark_ == 0) {  // the counter came round: forget all marks
    std::fill(visited_.begin(), visited_.end(), 0U);
    mark_ = 1;
  }
  // Best candidate per type of end vertex: the first level that offers one decides; within it the present
  // partner, then the lowest id.
  int best[3] = {-1, -1, -1};
  const auto offer = [&](int candidate, std::size_t kind, bool open) {
    if (!open) return;
    int& holder = best[kind];
    if (holder == -1 || candidate == present || (holder != present && candidate < holder)) holder = candidate;
  };
  level_.assign(1, part);
  visited_[static_cast<std::size_t>(part)] = mark_;
  bool open[3] = {true, true, true};
  while (!level_.empty()) {
    next_.clear();
    for (const int vertex : level_) {
      bool extended = false;
      for (const int neighbour : graph.neighbours[static_cast<std::size_t>(vertex)]) {
        if (!graph.may_follow(vertex, neighbour)) continue;
        extended = true;
        const ComponentType type = graph.vertices[static_cast<std::size_t>(neighbour)].type;
        if (type == ComponentType::part) {
          if (visited_[static_cast<std::size_t>(neighbour)] == mark_) continue;
          visited_[static_cast<std::size_t>(neighbour)] = mark_;
          next_.push_back(neighbour);
        } else {
          offer(neighbour, static_cast<std::size_t>(type), open[static_cast<std::size_t>(type)]);
        }
      }
      if (!extended && vertex != part) offer(vertex, 0, open[0]);  // the sequence ends in this Part
    }
    for (std::size_t kind = 0; kind < 3; ++kind) open[kind] = best[kind] == -1;
    if (best[static_cast<std::size_t>(ComponentType::gripper)] != -1)
      break;  // no later end has a higher rank
    level_.swap(next_);
  }
  for (const ComponentType type : {ComponentType::gripper, ComponentType::ground, ComponentType::part}) {
    if (best[static_cast<std::size_t>(type)] != -1) return best[static_cast<std::size_t>(type)];
  }
  return -1;
}

std::vector<SearchStep> list_sequences(const ContactGraph& graph, int part) {
  std::vector<SearchStep> steps;
  std::vector<std::vector<int>> queue{{part}};
  std::vector<std::vector<int>> resulting;
  while (!queue.empty()) {
    SearchStep step;
    step.queue = queue;
    for (const std::vector<int>& sequence : queue) {
      const int last = sequence.back();
      bool extended = false;
      if (graph.vertices[static_cast<std::size_t>(last)].type == ComponentType::part) {
        for (const int neighbour : graph.neighbours[static_cast<std::size_t>(last)]) {
          const bool contained = std::find(sequence.begin(), sequence.end(), neighbour) != sequence.end();
          if (contained || !graph.may_follow(last, neighbour)) continue;
          std::vector<int> longer = sequence;
          longer.push_back(neighbour);
          step.found.push_back(std::move(longer));
          extended = true;
        }
      }
      if (!extended && sequence.size() > 1) resulting.push_back(sequence);
    }
    step.resulting = resulting;
    queue = step.found;
    steps.push_back(std::move(step));
  }
  return steps;
}

}  // namespace takt
