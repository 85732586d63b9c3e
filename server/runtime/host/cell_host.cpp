#include "server/runtime/host/allowed_files.h"
#include "server/runtime/host/cell_host_world.h"

#include <algorithm>
#include <utility>

#include "idl/common/text.h"
#include "server/geometry/mesh/import.h"
#include "server/runtime/recording/log_recorder.h"
#include "server/scenario/scenario_builder.h"
#include "server/scenario/urdf_robot.h"

namespace takt {

CellHost::CellHost(HostOptions options) : options_(std::move(options)) {
  options_.loop.outbound = outbound_;
  if (!options_.snapshots.empty()) store_.emplace(options_.snapshots, options_.cell);
  if (options_.threads > 1) pool_.emplace(options_.threads, options_.loop.realtime_priority);
  thread_ = std::thread([this] { run(); });
}

CellHost::~CellHost() {
  stop();
}

void CellHost::set_observer(CellLifecycleListener* observer) {
  observer_ = observer;
}

std::shared_ptr<CellHost::LoadedScenario> CellHost::make_loaded(std::shared_ptr<CellModel> model,
                                                                double duration_s) {
  model->description.cell = options_.cell;
  model->description.scenario_generation = scenarios_loaded_ + 1;
  if (observer_ != nullptr) observer_->check(model->description);
  RunLoopOptions options = options_.loop;
  options.start_stopped = scenarios_loaded_ > 0;
  if (options_.end_at_duration && duration_s > 0.0) options.pause_at_s = duration_s;
  return std::make_shared<LoadedScenario>(std::move(model), pool_ ? &*pool_ : nullptr, std::move(options));
}

std::shared_ptr<CellHost::LoadedScenario> CellHost::build(const Scenario& scenario) {
  const auto on_import = [this](const std::string& component, double part) {
    {
      const std::lock_guard lock(mutex_);
      if (stop_) throw std::runtime_error("The server ends; the import was given up.");
    }
    if (options_.on_import) options_.on_import(component, part);
  };
  auto model =
      std::make_shared<CellModel>(*build_cell(scenario, {options_.cache_directory, nullptr, on_import}));
  for (const ImportNote& note : model->import_notes) {
    if (options_.on_note) options_.on_note(note.sentence);
    outbound_->events.post({Severity::warning, "import_note", note.component, "", note.sentence});
  }
  auto loaded = make_loaded(std::move(model), scenario.duration_s);
  loaded->as_loaded = loaded->content = scenario;
  return loaded;
}

std::shared_ptr<CellHost::LoadedScenario> CellHost::build(const ScenarioSource& source) {
  auto loaded = build(read_scenario(source.file, source.options));
  loaded->source = source;
  // A server that starts again may have another working directory.
  loaded->source->file = std::filesystem::absolute(source.file);
  return loaded;
}

void CellHost::open(const ScenarioSource& source) {
  auto first = build(source);
  if (store_) store_->begin();
  open_log();
  exchange(std::move(first));
  opened();
}

void CellHost::open(std::shared_ptr<const CellModel> model) {
  auto first = make_loaded(std::make_shared<CellModel>(*model), 0.0);
  if (store_) store_->begin();
  open_log();
  exchange(std::move(first));
  opened();
}

void CellHost::open_empty() {
  if (store_) store_->begin();
  open_log();
  exchange(nullptr);
  opened();
}

void CellHost::opened() {
  const std::lock_guard lock(mutex_);
  opened_ = true;
  busy_with_.clear();
}

void CellHost::exchange(std::shared_ptr<LoadedScenario> next, std::optional<SimulationState> kept_state) {
  std::shared_ptr<LoadedScenario> old;
  {
    const std::lock_guard lock(mutex_);
    old = std::exchange(loaded_, nullptr);
  }
  if (old) {
    old->loop.stop();
    {
      const std::lock_guard lock(mutex_);
      options_.loop.pace = old->loop.pace();
      options_.loop.factor = old->loop.pace_factor();
    }
    if (next && kept_state) next->loop.inherit_from(old->loop, *kept_state);
    if (observer_ != nullptr) observer_->closed(old->loop);
    old.reset();
  }
  if (next) {
    ++scenarios_loaded_;
    if (!kept_state) next->loop.begin_with(options_.loop.pace, options_.loop.factor);
    next->loop.set_on_quit(on_quit_);
    if (observer_ != nullptr) observer_->opened(next->loop);
    if (store_ && options_.loop.save_every_s > 0.0)
      next->writer.emplace(next->loop, *store_, session_of(next.get()));
    record(*next);
    const std::lock_guard lock(mutex_);
    loaded_ = next;
    if (!stop_) next->loop.start();
  } else if (observer_ != nullptr) {
    CellDescription nothing;
    nothing.cell = options_.cell;
    nothing.scenario_generation = ++scenarios_loaded_;
    observer_->idle(nothing);
  }
  if (store_ && !next) {
    const std::string failure = store_->write(session_of(nullptr));
    if (!failure.empty()) tell(Severity::error, "snapshot_failed", failure);
  }
  outbound_->news.post();
}

bool CellHost::try_exchange(std::uint64_t id, std::shared_ptr<LoadedScenario> next,
                            std::optional<SimulationState> kept_state) {
  try {
    exchange(std::move(next), kept_state);
    return true;
  } catch (const std::exception& error) {
    exchange(nullptr);
    const std::string message =
        std::string("The scenario was read but cannot be shown outside; none is loaded now: ") + error.what();
    tell(Severity::error, "scenario_refused", message);
    reply(id, ControlResult::failed, message);
    return false;
  }
}

void CellHost::submit(const ControlRequest& request) {
  const auto loaded = loaded_scenario();
  if (auto parsed = parse_host_request(request, loaded && !loaded->changes.empty())) {
    if (auto* answer = std::get_if<ControlReply>(&*parsed)) {
      outbound_->add_reply(std::move(*answer));
      return;
    }
    if (const auto* to_watch = std::get_if<WatchPressures>(&std::get<HostAction>(*parsed))) {
      if (loaded)
        outbound_->add_reply(loaded->loop.pressures().watch(request.id, *to_watch, monotonic_now_ns()));
      else
        answer_without_scenario(request);
      return;
    }
    const std::string refusal = confine(std::get<HostAction>(*parsed), options_.scenarios);
    if (!refusal.empty()) {
      reply(request.id, ControlResult::failed, refusal);
      return;
    }
    std::string busy;
    {
      const std::lock_guard lock(mutex_);
      busy = stop_ ? "ending" : busy_with_;
      if (busy.empty()) {
        job_ = Job{request, std::get<HostAction>(std::move(*parsed))};
        busy_with_ = "working on " + request.request;
      }
    }
    if (busy.empty()) {
      news_.notify_all();
      outbound_->news.post();
    } else {
      reply(request.id, ControlResult::incorrect_state,
            "The server is " + busy + "; ask again when that is done.");
    }
    return;
  }
  if (loaded) {
    loaded->loop.submit(request);
  } else {
    answer_without_scenario(request);
  }
}

void CellHost::answer_without_scenario(const ControlRequest& request) {
  const SimulationState state = state_without_scenario();
  const auto parsed = parse(request, CellDescription{});
  const auto* action = std::get_if<ControlAction>(&parsed);
  const auto* to_state = action == nullptr ? nullptr : std::get_if<SetState>(action);
  const bool is_of_host =
      std::find(kHostRequests.begin(), kHostRequests.end(), request.request) != kHostRequests.end();
  if (to_state != nullptr && to_state->state == SimulationState::quitting) {
    reply(request.id, ControlResult::ok, "The server ends.", {{"state", "3"}});
    if (on_quit_) on_quit_();
  } else if (!is_known_request(request.request) && !is_of_host) {
    outbound_->add_reply(unknown_request_reply(request));
  } else if (request.request == "get_features") {
    outbound_->add_reply(features_reply(request.id));
  } else if (request.request == "get_state") {
    const LoopStatus status = idle_status().value_or(LoopStatus{});
    reply(request.id, ControlResult::ok, "The server is " + std::string(words_of(state)) + ".",
          {{"state", std::to_string(static_cast<int>(state))},
           {"state_name", std::string(to_string(state))},
           {"pace", std::string(to_string(status.pace))},
           {"factor", exact_text(status.pace_factor)},
           {"time", "0"},
           {"step", "0"},
           {"epoch", "0"},
           {"fault", ""}});
  } else {
    reply(request.id, ControlResult::incorrect_state,
          state == SimulationState::loading_world ? "A scenario is being loaded; ask again when it is there."
                                                  : "No scenario is loaded; load_scenario loads one.");
  }
}

void CellHost::run() {
  std::unique_lock lock(mutex_);
  for (;;) {
    news_.wait(lock, [&] { return stop_ || job_; });
    if (stop_) return;
    const Job job = *job_;
    lock.unlock();
    execute(job);
    lock.lock();
  }
}

void CellHost::execute(const Job& job) {
  const std::uint64_t id = job.request.id;
  if (const auto* to_load = std::get_if<LoadScenario>(&job.action)) {
    load(id, {to_load->file, to_load->options});
  } else if (std::holds_alternative<ReloadScenario>(job.action)) {
    const auto loaded = loaded_scenario();
    if (loaded && loaded->source) {
      load(id, *loaded->source);
    } else {
      reply(id, ControlResult::no_world_loaded,
            "No scenario was loaded from a file; there is none to load again.");
    }
  } else if (const auto* to_reset = std::get_if<ResetSpawned>(&job.action)) {
    reset_spawned(job, *to_reset);
  } else if (const auto* to_save = std::get_if<SaveSnapshot>(&job.action)) {
    save(job, *to_save);
  } else if (const auto* to_restore = std::get_if<RestoreSnapshot>(&job.action)) {
    restore(job, *to_restore);
  } else if (const auto* to_record = std::get_if<StartRecording>(&job.action)) {
    start_recording(job, *to_record);
  } else if (std::holds_alternative<StopRecording>(job.action)) {
    stop_recording(job);
  } else if (std::holds_alternative<UnloadScenario>(job.action)) {
    unload(id);
  } else {
    change(job);
  }
}

void CellHost::load(std::uint64_t id, const ScenarioSource& source) {
  auto built = try_build(source);
  if (const auto* refusal = std::get_if<HostRefusal>(&built)) {
    tell(Severity::warning, "scenario_refused", refusal->message);
    reply(id, refusal->result, refusal->message);
    return;
  }
  if (!try_exchange(id, std::get<std::shared_ptr<LoadedScenario>>(std::move(built)), std::nullopt)) return;
  const CellDescription& cell = loop()->cell();
  const std::string message = "Scenario " + cell.scenario +
                              " is loaded: " + std::to_string(cell.components.size()) + " components, " +
                              std::to_string(cell.robots.size()) + " robots; the simulation is stopped.";
  tell(Severity::information, "scenario_loaded", message);
  reply(id, ControlResult::ok, message,
        {{"scenario", cell.scenario},
         {"uri", source.file.string()},
         {"scenario_generation", std::to_string(cell.scenario_generation)},
         {"state", std::to_string(static_cast<int>(SimulationState::stopped))}});
}

std::variant<std::shared_ptr<CellHost::LoadedScenario>, HostRefusal> CellHost::try_build(
    const ScenarioSource& source) {
  const auto refused = [](ControlResult result, const std::exception& error) {
    return HostRefusal{result, error.what()};
  };
  std::error_code unreadable;
  if (!std::filesystem::exists(source.file, unreadable)) {
    return HostRefusal{ControlResult::not_found, "There is no file " + source.file.string() +
                                                     ", seen from the working directory of the server."};
  }
  try {
    return build(source);
  } catch (const MissingFileError& error) {
    return refused(ControlResult::missing_assets, error);
  } catch (const ScenarioError& error) {
    return refused(ControlResult::resource_parse_error, error);
  } catch (const MeshError& error) {
    return refused(ControlResult::unsupported_assets, error);
  } catch (const UrdfError& error) {
    return refused(ControlResult::unsupported_assets, error);
  } catch (const std::exception& error) {
    return refused(ControlResult::failed, error);
  }
}

void CellHost::unload(std::uint64_t id) {
  if (!loaded_scenario()) {
    reply(id, ControlResult::no_world_loaded, "No scenario is loaded.");
    return;
  }
  const std::string name = loop()->cell().scenario;
  exchange(nullptr);
  const std::string message = "Scenario " + name + " was unloaded; none is loaded now.";
  tell(Severity::information, "scenario_unloaded", message);
  reply(id, ControlResult::ok, message,
        {{"state", std::to_string(static_cast<int>(SimulationState::no_world))}});
}

void CellHost::give_up() {
  const std::lock_guard lock(mutex_);
  stop_ = true;
}

void CellHost::stop() {
  std::shared_ptr<LoadedScenario> loaded;
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
    loaded = loaded_;
  }
  news_.notify_all();
  if (loaded) loaded->loop.stop();
  if (thread_.joinable()) thread_.join();
  end_recording();
}

void CellHost::reply(std::uint64_t id, ControlResult result, std::string message, TextArguments values) {
  {
    const std::lock_guard lock(mutex_);
    if (job_ &&
        job_->request.id == id) {  // before the reply is out: whoever has it may ask for the next thing
      job_.reset();
      busy_with_.clear();
    }
  }
  outbound_->add_reply({id, result, std::move(message), std::move(values)});
}

void CellHost::tell(Severity severity, std::string code, std::string message) {
  outbound_->events.post({severity, std::move(code), options_.cell, "", std::move(message)});
}

SimulationState CellHost::state_without_scenario() const {
  const std::lock_guard lock(mutex_);
  const bool loading = !opened_ || (job_ && !std::holds_alternative<UnloadScenario>(job_->action));
  return loading ? SimulationState::loading_world : SimulationState::no_world;
}

std::optional<LoopStatus> CellHost::idle_status() const {
  if (loaded_scenario()) return std::nullopt;
  LoopStatus status;
  status.state = state_without_scenario();
  const std::lock_guard lock(mutex_);
  status.pace = options_.loop.pace;
  status.pace_factor = options_.loop.factor;
  status.wall_time_s = static_cast<double>(monotonic_now_ns() - outbound_->began_ns) * 1e-9;
  return status;
}

std::shared_ptr<CellHost::LoadedScenario> CellHost::loaded_scenario() const {
  const std::lock_guard lock(mutex_);
  return loaded_;
}

RunLoop* CellHost::loop() const {
  const auto loaded = loaded_scenario();
  return loaded ? &loaded->loop : nullptr;
}

const Simulation* CellHost::simulation() const {
  const auto loaded = loaded_scenario();
  return loaded ? &loaded->simulation : nullptr;
}

}  // namespace takt
