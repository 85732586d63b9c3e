#pragma once
// The rules by which touching pairs are connected, for each of the three algorithms, as pure functions of the
// contact graph.
//
// Substitute force (SFA, thesis 3.4.1): every touching pair. (A Gripper is in the graph only while it holds.)
//
// Extended substitute force (3.4.2, Fig. 3.11): the flowchart goes over components and evaluates each side of
// a pair by itself; the two results differ if one of two touching Parts is grasped and the other is not of
// lower hierarchy, and then a printed force has no reaction. Here a pair is connected only if both sides
// count each other, so forces always balance:
// - Part and Gripper: the Part is grasped. Of several Grippers, one: the present partner, else the lowest id.
// - Part and Ground: the Part is not grasped. Of several Grounds, one, chosen likewise.
// - Part and Part: neither is grasped, or only the one of strictly higher hierarchy is (the lower rides on
//   it). So a grasped Part releases every Part above it in hierarchy, as with partner search.
//
// Partner search (3.5.2) connects a Part with its partner, possibly without contact: see partner_search.h.
#include <array>
#include <cstdint>
#include <string_view>
#include <utility>
#include <vector>

#include "server/contact/holding/partner_search.h"

namespace takt {

enum class InteractionAlgorithm : std::uint8_t {
  substitute_force,
  extended_substitute_force,
  partner_search
};

/// Names of the algorithms in scenarios.
inline constexpr std::array<std::string_view, 3> kInteractionAlgorithmNames{
    "substitute_force", "extended_substitute_force", "partner_search"};
constexpr std::string_view to_string(InteractionAlgorithm algorithm) {
  return kInteractionAlgorithmNames[static_cast<std::size_t>(algorithm)];
}
/// Of a name that is one of the above.
InteractionAlgorithm interaction_algorithm(std::string_view name);

/// Base and target of a connection.
using ConnectionKey = std::pair<int, int>;

/// True if of two touching Parts `a` is the Base: lower hierarchy, then lower id (as pairs are generated).
inline bool is_base(const ContactGraph& graph, int a, int b) {
  const int rank_a = graph.vertices[static_cast<std::size_t>(a)].hierarchy;
  const int rank_b = graph.vertices[static_cast<std::size_t>(b)].hierarchy;
  return rank_a != rank_b ? rank_a < rank_b : a < b;
}

/// Appends the connections, ascending, with `part` as Base. `present` is its present holder, or -1.
void substitute_force_connections(const ContactGraph& graph, int part, std::vector<ConnectionKey>& out);
void extended_substitute_force_connections(const ContactGraph& graph, int part, int present,
                                           std::vector<ConnectionKey>& out);

}  // namespace takt
