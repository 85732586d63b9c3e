#pragma once
// Recordings (command_log.h) of the simulation of a server, from its start or by request. One thread: that of
// the host, or of CellHost::open().
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

  /// Opens the log of the options. Throws LogError.
  void open_log();
  /// In a restarted server: records to the next free file, so that the recording up to the crash stays.
  void open_log_again();
  /// A scenario is about to start.
  void begin(LoadedScenario& loaded);
  Outcome<requests::StartRecording> start(const requests::StartRecording& request);
  Outcome<requests::StopRecording> stop();
  /// Writes the remaining records. No loop may run.
  void end() { recorder_.reset(); }

 private:
  std::unique_ptr<LogRecorder> make(const std::filesystem::path& file, bool replace) const;
  bool is_log_of_server() const;  ///< the present recording is HostOptions::log

  const HostOptions& options_;
  const ScenarioSlot& slot_;
  OutboundQueue& outbound_;
  std::unique_ptr<LogRecorder> recorder_;
};

}  // namespace takt
