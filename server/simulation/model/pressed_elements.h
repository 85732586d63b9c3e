#pragma once
// Pressure element by element (level of detail 3), for pictures: the elements of a pair's Base that have
// force, their corners and their pressure (2.17). Computed from a snapshot alone, with candidate lists of its
// own, so that it neither delays a simulation nor changes its bits.
#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "server/contact/surface/contact_model.h"
#include "server/contact/surface/polygonal_contact.h"
#include "server/simulation/model/snapshot.h"

namespace takt {

struct PressedElement {
  std::array<Vec3, 3> corner_B;  ///< frame of the Base
  double pressure_Pa = 0.0;
};

struct PressedPair {
  int base = -1, target = -1;  ///< component ids
  double largest_pressure_Pa = 0.0;
  std::vector<PressedElement> elements;  ///< by number of the Base's element
  std::size_t omitted = 0;               ///< with force too, but with less pressure than the listed ones
};

class PressedElements {
 public:
  static constexpr std::size_t kMaxPairs = 16;
  static constexpr std::size_t kMaxElements = 4096;  ///< of one pair

  /// The model must outlive it.
  explicit PressedElements(const ContactModel& model) : model_(model) {}

  /// The given pairs (indices of the model's) that press in this snapshot, at most kMaxPairs. Pairs that a
  /// call leaves out lose their caches.
  const std::vector<PressedPair>& read(const Snapshot& snapshot, std::span<const std::size_t> pairs);

 private:
  void read_pair(const Snapshot& snapshot, std::size_t pair, PressedPair& pressed);

  const ContactModel& model_;
  std::map<std::size_t, PolygonalContact> contacts_;
  std::vector<PressedPair> result_;
};

}  // namespace takt
