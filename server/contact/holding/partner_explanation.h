#pragma once
// Explains a result of the partner search: the decision with its rule, the sequences it chose from (Path
// Vertices Sequences, thesis 3.5.2, (3.32) to (3.37)), and the depth of contacts. For queries, outside of the
// step: it changes no state, and every function has a bounded cost, as stated with it.
#include <cstdint>
#include <vector>

#include "server/contact/collision/collision_world.h"
#include "server/contact/holding/partner_search.h"
#include "takt_enumerations.h"

namespace takt {

struct PartnerDecision {
  int partner = -1;  ///< component id, or -1
  PartnerRule rule = PartnerRule::nothing_reachable;
  int contacts = 0;  ///< along the shortest sequence to the partner
  int rival = -1;    ///< the partner if the present one ended no sequence, or -1
  int rival_contacts = 0;
};

/// The decision of PartnerSearch::find() with its reason. `present` is the partner so far (-1: none). Linear
/// in the contacts that the search can reach.
PartnerDecision decide_partner(const ContactGraph& graph, int part, int present);

/// Limits of the listing. The number of sequences can be exponential.
struct ListingLimits {
  std::size_t sequences = 200;
  std::size_t vertices = 2000;   ///< of all sequences listed together
  std::size_t visits = 100'000;  ///< visited contacts
};

struct SequenceListing {
  /// From the Part to the end. Sequences to the partner first, then the others by type of end (Gripper,
  /// Ground, Part), each group by length; sequences[0] is the shortest one to the partner.
  std::vector<std::vector<int>> sequences;
  /// Number of sequences, listed or not; at most 2^64 - 1.
  std::uint64_t count = 0;
};

/// All sequences from a Part, up to the limits. Linear in the contacts that can be reached, plus the limits.
SequenceListing list_sequences(const ContactGraph& graph, int part, int partner, const ListingLimits& limits);

/// How two components touch, at the poses of the collision world.
struct ContactDepth {
  bool known = false;       ///< false: the budget was used up first
  double distance_m = 0.0;  ///< of the nearest (deepest) pair of their convex parts; negative: they overlap
  double error_m = 0.0;     ///< see ConvexDistance
  Vec3 position_W = Vec3::Zero();  ///< midway between the nearest points, or the deepest
  Vec3 normal_W = Vec3::UnitZ();   ///< from the first to the second component
};

/// `budget`: remaining number of measurements of pairs of convex parts (some microseconds each); counted
/// down. Only pairs whose boxes are within the margin are measured.
ContactDepth contact_depth(const CollisionWorld& world, int a, int b, int& budget);

}  // namespace takt
