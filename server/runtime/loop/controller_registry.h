#pragma once
// The controllers that declared a period and targets, and the boundaries of their periods. In lockstep the
// simulation crosses a controller's boundary only with that controller's commands (RunLoop does the waiting).
//
// Boundary number k of a controller lies at the first step not before k * period (period_boundary_step),
// counted from t = 0, which is boundary 0.
#include <cstdint>
#include <string>
#include <vector>

#include "server/runtime/requests/control.h"

namespace takt {

class ControllerRegistry {
 public:
  static constexpr std::size_t kMaxControllers = 16;

  struct Controller {
    std::string name;
    double period_s = 0.0;
    double timeout_s = 0.0;
    std::vector<int> targets;         ///< in ascending order
    std::uint64_t boundary = 0;       ///< number of the next boundary
    std::uint64_t boundary_step = 0;  ///< and the step it lies at
    bool late_told = false;           ///< that it is late at this boundary
  };

  ControllerRegistry(int target_count, double step_s);

  /// Adds a controller whose next boundary is the first at or after `present_step`; one of the same name and
  /// the same targets is replaced (it was started anew). Returns a sentence when that is not possible: too
  /// many controllers, another one of that name, a target that another one has declared, or one twice. The
  /// cell has all targets.
  std::string add(const requests::RegisterController& request, std::uint64_t present_step,
                  const CellDescription& cell);
  bool remove(const std::string& name);

  /// The present step is another one: every controller's next boundary is the first at or after it.
  void restart(std::uint64_t present_step);
  /// The controller's boundary was crossed.
  void advance(Controller& controller);

  std::vector<Controller>& controllers() { return controllers_; }
  const std::vector<Controller>& controllers() const { return controllers_; }
  /// The controller that declared the target, or nullptr.
  const Controller* owner(int target) const;

 private:
  void index_targets();
  /// The first one at or after the step.
  void find_boundary(Controller& controller, std::uint64_t present_step) const;

  double step_s_;
  std::vector<Controller> controllers_;
  std::vector<int> owner_;  // per target: index of its controller, or -1
};

}  // namespace takt
