#include "server/contact/holding/connection_rules.h"

#include <algorithm>
#include <stdexcept>
#include <string>

namespace takt {

namespace {
const ContactGraph::Vertex& vertex(const ContactGraph& graph, int component) {
  return graph.vertices[static_cast<std::size_t>(component)];
}

/// The one neighbour of this type that holds the Part, or -1.
int holder(const ContactGraph& graph, int part, ComponentType type, int present) {
  int best = -1;
  for (const int other : graph.neighbours[static_cast<std::size_t>(part)]) {
    if (vertex(graph, other).type != type) continue;
    if (best == -1 || other == present) best = other;
  }
  return best;
}

bool grasped(const ContactGraph& graph, int part) {
  return holder(graph, part, ComponentType::gripper, -1) != -1;
}
}  // namespace

InteractionAlgorithm interaction_algorithm(std::string_view name) {
  const auto it = std::find(kInteractionAlgorithmNames.begin(), kInteractionAlgorithmNames.end(), name);
  if (it == kInteractionAlgorithmNames.end()) {
    throw std::invalid_argument("interaction.algorithm: found '" + std::string(name) +
                                "'; allowed are substitute_force, extended_substitute_force, partner_search");
  }
  return static_cast<InteractionAlgorithm>(it - kInteractionAlgorithmNames.begin());
}

void substitute_force_connections(const ContactGraph& graph, int part, std::vector<ConnectionKey>& out) {
  for (const int other : graph.neighbours[static_cast<std::size_t>(part)]) {
    if (vertex(graph, other).type == ComponentType::part && !is_base(graph, part, other)) continue;
    if (graph.holds[static_cast<std::size_t>(other)] == part) continue;  // there this Part is the Target
    out.emplace_back(part, other);
  }
}

void extended_substitute_force_connections(const ContactGraph& graph, int part, int present,
                                           std::vector<ConnectionKey>& out) {
  const int gripper = holder(graph, part, ComponentType::gripper, present);
  const int support = gripper != -1 ? gripper : holder(graph, part, ComponentType::ground, present);
  for (const int other : graph.neighbours[static_cast<std::size_t>(part)]) {
    if (vertex(graph, other).type != ComponentType::part) {
      if (other == support) out.emplace_back(part, other);
      continue;
    }
    // The Base is the lower one of the two: if it is grasped, the higher one does not count it.
    if (!is_base(graph, part, other) || gripper != -1) continue;
    if (graph.holds[static_cast<std::size_t>(other)] == part) continue;  // there this Part is the Target
    const bool higher = vertex(graph, other).hierarchy > vertex(graph, part).hierarchy;
    if (higher || !grasped(graph, other)) out.emplace_back(part, other);
  }
}

}  // namespace takt
