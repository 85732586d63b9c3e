#pragma once
// A search for partners knows no directions: without this a Part that is let go stays on a Ground that it touches from the side or
// from below. Of ComponentInteraction alone.
#include <algorithm>
#include <vector>

#include "server/components/pair_generation.h"
#include "server/contact/collision/collision_world.h"
#include "server/contact/holding/connections.h"
#include "server/contact/holding/partner_search.h"
#include "server/geometry/convex/distance.h"

namespace takt {

/// Of a pair of components. kHangs: of a Part that was let go and a Ground that does not support it.
inline constexpr char kApart = 0, kHolds = 1, kHangs = 2;

/// A Ground supports what lies on a slope of at most 60 degrees.
inline constexpr double kLeastSupport = 0.5;
/// A Part that overlaps deeper with a Ground is in a hole that convex shapes close, or has fallen into it within a step: the
/// direction of the overlap does not show where it came from.
inline constexpr double kDeepest_m = 0.001;

/// Whether a Ground that touches a Part carries it, as far as convex shapes show.
inline bool supports(const CollisionWorld& world, const InteractionParameters& parameters, int ground,
                     int part) {
  const double g = parameters.gravity_W.norm(), reach_m = 2.0 * parameters.contact_margin_m;
  if (g == 0.0) return true;
  const Vec3 up_W = parameters.gravity_W / -g;
  const Pose X_WG = world.pose(ground), X_WP = world.pose(part);
  for (const ConvexShape& mine : world.shapes(ground)) {
    const Aabb box = mine.box.at(X_WG, reach_m);
    if (!box.overlaps(world.aabb(part))) continue;
    for (const ConvexShape& its : world.shapes(part)) {
      if (!its.box.at(X_WP, reach_m).overlaps(box)) continue;
      const ConvexDistance found = convex_distance(mine, X_WG, its, X_WP);
      if (found.distance > reach_m) continue;
      if (found.normal_W.dot(up_W) > kLeastSupport || found.distance < -kDeepest_m) return true;
    }
  }
  return false;
}

struct GroundContacts {
  const std::vector<Component>& components;
  const InteractionParameters& parameters;
  const CollisionWorld& world;
  const PairTable& pairs;
  const std::vector<char>& by_contact;
  std::vector<char>& in_contact;
  ContactGraph &graph, &shown_graph;

  /// Opens the contacts of a Part with Grounds where none of them supports it. Does not allocate.
  void drop_unsupported(int part) const {
    if (parameters.algorithm != InteractionAlgorithm::partner_search) return;
    const std::vector<int>& neighbours = graph.neighbours[static_cast<std::size_t>(part)];
    const auto touches = [&](int ground) {
      if (components[static_cast<std::size_t>(ground)].type != ComponentType::ground ||
          graph.holds[static_cast<std::size_t>(part)] == ground)
        return false;
      const std::size_t pair = pairs.find_either(part, ground);
      return in_contact[pair] == kHolds && by_contact[pair] == 0;
    };
    if (std::any_of(neighbours.begin(), neighbours.end(),
                    [&](int ground) { return touches(ground) && supports(world, parameters, ground, part); }))
      return;
    for (std::size_t i = neighbours.size(); i-- > 0;) {
      const int ground = neighbours[i];
      if (!touches(ground)) continue;
      in_contact[pairs.find_either(part, ground)] = kHangs;
      graph.remove_contact(part, ground);
      shown_graph.remove_contact(part, ground);
    }
  }
};

}  // namespace takt
