// Recordings (command_log.h) of what a server simulates, from its start or by request.
#include "server/runtime/host/cell_host_world.h"
#include "server/runtime/recording/log_recorder.h"

namespace takt {

namespace {
constexpr const char* kSuffix = ".taktlog";
}  // namespace

LogScenario CellHost::logged_scenario(const LoadedScenario& loaded) {
  LogScenario logged;
  if (loaded.source) logged.source = *loaded.source;
  logged.changes = loaded.changes;
  return logged;
}

std::unique_ptr<LogRecorder> CellHost::make_recorder(const std::filesystem::path& file, bool replace) {
  RecorderOptions options;
  options.version = options_.version;
  options.cell = options_.cell;
  options.replace = replace;
  options.on_failure = [this](const std::string& sentence) {
    tell(Severity::error, "recording_failed", sentence);
  };
  return std::make_unique<LogRecorder>(file, std::move(options));
}

void CellHost::open_log() {
  if (!options_.log.empty()) recorder_ = make_recorder(options_.log, true);
}

void CellHost::open_log_again() {
  if (options_.log.empty()) return;
  // What was recorded until the crash stays.
  try {
    for (int number = 2;; ++number) {
      const std::filesystem::path file = options_.log.string() + "." + std::to_string(number);
      if (std::filesystem::exists(file)) continue;
      recorder_ = make_recorder(file, false);
      return;
    }
  } catch (const std::exception& error) {  // a server that goes on is worth more than its log
    tell(Severity::error, "recording_failed", std::string("Nothing is recorded: ") + error.what());
  }
}

void CellHost::record(LoadedScenario& loaded) {
  if (!recorder_) return;
  // A state that was restored counts an epoch.
  if (const std::string refusal = recorder_->begin_scenario(logged_scenario(loaded), loaded.simulation,
                                                            loaded.simulation.epoch() == 0);
      !refusal.empty()) {
    tell(Severity::error, "recording_failed", "Nothing more is recorded: " + refusal);
    return;
  }
  loaded.loop.record_with(recorder_.get());
}

void CellHost::end_recording() {
  recorder_.reset();
}

void CellHost::start_recording(const Job& job, const StartRecording& request) {
  const std::uint64_t id = job.request.id;
  if (options_.recordings.empty()) {
    reply(id, ControlResult::unsupported,
          "This server keeps no recordings of requests; --recordings DIR says where to.");
    return;
  }
  if (const std::string refusal = SessionStore::refused_name(request.name, "recording"); !refusal.empty()) {
    reply(id, ControlResult::failed, refusal);
    return;
  }
  if (recorder_) {
    reply(id, ControlResult::incorrect_state,
          "It is being recorded already, to " + recorder_->file().string() +
              (is_own_log() ? ", the log of the server." : "; stop_recording ends that."));
    return;
  }
  try {
    std::filesystem::create_directories(options_.recordings);
    recorder_ =
        make_recorder(std::filesystem::absolute(options_.recordings) / (request.name + kSuffix), false);
  } catch (const std::exception& error) {
    reply(id, ControlResult::failed, std::string("Nothing is recorded: ") + error.what());
    return;
  }
  if (const auto loaded = loaded_scenario()) {
    const LogScenario what = logged_scenario(*loaded);
    std::string refusal;
    const bool began = loaded->loop.between_steps([&] {
      refusal = recorder_->begin_scenario(what, loaded->simulation, false);
      if (refusal.empty()) loaded->loop.record_with(recorder_.get());
    });
    if (!refusal.empty()) {
      const std::filesystem::path file = recorder_->file();
      recorder_.reset();
      std::error_code ignored;
      std::filesystem::remove(file, ignored);
      reply(id, ControlResult::failed, "Nothing is recorded, as the state could not be restored: " + refusal);
      return;
    }
    if (!began) {
      recorder_.reset();
      reply(id, ControlResult::incorrect_state, "The simulation has ended; nothing is recorded.");
      return;
    }
  }
  const std::string message = "It is being recorded to " + recorder_->file().string() + ".";
  tell(Severity::information, "recording_started", message);
  reply(id, ControlResult::ok, message, {{"uri", recorder_->file().string()}});
}

bool CellHost::is_own_log() const {
  return recorder_ && !options_.log.empty() &&
         std::filesystem::absolute(recorder_->file()) == std::filesystem::absolute(options_.log);
}

void CellHost::stop_recording(const Job& job) {
  const std::uint64_t id = job.request.id;
  if (!recorder_) {
    reply(id, ControlResult::incorrect_state, "Nothing is being recorded.");
    return;
  }
  if (is_own_log()) {
    reply(id, ControlResult::incorrect_state,
          "What is recorded is the log of the server (--log " + recorder_->file().string() +
              "), which ends with the server." +
              (recorder_->failure().empty() ? "" : " It has failed: " + recorder_->failure()));
    return;
  }
  if (const auto loaded = loaded_scenario()) {
    // A loop that has ended has said so in the recording.
    (void)loaded->loop.between_steps([&] {
      recorder_->end_world(loaded->simulation);
      loaded->loop.record_with(nullptr);
    });
  }
  recorder_->flush();
  const std::string file = recorder_->file().string(), failure = recorder_->failure();
  const std::uint64_t records = recorder_->records(), bytes = recorder_->written_bytes();
  recorder_.reset();
  if (!failure.empty()) {
    reply(id, ControlResult::failed, failure);
    return;
  }
  const std::string message = file + " holds " + std::to_string(records) + " records.";
  tell(Severity::information, "recording_stopped", message);
  reply(id, ControlResult::ok, message,
        {{"uri", file}, {"records", std::to_string(records)}, {"bytes", std::to_string(bytes)}});
}

}  // namespace takt
