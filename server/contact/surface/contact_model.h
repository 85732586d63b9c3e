#pragma once
// Surface contact of a whole cell, as loaded: surfaces by component, laws by pair.
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "server/components/pair_table.h"
#include "server/contact/surface/contact_law.h"
#include "server/geometry/surface/contact_surface.h"
#include "server/geometry/surface/distance_field.h"

namespace takt {

/// Force between two components whose processes have level of detail 3.
enum class PairForce : std::uint8_t {
  by_level,    ///< contact
  contact,     ///< contact at level 3, stated explicitly
  substitute,  ///< the substitute force, at every level
};

/// What pairs of the same kind have in common.
struct ContactPairKind {
  ContactLaw law;
  /// Replaces the law's coefficient of friction by a function of the temperature (K, ascending) of the hotter
  /// component: an adhesive bond releases when it is hot. Empty: independent of the temperature.
  std::vector<std::array<double, 2>> friction_at_K{};
  PairForce force = PairForce::by_level;
  DepthSource depth = DepthSource::polygonal;
};

/// One pair; the references hold as long as the pairs of the cell.
struct ContactPairModel {
  int base = -1, target = -1;  ///< component ids: whose elements, whose surface
  const ContactLaw& law;
  const std::vector<std::array<double, 2>>& friction_at_K;
  PairForce force;
  DepthSource depth;
};

/// All pairs of a cell, ordered by base, then target. Components of which a scenario says the same are of one
/// class, and a pair's kind follows from the classes of its ends: four bytes a pair, whatever is said of it.
class ContactPairs {
 public:
  ContactPairs() = default;
  /// `class_of`: by component. `kinds`: by class and class, in either order the same.
  ContactPairs(std::vector<std::int32_t> class_of, std::vector<ContactPairKind> kinds,
               std::size_t class_count)
      : class_of_(std::move(class_of)), kinds_(std::move(kinds)), class_count_(class_count) {}
  /// In ascending order.
  void add(int base, int target) { table_.add(base, target); }
  void shrink_to_fit() { table_.shrink_to_fit(); }

  std::size_t size() const { return table_.size(); }
  bool empty() const { return size() == 0; }
  const ContactPairKind& kind(int a, int b) const {
    const auto class_of = [this](int c) {
      return static_cast<std::size_t>(class_of_[static_cast<std::size_t>(c)]);
    };
    return kinds_[class_of(a) * class_count_ + class_of(b)];
  }
  ContactPairModel operator[](std::size_t pair) const {
    const int base = table_.base(pair), target = table_.target(pair);
    const ContactPairKind& of = kind(base, target);
    return {base, target, of.law, of.friction_at_K, of.force, of.depth};
  }
  PairIterator<ContactPairs> begin() const { return {*this, 0}; }
  PairIterator<ContactPairs> end() const { return {*this, size()}; }
  const PairTable& table() const { return table_; }
  std::span<const ContactPairKind> kinds() const { return kinds_; }

 private:
  PairTable table_;
  std::vector<std::int32_t> class_of_;
  std::vector<ContactPairKind> kinds_;
  std::size_t class_count_ = 0;
};

/// Parts at rest in surface contact are left out of the system until another component comes near
/// (simulation/step/threshold_sleeping.h).
struct SleepingParameters {
  bool enabled = true;
  /// A Part is at rest if no point of it is faster. It bounds the error: a Part that would have moved on at
  /// this speed is 1 um behind after 10 s.
  double speed_m_per_s = 1e-7;
  double time_to_sleep_s = 0.05;  ///< slower than that for so long, and no less than two steps
};

struct ContactModel {
  bool enabled = false;  ///< true: surfaces and pairs exist, so that level 3 is possible
  std::vector<std::shared_ptr<const ContactSurface>> surfaces;  ///< by component; nullptr: without surface
  ContactPairs pairs;
  /// Component ids of Grounds whose surface moves; each is the Target of its pairs.
  std::vector<int> belts;
  /// By component, of the Targets of pairs that take their depths from it; else nullptr, or empty.
  std::vector<std::shared_ptr<const DistanceField>> fields;
  /// Of a pair with this Target.
  std::shared_ptr<const DistanceField> field(int target, DepthSource depth) const {
    return depth == DepthSource::polygonal ? nullptr : fields[static_cast<std::size_t>(target)];
  }
  bool cache_unmoved_pairs = true;  ///< a pair that has not moved is not evaluated again (thesis 4.5)
  SleepingParameters sleeping;
  bool parallel = false;  ///< pairs are evaluated by the executor, where there is one (thesis 4.5)
};

}  // namespace takt
