#include "server/contact/holding/partner_explanation.h"

#include <algorithm>
#include <limits>
#include <tuple>

#include "server/geometry/convex/distance.h"

namespace takt {
namespace {

constexpr int kUnreached = std::numeric_limits<int>::max();

int preference(ComponentType type) {
  return type == ComponentType::gripper ? 0 : type == ComponentType::ground ? 1 : 2;
}

std::uint64_t saturated_sum(std::uint64_t a, std::uint64_t b) {
  return a > std::numeric_limits<std::uint64_t>::max() - b ? std::numeric_limits<std::uint64_t>::max()
                                                           : a + b;
}

/// The components within reach of a search from one Part.
class Reach {
 public:
  Reach(const ContactGraph& graph, int part) : graph_(graph), contacts_(graph.vertices.size(), kUnreached) {
    contacts_[index(part)] = 0;
    std::vector<int> queue{part};
    for (std::size_t i = 0; i < queue.size(); ++i) {
      const int v = queue[i];
      bool extended = false;
      for (const int next : graph.neighbours[index(v)]) {
        if (!graph.may_follow(v, next)) continue;
        extended = true;
        if (contacts_[index(next)] != kUnreached) continue;
        contacts_[index(next)] = contacts_[index(v)] + 1;
        if (is_part(next))
          queue.push_back(next);
        else
          ends_.push_back(next);
      }
      if (!extended && v != part) ends_.push_back(v);
    }
    parts_ = std::move(queue);
  }

  bool is_part(int v) const { return graph_.vertices[index(v)].type == ComponentType::part; }
  ComponentType type(int v) const { return graph_.vertices[index(v)].type; }
  int hierarchy(int v) const { return graph_.vertices[index(v)].hierarchy; }
  /// Contacts along the shortest sequence to a component that is reached.
  int contacts(int v) const { return contacts_[index(v)]; }
  /// Components in which a sequence ends, each once.
  const std::vector<int>& ends() const { return ends_; }
  /// The reached Parts including the first one, nearest first.
  const std::vector<int>& parts() const { return parts_; }
  const ContactGraph& graph() const { return graph_; }
  static std::size_t index(int v) { return static_cast<std::size_t>(v); }

 private:
  const ContactGraph& graph_;
  std::vector<int> contacts_;  ///< by component
  std::vector<int> ends_, parts_;
};

/// Lists the sequences with a chosen kind of end, shortest first. Possible tails of sequences are computed
/// from the ends backwards, so that the listing visits no dead ends except for gaps between the lengths.
class Lister {
 public:
  Lister(const Reach& reach, const ListingLimits& limits, SequenceListing& listing)
      : reach_(reach), limits_(limits), listing_(listing), tails_(reach.graph().vertices.size()) {
    by_hierarchy_ = reach.parts();
    // The hierarchy rises along a sequence, so successors of a Part are sorted ahead of it.
    std::sort(by_hierarchy_.begin(), by_hierarchy_.end(), [&](int a, int b) {
      return std::tuple(-reach.hierarchy(a), a) < std::tuple(-reach.hierarchy(b), b);
    });
  }

  template <typename Wanted>
  void list(int part, const Wanted& wanted) {
    for (const int v : by_hierarchy_) tails_[Reach::index(v)] = tail(v, part, wanted);
    const Tail whole = tails_[Reach::index(part)];
    listing_.count = saturated_sum(listing_.count, whole.count);
    for (int length = whole.shortest; length <= whole.longest && whole.count > 0 && !full_; ++length) {
      list_of_length(part, length, wanted);
    }
  }

 private:
  /// The contacts that may follow a Part on the way to an end of the chosen kind.
  struct Tail {
    std::uint64_t count = 0;
    int shortest = kUnreached, longest = -1;
    void add(const Tail& next) {
      if (next.count == 0) return;
      count = saturated_sum(count, next.count);
      shortest = std::min(shortest, next.shortest + 1);
      longest = std::max(longest, next.longest + 1);
    }
  };
  struct Place {
    int vertex = -1;
    std::size_t next = 0;  ///< of its neighbours
  };

  template <typename Wanted>
  Tail tail(int v, int part, const Wanted& wanted) const {
    static constexpr Tail kEnd{1, 0, 0};
    Tail result;
    bool extended = false;
    for (const int next : reach_.graph().neighbours[Reach::index(v)]) {
      if (!reach_.graph().may_follow(v, next)) continue;
      extended = true;
      if (reach_.is_part(next))
        result.add(tails_[Reach::index(next)]);
      else if (wanted(next))
        result.add(kEnd);
    }
    return !extended && v != part && wanted(v) ? kEnd : result;
  }

  template <typename Wanted>
  void list_of_length(int part, int length, const Wanted& wanted) {
    path_.assign(1, {part, 0});
    while (!path_.empty() && !full_) {
      const int v = path_.back().vertex;
      const std::vector<int>& neighbours = reach_.graph().neighbours[Reach::index(v)];
      if (path_.back().next == neighbours.size()) {
        path_.pop_back();
        continue;
      }
      if (++visits_ > limits_.visits) full_ = true;
      const int next = neighbours[path_.back().next++];
      if (!reach_.graph().may_follow(v, next)) continue;
      const int left = length - static_cast<int>(path_.size());  // contacts after this one
      if (!reach_.is_part(next)) {
        if (left == 0 && wanted(next)) found(next);
        continue;
      }
      const Tail& rest = tails_[Reach::index(next)];
      if (rest.count == 0 || left < rest.shortest || left > rest.longest) continue;
      if (left == 0)
        found(next);
      else
        path_.push_back({next, 0});
    }
  }

  void found(int end) {
    if (listing_.sequences.size() >= limits_.sequences || vertices_ + path_.size() >= limits_.vertices) {
      full_ = true;
      return;
    }
    std::vector<int>& sequence = listing_.sequences.emplace_back();
    for (const Place& place : path_) sequence.push_back(place.vertex);
    sequence.push_back(end);
    vertices_ += sequence.size();
  }

  const Reach& reach_;
  const ListingLimits& limits_;
  SequenceListing& listing_;
  std::vector<int> by_hierarchy_;
  std::vector<Tail> tails_;  ///< by component; Parts only
  std::vector<Place> path_;
  std::size_t visits_ = 0, vertices_ = 0;
  bool full_ = false;
};

}  // namespace

PartnerDecision decide_partner(const ContactGraph& graph, int part, int present) {
  const Reach reach(graph, part);
  const auto key = [&](int end) {
    return std::tuple(preference(reach.type(end)), reach.contacts(end), end == present ? 0 : 1, end);
  };
  PartnerDecision result;
  for (const int end : reach.ends()) {
    if (result.partner == -1 || key(end) < key(result.partner)) {
      result.rival = result.partner;
      result.partner = end;
    } else if (result.rival == -1 || key(end) < key(result.rival)) {
      result.rival = end;
    }
  }
  if (result.partner == -1) return result;
  result.contacts = reach.contacts(result.partner);
  if (result.rival == -1) {
    result.rule = PartnerRule::only_end;
    return result;
  }
  result.rival_contacts = reach.contacts(result.rival);
  result.rule = reach.type(result.partner) != reach.type(result.rival) ? PartnerRule::end_type
                : result.contacts != result.rival_contacts             ? PartnerRule::shorter_sequence
                : result.partner == present                            ? PartnerRule::present_partner
                                                                       : PartnerRule::lower_id;
  return result;
}

SequenceListing list_sequences(const ContactGraph& graph, int part, int partner,
                               const ListingLimits& limits) {
  SequenceListing listing;
  const Reach reach(graph, part);
  Lister lister(reach, limits, listing);
  if (partner >= 0) lister.list(part, [partner](int end) { return end == partner; });
  for (const ComponentType type : {ComponentType::gripper, ComponentType::ground, ComponentType::part}) {
    lister.list(part, [&](int end) { return end != partner && reach.type(end) == type; });
  }
  return listing;
}

ContactDepth contact_depth(const CollisionWorld& world, int a, int b, int& budget) {
  const double margin = world.margin();
  const auto candidates = [&](int of, int other) {
    std::vector<std::pair<const ConvexShape*, Aabb>> found;
    for (const ConvexShape& shape : world.shapes(of)) {
      const Aabb box = shape.box.at(world.pose(of), 0.5 * margin);
      if (box.overlaps(world.aabb(other))) found.emplace_back(&shape, box);
    }
    return found;
  };
  const auto shapes_b = candidates(b, a);
  ContactDepth result;
  bool measured = false;
  for (const auto& [shape_a, box_a] : candidates(a, b)) {
    for (const auto& [shape_b, box_b] : shapes_b) {
      if (!box_a.overlaps(box_b)) continue;
      if (budget <= 0) return result;
      --budget;
      const ConvexDistance d = convex_distance(*shape_a, world.pose(a), *shape_b, world.pose(b));
      if (measured && d.distance >= result.distance_m) continue;
      measured = true;
      result.distance_m = d.distance;
      result.error_m = d.error;
      result.position_W = 0.5 * (d.point_A_W + d.point_B_W);
      result.normal_W = d.normal_W;
    }
  }
  result.known = measured;
  return result;
}

}  // namespace takt
