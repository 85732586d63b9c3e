#pragma once
// The file of the loaded scenario as a text that clients read, check and, with HostOptions::edit, replace. One thread: that of
// the host.
#include "server/runtime/host/scenario_slot.h"
#include "server/runtime/requests/control.h"

namespace takt {

class ScenarioText {
 public:
  /// Both arguments must outlive it.
  ScenarioText(const HostOptions& options, const ScenarioSlot& slot) : options_(options), slot_(slot) {}

  Outcome<requests::GetScenarioText> get() const;
  Outcome<requests::SaveScenarioText> save(const requests::SaveScenarioText& request) const;

 private:
  const HostOptions& options_;
  const ScenarioSlot& slot_;
};

}  // namespace takt
