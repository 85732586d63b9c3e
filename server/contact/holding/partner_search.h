#pragma once
// Assembly Graph Partner Search Algorithm (AGPSA, thesis 3.5.2): finds for each Part the one component that
// holds it. Input: the contact graph. Output: the partner, without forces.
//
// From the Part the search follows contacts to Grippers, to Grounds, and to Parts of strictly higher
// hierarchy. Every sequence that cannot be extended is a result (a Path Vertices Sequence). A sequence that
// ends in a Gripper is preferred over one that ends in a Ground, and that over one that ends in a Part.
//
// Differences from Algorithm 1 as printed: Grippers and Grounds end a sequence (as printed, a sequence could
// continue through a Gripper to any other component in contact with it). Ties: the shorter sequence, then the
// present partner (so that a handover happens when the first gripper opens), then the lower id. As the
// hierarchy rises along a sequence, a breadth-first search with visited marks finds the same partner as
// listing all sequences, in linear time.
//
// The only sequence of a Part that the user attached to a component (holds) leads there, independent of
// contacts and hierarchies.
#include <cstdint>
#include <span>
#include <vector>

#include "takt_enumerations.h"

namespace takt {

/// The contacts, and the properties of components that the search uses.
struct ContactGraph {
  struct Vertex {
    ComponentType type = ComponentType::part;
    int hierarchy = 0;
  };
  std::vector<Vertex> vertices;
  std::vector<std::vector<int>> neighbours;  ///< by component id, ascending; capacity is kept between steps
  std::vector<int> holds;  ///< by component: its attachment by the user, which is also a neighbour; or -1

  explicit ContactGraph(std::size_t count = 0) : vertices(count), neighbours(count), holds(count, -1) {}
  void clear_contacts();  ///< removes the edges of attachments too: the caller adds them again
  /// Adds an edge; neighbours stay sorted and unique.
  void add_contact(int a, int b);
  void remove_contact(int a, int b);

  /// True if a sequence may be extended from `from` (a Part) to `to`.
  bool may_follow(int from, int to) const {
    if (const int held_by = holds[static_cast<std::size_t>(from)]; held_by != -1) return to == held_by;
    const Vertex& v = vertices[static_cast<std::size_t>(to)];
    return v.type != ComponentType::part || v.hierarchy > vertices[static_cast<std::size_t>(from)].hierarchy;
  }
};

class PartnerSearch {
 public:
  explicit PartnerSearch(std::size_t component_count);
  /// Partner of a Part, or -1. `present` is its partner so far (-1: none). Does not allocate.
  int find(const ContactGraph& graph, int part, int present);

 private:
  std::vector<std::uint32_t> visited_;  ///< mark of the search that saw the component last
  std::vector<int> level_, next_;
  std::uint32_t mark_ = 0;
};

/// One dequeue round of Algorithm 1, as in thesis Table 3.3: all sequences of one length at once.
struct SearchStep {
  std::vector<std::vector<int>> queue;      ///< sequences treated in this step
  std::vector<std::vector<int>> found;      ///< their extensions
  std::vector<std::vector<int>> resulting;  ///< sequences without extension, collected so far
};

/// Every sequence from a Part, step by step: for explanations and as the reference of the search above.
/// Exponential.
std::vector<SearchStep> list_sequences(const ContactGraph& graph, int part);

}  // namespace takt
