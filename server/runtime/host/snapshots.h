#pragma once
// Snapshots of the loaded scenario: by request, and the periodic ones from which a server that starts again goes on.
// One thread: that of the host, or of CellHost::open().
#include <optional>
#include <string>

#include "server/runtime/host/scenario_slot.h"
#include "server/runtime/recording/session_store.h"
#include "server/runtime/requests/control.h"

namespace takt {

class Snapshots {
 public:
  /// All outlive it. Throws when the directory of the options cannot be made.
  Snapshots(const HostOptions& options, ScenarioSlot& slot, OutboundQueue& outbound);

  /// A server begins that does not go on from an earlier one.
  void begin();
  /// In an exchange: periodic snapshots of this scenario are written from here on; null: none is loaded.
  void attach(LoadedScenario* loaded);
  Outcome<requests::SaveSnapshot> save(const requests::SaveSnapshot& request);
  Outcome<requests::RestoreSnapshot> restore(const requests::RestoreSnapshot& request);
  /// What the earlier server had loaded.
  std::optional<Session> session() const;
  /// Loads it and goes on from its newest periodic snapshot that can be used. Says how, as the end of a sentence.
  std::string resume(const Session& session);

 private:
  /// Why not; nothing: they are.
  std::optional<Refusal> refusal(const std::string& name) const;
  Session session_of(const LoadedScenario* loaded) const;

  const HostOptions& options_;
  ScenarioSlot& slot_;
  OutboundQueue& outbound_;
  std::optional<SessionStore> store_;
};

}  // namespace takt
