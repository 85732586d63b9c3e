#pragma once
// Snapshots of the loaded scenario: by request, and the periodic ones from which a restarted server resumes.
// One thread: that of the host, or of CellHost::open().
#include <optional>
#include <string>

#include "server/runtime/host/scenario_slot.h"
#include "server/runtime/recording/session_store.h"
#include "server/runtime/requests/control.h"

namespace takt {

class Snapshots {
 public:
  /// All arguments must outlive it. Throws if the directory of the options cannot be made.
  Snapshots(const HostOptions& options, ScenarioSlot& slot, OutboundQueue& outbound);

  /// Start of a server that does not resume an earlier run.
  void begin();
  /// In an exchange: later periodic snapshots are of this scenario; nullptr: no scenario.
  void attach(LoadedScenario* loaded);
  Outcome<requests::SaveSnapshot> save(const requests::SaveSnapshot& request);
  Outcome<requests::GetSnapshots> list() const;
  Outcome<requests::RestoreSnapshot> restore(const requests::RestoreSnapshot& request);
  /// Session of the previous run.
  std::optional<Session> session() const;
  /// Loads the session and resumes from its newest usable periodic snapshot. Returns the end of a sentence
  /// about it.
  std::string resume(const Session& session);

 private:
  /// Reason why snapshots are unavailable; std::nullopt: they are available.
  std::optional<Refusal> refusal(const std::string& name) const;
  Session session_of(const LoadedScenario* loaded) const;

  const HostOptions& options_;
  ScenarioSlot& slot_;
  OutboundQueue& outbound_;
  std::optional<SessionStore> store_;
};

}  // namespace takt
