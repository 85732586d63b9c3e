#pragma once
// Explanation of one component at one time: the reason why a Part is free, grasped, placed or assembled, its
// holder, the rule that chose the holder, and the time of the decision. Plain data for users; made by
// Simulation::explain().
//
// It combines two times. Contacts, sequences and the decision are those of the newest discrete stage, at the
// beginning of the last step (decided_at_s), because they led to the present state; forces are the present
// ones.
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "server/contact/holding/component_interaction.h"
#include "server/contact/holding/partner_explanation.h"
#include "server/contact/surface/contact_sample.h"
#include "server/simulation/model/cell_description.h"
#include "server/simulation/model/snapshot.h"

namespace takt {

class StateReader;
class StateWriter;

/// The time of each Part's last change of partner, and its previous partner.
class PartnerHistory {
 public:
  struct Entry {
    double time_s = 0.0;      ///< of the decision; 0 also without a change since the reset
    std::uint64_t step = 0;   ///< first step after the decision
    int before = -1;          ///< previous partner, or -1
    std::uint64_t stage = 0;  ///< number of the discrete stage with the decision; 0: none
  };
  explicit PartnerHistory(std::size_t component_count) : entries_(component_count) {}
  void reset();
  /// After every discrete stage. Does not allocate.
  void note(double time_s, std::uint64_t step, std::span<const PartnerChange> changes);

  void save(StateWriter& out) const;
  void load(StateReader& in);

  const Entry& of(int component) const { return entries_[static_cast<std::size_t>(component)]; }
  /// The partner that the newest discrete stage found when it began.
  int before_newest(int component, int partner) const {
    return of(component).stage == newest_stage_ ? of(component).before : partner;
  }
  double newest_s() const { return newest_s_; }

 private:
  std::vector<Entry> entries_;
  std::uint64_t newest_stage_ = 0;
  double newest_s_ = 0.0;
};

/// Two components in contact.
struct ExplainedContact {
  int a = -1, b = -1;
  /// Of their convex shapes. With surface contact (`by_surface`): minus the largest penetration of the
  /// surfaces, at the centre of pressure, along the force; unknown without pressure.
  ContactDepth depth;
  bool by_surface = false;
};

/// A connection of which the component is the Base (thesis 3.4.1).
struct ExplainedConnection {
  int target = -1;
  Wrench on_base_W;                    ///< present force and moment on the Base about its centre of mass
  Vec3 feed_forward_W = Vec3::Zero();  ///< the share of the force that carries weight (N)
  double softening = 1.0;  ///< below 1: factor of the constants, because the Target has no support
};

struct Explanation {
  // Largest lengths of the lists; the counts beside the lists include omitted entries.
  static constexpr std::size_t kMaxContacts = 32;  ///< pairs of components
  static constexpr int kMaxDistances = 64;         ///< pairs of convex parts measured for all of them
  static constexpr std::size_t kMaxHeld = 100;

  int component = -1;
  ComponentType type = ComponentType::part;
  double time_s = 0.0, decided_at_s = 0.0;
  std::uint64_t step = 0;
  std::uint32_t epoch = 0;

  PartState state = PartState::fixed;
  int state_because = -1;  ///< the Gripper or Ground that holds the Part, or the Part it is assembled with
  PartnerDecision decision;
  PartnerHistory::Entry since;
  SequenceListing sequences;
  /// The contacts along the shortest sequence to the partner come first, then the component's other contacts.
  std::vector<ExplainedContact> contacts;
  std::size_t contact_count = 0;
  std::vector<ExplainedConnection> connections;
  /// Surface contact acts between this component and others (level of detail 3); Simulation::explain() adds
  /// the pairs with pressure.
  bool surface_contact = false;
  std::vector<ContactSample> pressing;
  std::vector<int> held;  ///< Parts whose partner this component is
  std::size_t held_count = 0;
};

/// Everything but time, step, epoch and surface contact. Cost: linear in the components and in the contacts
/// that the search from this Part can reach, plus the limits of ListingLimits and of Explanation.
Explanation explain_component(const std::vector<Component>& components,
                              const ComponentInteraction& interaction, const CellMotion& motion,
                              const PartnerHistory& history, int component);

/// The explanation in two or three sentences, with the names of this cell.
std::string describe(const Explanation& explanation, const CellDescription& cell);

}  // namespace takt
