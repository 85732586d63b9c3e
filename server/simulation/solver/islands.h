#pragma once
// Islands of a cell: the models that may act on each other within one step. Forces between islands are zero
// during the step, so that a solver may integrate each alone with steps of its own, to the same solution.
//
// Models are joined where a connection holds them together, and where the surfaces of two may meet within the
// step at the present velocities. Of all other near pairs a guard is kept: an axis on which the bounds of the
// two are apart. The bounds at each motion from which an accepted step took forces are compared along this axis
// afterwards: a pair whose bounds have met joins its islands, which are then integrated again. The result
// depends on the states alone.
//
// Islands that are integrated again begin as if they had not been: with the states, step sizes and held patches of the
// beginning. They move as in a cell that is one island, bit for bit.
//
// A cell is one island if force elements act in it, if a model has indicators, or if a model has states but no
// velocity form: such a model may depend on the motion of any other.
#include <array>
#include <span>
#include <vector>

#include "idl/common/disjoint_sets.h"
#include "server/simulation/solver/ode_system.h"

namespace takt {

class Islands {
 public:
  /// Memory grows only where the list of near pairs has outgrown its room (ContactInteraction::update).
  /// `unit_of_body`: index of the segment that moves a body, or -1.
  Islands(const OdeSystem& system, std::span<const int> unit_of_body);

  /// Discrete: the islands of the system's awake models for a step of h from (t, x), to which the motion is brought. All
  /// are new. Returns their number; 0: the cell is one island.
  std::size_t find(OdeSystem& system, double t, double h, std::span<const double> x);
  std::size_t count() const { return begin_.empty() ? 0 : begin_.size() - 1; }
  /// Segments of an island with states, ascending.
  std::span<const std::size_t> segments(std::size_t island) const {
    return std::span(members_).subspan(begin_[island], begin_[island + 1] - begin_[island]);
  }
  /// Not integrated since find() or join_met() made it.
  bool is_new(std::size_t island) const { return new_[members_[begin_[island]]] != 0; }

  /// While it exists, the system has this island alone, and its motions are watched.
  class Attention {
   public:
    Attention(Islands& islands, OdeSystem& system, std::size_t island) : islands_(islands), system_(system) {
      islands.attend(system, island);
    }
    ~Attention() {
      system_.attend_all();
      islands_.guards_ = {};
    }
    Attention(const Attention&) = delete;
    Attention& operator=(const Attention&) = delete;

   private:
    Islands& islands_;
    OdeSystem& system_;
  };

  /// Of the island in attention: the segments that are integrated at present.
  static constexpr std::size_t kLevels = 6;
  std::span<const std::size_t> attended() const { return levels_[level_].segments; }
  /// Whether a part of them may be refined.
  bool can_refine() const { return level_ + 1 < kLevels; }
  /// After a trial: these of the attended segments, at most half, are integrated again alone, while the others that they can
  /// touch follow their courses. The trial's motions are accepted of the others.
  void refine(OdeSystem& system, std::span<const std::size_t> segments, const OdeSystem::Courses& courses);
  /// Those that were attended before the last refine().
  void resume(OdeSystem& system);
  /// Adds to a list of attended segments those to which connections join them.
  void add_connected(const OdeSystem& system, std::vector<std::size_t>& segments);

  /// A motion of the island in attention, from which forces are taken.
  void watch(const CellMotion& motion);
  /// The motions watched since the last call belong to an accepted step, or to a rejected one.
  void accept();
  void reject();
  /// Joins islands whose bounds have met. False: none have.
  bool join_met();

 private:
  /// A pair that may act within the step.
  struct Link {
    PairContact* contact;
    int units[2];    ///< -1: not an awake model with states
    Vec3 axis;       ///< of the guard, from the first to the second
    double ends[2];  ///< how far the bounds of the two have reached towards each other
    double tried[2];
  };
  struct Side {
    std::size_t island, link;
    int which;
    bool operator<(const Side& other) const {
      return island != other.island ? island < other.island : link < other.link;
    }
  };

  /// What is integrated: an island, or a part of the level before.
  struct Level {
    std::vector<std::size_t> segments, links;
    std::vector<PairContact*> pairs;
    std::vector<int> ends;
    std::vector<Side> guards;
    std::vector<std::size_t> following;
  };

  void attend(OdeSystem& system, std::size_t island);
  void attend_level(OdeSystem& system);
  int unit_of(int component) const {
    const int unit = component < 0 ? -1 : unit_of_body_[static_cast<std::size_t>(component)];
    return unit >= 0 && awake_[static_cast<std::size_t>(unit)] != 0 ? unit : -1;
  }
  void guard(const OdeSystem& system, Link& link, double h);
  void sort_members();
  bool is_cross(const Link& link) {
    return link.units[0] >= 0 && link.units[1] >= 0 && sets_.root(link.units[0]) != sets_.root(link.units[1]);
  }
  double reach_m(const CellMotion& motion, const Link& link, int which) const;

  const ContactInteraction* contacts_ = nullptr;
  bool possible_ = true;
  std::vector<int> unit_of_body_;
  std::vector<char> awake_, new_;         ///< by segment
  std::vector<std::size_t> island_;       ///< by segment
  std::vector<std::size_t> with_states_;  ///< awake segments
  DisjointSets sets_;                     ///< of segments
  std::vector<Link> links_;
  std::vector<std::size_t> members_, begin_;  ///< segments by island
  std::vector<Side> inner_, outer_;           ///< links within islands, and between them
  std::span<const Side> guards_;              ///< of the island in attention
  std::array<Level, kLevels> levels_;         ///< likewise
  std::size_t level_ = 0;
  const OdeSystem::Courses* courses_ = nullptr;
  std::vector<std::size_t> level_of_;  ///< by segment
  std::vector<char> marked_;           ///< by segment
};

}  // namespace takt
