#include "server/runtime/host/recordings.h"

namespace takt {
namespace {

constexpr const char* kSuffix = ".taktlog";

LogScenario logged(const LoadedScenario& loaded) {
  LogScenario result;
  if (loaded.source) result.source = *loaded.source;
  result.changes = loaded.changes;
  return result;
}

}  // namespace

std::unique_ptr<LogRecorder> Recordings::make(const std::filesystem::path& file, bool replace) const {
  RecorderOptions options;
  options.version = options_.version;
  options.cell = options_.cell;
  options.replace = replace;
  options.on_failure = [this](const std::string& sentence) {
    outbound_.events.post(events::RecordingFailed{sentence});
  };
  return std::make_unique<LogRecorder>(file, std::move(options));
}

void Recordings::open_log() {
  if (!options_.log.empty()) recorder_ = make(options_.log, true);
}

void Recordings::open_log_again() {
  if (options_.log.empty()) return;
  try {
    for (int number = 2;; ++number) {
      const std::filesystem::path file = options_.log.string() + "." + std::to_string(number);
      if (std::filesystem::exists(file)) continue;
      recorder_ = make(file, false);
      return;
    }
  } catch (const std::exception& error) {  // the server continues without its log
    outbound_.events.post(events::RecordingFailed{std::string("Nothing is recorded: ") + error.what()});
  }
}

void Recordings::begin(LoadedScenario& loaded) {
  if (!recorder_) return;
  // A state that was restored counts an epoch.
  if (const std::string refusal =
          recorder_->begin_scenario(logged(loaded), loaded.simulation, loaded.simulation.epoch() == 0);
      !refusal.empty()) {
    outbound_.events.post(events::RecordingFailed{"Nothing more is recorded: " + refusal});
    return;
  }
  loaded.loop->record_with(recorder_.get());
}

Outcome<requests::StartRecording> Recordings::start(const requests::StartRecording& request) {
  if (options_.recordings.empty())
    return Refusal{ControlResult::unsupported,
                   "This server keeps no recordings of requests; --recordings DIR says where to."};
  if (std::string refusal = SessionStore::refused_name(request.name, "recording"); !refusal.empty())
    return Refusal{ControlResult::failed, std::move(refusal)};
  if (recorder_)
    return Refusal{ControlResult::incorrect_state,
                   "It is being recorded already, to " + recorder_->file().string() +
                       (is_log_of_server() ? ", the log of the server." : "; stop_recording ends that.")};
  try {
    std::filesystem::create_directories(options_.recordings);
    recorder_ = make(std::filesystem::absolute(options_.recordings) / (request.name + kSuffix), false);
  } catch (const std::exception& error) {
    return Refusal{ControlResult::failed, std::string("Nothing is recorded: ") + error.what()};
  }
  if (const auto loaded = slot_.loaded()) {
    std::string refusal;
    const bool began = loaded->loop->between_steps([&] {
      refusal = recorder_->begin_scenario(logged(*loaded), loaded->simulation, false);
      if (refusal.empty()) loaded->loop->record_with(recorder_.get());
    });
    if (!refusal.empty()) {
      const std::filesystem::path file = recorder_->file();
      recorder_.reset();
      std::error_code ignored;
      std::filesystem::remove(file, ignored);
      return Refusal{ControlResult::failed,
                     "Nothing is recorded, as the state could not be restored: " + refusal};
    }
    if (!began) {
      recorder_.reset();
      return Refusal{ControlResult::incorrect_state, "The simulation has ended; nothing is recorded."};
    }
  }
  const std::string file = recorder_->file().string();
  return {outbound_.events.post(events::RecordingStarted{file}), {file}};
}

bool Recordings::is_log_of_server() const {
  return recorder_ && !options_.log.empty() &&
         std::filesystem::absolute(recorder_->file()) == std::filesystem::absolute(options_.log);
}

Outcome<requests::StopRecording> Recordings::stop() {
  if (!recorder_) return Refusal{ControlResult::incorrect_state, "Nothing is being recorded."};
  if (is_log_of_server())
    return Refusal{ControlResult::incorrect_state,
                   "The present recording is the log of the server (--log " + recorder_->file().string() +
                       "), which ends with the server." +
                       (recorder_->failure().empty() ? "" : " It has failed: " + recorder_->failure())};
  if (const auto loaded = slot_.loaded()) {
    // An ended loop has recorded its end already.
    (void)loaded->loop->between_steps([&] {
      recorder_->end_scenario(loaded->simulation);
      loaded->loop->record_with(nullptr);
    });
  }
  recorder_->flush();
  const std::string file = recorder_->file().string();
  std::string failure = recorder_->failure();
  const std::uint64_t records = recorder_->records(), bytes = recorder_->written_bytes();
  recorder_.reset();
  if (!failure.empty()) return Refusal{ControlResult::failed, std::move(failure)};
  return {outbound_.events.post(events::RecordingStopped{file, records}), {file, records, bytes}};
}

}  // namespace takt
