#pragma once
// Contacts of the pairs that may touch: made when a pair comes near for the first time, and used again.
//
// A pair that comes near takes a contact, and gives it back when it leaves. A contact whose bounds have met keeps its
// buffers for the pair, so that a second meeting allocates nothing; of these a number in proportion to the components
// is kept. The others serve any pair. The pool grows when it is empty: its size follows the largest number of pairs
// that were near at the same time.
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "plant_models/plant_model.h"
#include "server/contact/surface/contact_model.h"
#include "server/contact/surface/force_history.h"
#include "server/contact/surface/polygonal_contact.h"

namespace takt {

/// Calls of the contact algorithm since the last reset, as in Table 5.4.
struct ContactCallCounts {
  std::uint64_t made = 0, skipped = 0;
  std::uint64_t boxes_apart = 0;  ///< pairs skipped because their bounds are apart
  std::uint64_t rebuilds = 0;     ///< of candidate lists
  std::uint64_t elements = 0;     ///< elements with force, over all calls
};

/// A pair with its contact.
struct PairContact {
  explicit PairContact(PolygonalContact of) : contact(std::move(of)) {}

  void note_depth() { deep = deep || result.largest_penetration_m > deep_m; }
  void forget() {
    contact.reset();
    known = frozen = false;
    peak = {};
  }
  /// Notes the last result as one at an accepted point, since the update with this number.
  void note_peak(std::uint64_t update, double time_s, const Pose& X_WT);
  /// Keeps the peak and from which the patch that is held follows, for a step that may be taken again.
  void keep() {
    kept_peak = peak;
    const HeldFrom* const from = contact.held_from();
    kept_holds = from != nullptr;
    if (kept_holds) kept_from = *from;
  }
  /// The counterpart of keep().
  void restore_kept() {
    peak = kept_peak;
    const HeldFrom* const from = contact.held_from();
    const bool holds = from != nullptr;
    if (holds == kept_holds &&
        (!holds || (from->most_s == kept_from.most_s && same_bits(from->motion, kept_from.motion))))
      return;
    kept_holds ? contact.hold_from(kept_from) : contact.release();
    known = false;
  }

  std::size_t number = 0;  ///< of the pair
  int base = -1, target = -1;
  const ContactPairKind* kind = nullptr;
  PolygonalContact contact;
  // The last call, which is not repeated with the same input.
  RelativeMotion at;
  bool known = false;
  bool uncounted = false;  ///< evaluated for a report, not for a solver
  bool still = false;      ///< neither side can move
  bool frozen = false;     ///< the last call is that of the place where both sides lie still
  bool deep = false;       ///< an evaluation since passing() found it beyond `deep_m`
  double deep_m = 0.0;
  bool kept_holds = false;
  HeldFrom kept_from;
  ContactResult result;
  // The largest normal force since the update with this number, at an accepted point or between two. Not saved: after a
  // restart four points pass before one between two is found.
  struct Peak {
    std::uint64_t update = 0;
    double time_s = 0.0;
    Pose X_WT{};
    ContactResult result;
    ForceHistory history;
  } peak, kept_peak;
  std::uint64_t made = 0, skipped = 0, apart = 0;
  std::uint64_t given_back = 0;  ///< the order
};

class ContactPool {
 public:
  /// `model` must outlive this.
  ContactPool(const ContactModel& model, std::size_t component_count);

  /// Allocates if all contacts are in use.
  PairContact& take(std::size_t number, int base, int target);
  void give_back(PairContact& pair);
  /// All contacts in use, and those kept for a pair.
  template <class Visit>
  void for_each(const Visit& visit) const {
    for (const auto& pair : made_)
      if (pair->number != PairTable::kNone) visit(*pair);
  }
  /// Sets the temperatures on which coefficients of friction depend.
  void update_friction(std::span<const BodyHeat> heat);

  void reset_counts();
  /// boxes_apart: of the pairs that had a contact.
  ContactCallCounts counts() const;
  /// All contacts, and those of them with buffers.
  std::size_t size() const { return made_.size(); }
  std::size_t with_buffers() const;

 private:
  void grow(std::size_t count);
  void drop(PairContact& pair);
  void set_friction(PairContact& pair) const;

  const ContactModel& model_;
  std::size_t most_kept_;
  bool depends_on_heat_ = false;
  std::vector<BodyHeat> heat_;
  std::vector<std::unique_ptr<PairContact>> made_;
  std::vector<PairContact*> free_;
  std::vector<PairContact*> kept_;  ///< by pair, ascending
  std::uint64_t given_back_ = 0;
  ContactCallCounts earlier_;  ///< of pairs that have no contact
};

}  // namespace takt
