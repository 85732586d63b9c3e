#pragma once
// The state of the cell as a program looks at it: part by part, so that what no program reads need not be made.
#include <cstddef>
#include <string_view>

#include "takt_msgs.h"

namespace takt::controller {

enum class StatePart {
  time,       ///< and the sizes of all lists
  instant,    ///< time, step, epoch, hash, and the sizes of all lists
  component,  ///< of one component: motion, state, partner
  machines,   ///< robots, grippers and devices but for forces; commands applied
  all,        ///< with forces: of components, of drives, of jaws
};

/// The part that has the field `key` of the elements of this list of the state. `all` without a key.
StatePart part_of(std::string_view list, std::string_view key);

class StateSource {
 public:
  virtual ~StateSource() = default;
  /// The state of the present instant, in which at least this part is up to date; always the same object.
  /// `component`: of StatePart::component.
  virtual const takt_msgs::msg::CellState& read(StatePart part, std::size_t component) = 0;
};

}  // namespace takt::controller
