#include "server/runtime/loop/controller_registry.h"

#include <algorithm>

#include "idl/common/lockstep.h"
#include "idl/common/text.h"
#include "server/simulation/model/cell_description.h"
#include "server/simulation/model/command.h"

namespace takt {

ControllerRegistry::ControllerRegistry(int target_count, double step_s)
    : step_s_(step_s), owner_(static_cast<std::size_t>(target_count), -1) {}

std::string ControllerRegistry::add(const requests::RegisterController& request, std::uint64_t present_step,
                                    const CellDescription& cell) {
  std::vector<int> targets;
  for (const std::string& name : request.targets) {
    const int target = find_target(cell, name);
    if (std::find(targets.begin(), targets.end(), target) != targets.end())
      return "It names the target '" + name + "' twice.";
    targets.push_back(target);
    const Controller* other = owner(target);
    if (other != nullptr && other->name != request.name) {
      return "The target '" + std::string(target_name(cell, target)) +
             "' is already declared by the controller '" + other->name + "'; unregister that one first.";
    }
  }
  const auto same_name = [&](const Controller& controller) { return controller.name == request.name; };
  auto place = std::find_if(controllers_.begin(), controllers_.end(), same_name);
  std::sort(targets.begin(), targets.end());
  if (place != controllers_.end() && place->targets != targets) {
    const std::string others =
        join(place->targets, ", ", [&](int target) { return target_name(cell, target); });
    return "There is a controller '" + request.name + "' already, for " + others.substr(0, 300) +
           "; choose another name, or unregister that one first.";
  }
  if (place == controllers_.end()) {
    if (controllers_.size() == kMaxControllers) {
      return "There are already " + std::to_string(kMaxControllers) + " controllers, which is the limit.";
    }
    place = controllers_.insert(controllers_.end(), Controller{});
  }
  Controller controller;
  controller.name = request.name;
  controller.period_s = request.period;
  controller.timeout_s = request.command_timeout;
  controller.targets = std::move(targets);
  find_boundary(controller, present_step);
  *place = std::move(controller);
  index_targets();
  return {};
}

bool ControllerRegistry::remove(const std::string& name) {
  const auto same_name = [&](const Controller& controller) { return controller.name == name; };
  if (std::erase_if(controllers_, same_name) == 0) return false;
  index_targets();
  return true;
}

void ControllerRegistry::restart(std::uint64_t present_step) {
  for (Controller& controller : controllers_) find_boundary(controller, present_step);
}

void ControllerRegistry::find_boundary(Controller& controller, std::uint64_t present_step) const {
  // Estimates the number, then decides it with the one function that defines the boundaries.
  const double periods = static_cast<double>(present_step) * step_s_ / controller.period_s;
  controller.boundary = static_cast<std::uint64_t>(std::max(periods - 2.0, 0.0));
  while (period_boundary_step(controller.boundary, controller.period_s, step_s_) < present_step) {
    ++controller.boundary;
  }
  controller.boundary_step = period_boundary_step(controller.boundary, controller.period_s, step_s_);
}

void ControllerRegistry::advance(Controller& controller) {
  ++controller.boundary;
  controller.boundary_step = period_boundary_step(controller.boundary, controller.period_s, step_s_);
}

const ControllerRegistry::Controller* ControllerRegistry::owner(int target) const {
  const int index = owner_[static_cast<std::size_t>(target)];
  return index < 0 ? nullptr : &controllers_[static_cast<std::size_t>(index)];
}

void ControllerRegistry::index_targets() {
  std::fill(owner_.begin(), owner_.end(), -1);
  for (std::size_t i = 0; i < controllers_.size(); ++i) {
    for (const int target : controllers_[i].targets)
      owner_[static_cast<std::size_t>(target)] = static_cast<int>(i);
  }
}

}  // namespace takt
