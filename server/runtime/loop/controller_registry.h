#pragma once
// The registered controllers with periods and targets, and the boundaries of their periods. In lockstep the
// simulation crosses a controller's boundary only with that controller's commands (LockstepBarrier waits for
// them).
//
// Boundary number k of a controller is at the first step at or after k * period (period_boundary_step),
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
    bool late_reported = false;       ///< that it is late at this boundary
  };

  ControllerRegistry(int target_count, double step_s);

  /// Adds a controller whose next boundary is the first at or after `present_step`; replaces one of the same
  /// name and the same targets (it was restarted). Returns a sentence with the reason if this is impossible:
  /// too many controllers, another controller of that name, a target of another controller, or one target
  /// twice. The cell must have all targets.
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
