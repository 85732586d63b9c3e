#pragma once
// Recordings (command_log.h) of what a server simulates, from its start or by request. One thread: that of the host,
// or of CellHost::open().
#include <filesystem>
#include <memory>

#include "server/runtime/host/scenario_slot.h"
#include "server/runtime/recording/log_recorder.h"
#include "server/runtime/requests/control.h"

namespace takt {

class Recordings {
 public:
  /// All outlive it.
  Recordings(const HostOptions& options, const ScenarioSlot& slot, OutboundQueue& outbound)
      : options_(options), slot_(slot), outbound_(outbound) {}

  /// That of the options. Throws LogError.
  void open_log();
  /// In a server that was started again: into the next free file, so that what was recorded until the crash stays.
  void open_log_again();
  /// A scenario is about to start.
  void begin(LoadedScenario& loaded);
  Outcome<requests::StartRecording> start(const requests::StartRecording& request);
  Outcome<requests::StopRecording> stop();
  /// Writes what is left. No loop is running.
  void end() { recorder_.reset(); }

 private:
  std::unique_ptr<LogRecorder> make(const std::filesystem::path& file, bool replace) const;
  bool is_log_of_server() const;  ///< what is being recorded is HostOptions::log

  const HostOptions& options_;
  const ScenarioSlot& slot_;
  OutboundQueue& outbound_;
  std::unique_ptr<LogRecorder> recorder_;
};

}  // namespace takt
