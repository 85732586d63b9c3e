// Snapshots by request, and going on from periodic ones in a server that starts again.
#include "idl/common/text.h"
#include "server/runtime/host/cell_host_world.h"
#include "server/runtime/host/scenario_edit.h"
#include "server/runtime/recording/snapshot_file.h"

namespace takt {
namespace {

std::string instant(const SnapshotIdentity& identity) {
  char text[80];
  std::snprintf(text, sizeof text, "%.3f s (step %llu)", identity.time_s,
                static_cast<unsigned long long>(identity.step));
  return text;
}

}  // namespace

Session CellHost::session_of(const LoadedScenario* loaded) const {
  Session session;
  if (loaded != nullptr) {
    session.source = loaded->source;
    session.changes = loaded->changes;
  }
  const std::lock_guard lock(mutex_);
  session.pace = options_.loop.pace;
  session.factor = options_.loop.factor;
  session.state = SimulationState::stopped;
  return session;
}

void CellHost::save(const Job& job, const SaveSnapshot& request) {
  const std::uint64_t id = job.request.id;
  const auto loaded = loaded_scenario();
  if (!snapshots_possible(id, request.name)) return;
  SavedState saved;
  std::string refusal;
  if (!loaded->loop.between_steps([&] { refusal = loaded->loop.save(saved); })) {
    reply(id, ControlResult::incorrect_state, "The simulation has ended; nothing was saved.");
    return;
  }
  if (!refusal.empty()) {
    reply(id, ControlResult::failed, "Nothing was saved, as it could not be restored: " + refusal);
    return;
  }
  const std::filesystem::path file = store_->file_of(request.name);
  const SnapshotResult written = write_snapshot_file(file, saved.identity, saved.bytes);
  if (!written.good()) {
    reply(id, ControlResult::failed, written.message);
    return;
  }
  const std::string message =
      "Snapshot " + request.name + " holds the state at " + instant(saved.identity) + ".";
  tell(Severity::information, "snapshot_saved", message);
  reply(id, ControlResult::ok, message,
        {{"uri", file.string()},
         {"bytes", std::to_string(saved.bytes.size())},
         {"time", exact_text(saved.identity.time_s)},
         {"step", std::to_string(saved.identity.step)}});
}

bool CellHost::snapshots_possible(std::uint64_t id, const std::string& name) {
  if (!store_) {
    reply(id, ControlResult::unsupported, "This server keeps no snapshots; --snapshots DIR says where to.");
  } else if (const std::string refusal = name.empty() ? "" : SessionStore::refused_name(name);
             !refusal.empty()) {
    reply(id, ControlResult::failed, refusal);
  } else if (!loaded_scenario()) {
    reply(id, ControlResult::incorrect_state, "No scenario is loaded; load_scenario loads one.");
  } else {
    return true;
  }
  return false;
}

void CellHost::restore(const Job& job, const RestoreSnapshot& request) {
  const std::uint64_t id = job.request.id;
  if (!snapshots_possible(id, request.name)) return;
  const auto loaded = loaded_scenario();
  std::vector<std::filesystem::path> files = store_->periodic();
  if (!request.name.empty()) files = {store_->file_of(request.name)};
  SnapshotResult result{SnapshotError::not_found, "There is no periodic snapshot yet."};
  for (const auto& file : files) {
    SnapshotFile content;
    result = read_snapshot_file(file, content);
    if (result.good()) result = check_identity(file, content.identity, loaded->simulation);
    if (!result.good()) continue;
    std::string refusal;
    std::uint32_t epoch = 0;
    const bool done = loaded->loop.between_steps([&] {
      refusal = loaded->loop.restore(content.state);
      epoch = loaded->simulation.epoch();
    });
    if (!done) refusal = "The simulation has ended; nothing was restored.";
    if (!refusal.empty()) {
      result = {SnapshotError::damaged, refusal};
      continue;
    }
    const std::string message = "The cell is back at " + instant(content.identity) + ".";
    tell(Severity::information, "snapshot_restored", message);
    reply(id, ControlResult::ok, message,
          {{"time", exact_text(content.identity.time_s)},
           {"step", std::to_string(content.identity.step)},
           {"epoch", std::to_string(epoch)}});
    return;
  }
  reply(id, result.error == SnapshotError::not_found ? ControlResult::not_found : ControlResult::failed,
        result.message);
}

void CellHost::resume(const std::string& crash, const std::optional<ScenarioSource>& otherwise) {
  const auto session = store_ ? store_->read() : std::nullopt;
  open_log_again();
  std::string how;
  if (session) {
    try {
      how = resume_session(*session);
    } catch (const std::exception& error) {
      exchange(nullptr);
      how = std::string("what was loaded could not be loaded again, so nothing is loaded: ") + error.what();
    }
  } else if (otherwise) {
    exchange(build(*otherwise));
    how = "the scenario begins anew, as there is no periodic snapshot";
  } else {
    exchange(nullptr);
    how = "no scenario is loaded";
  }
  outbound_->announcement = DiagnosticEvent{Severity::error, "restarted", options_.cell, "",
                                            "The server " + crash + " and was started again: " + how + "."};
  announces_.store(true);
  opened();
}

std::string CellHost::resume_session(const Session& session) {
  {
    const std::lock_guard lock(mutex_);
    options_.loop.pace = session.pace;
    options_.loop.factor = session.factor;
  }
  if (!session.source) {
    exchange(nullptr);
    return "no scenario is loaded, as before";
  }
  auto next = build(*session.source);
  if (!session.changes.empty()) {
    auto changed_world = build(with_changes(*next->content, session.changes));
    changed_world->source = next->source;
    changed_world->as_loaded = next->as_loaded;
    changed_world->changes = session.changes;
    next = std::move(changed_world);
  }
  std::string how = "the scenario begins anew, as no periodic snapshot can be used";
  for (const auto& file : store_->periodic()) {
    SnapshotFile content;
    SnapshotResult result = read_snapshot_file(file, content);
    if (result.good()) result = check_identity(file, content.identity, next->simulation);
    if (result.good() && next->simulation.restore_state(content.state).empty()) {
      how = "the cell goes on at " + instant(content.identity) + ", from a periodic snapshot";
      break;
    }
  }
  const SimulationState state =
      session.state == SimulationState::quitting ? SimulationState::paused : session.state;
  how += ", " + std::string(to_string(state));
  next->loop.begin_in(state);
  exchange(std::move(next));
  return how;
}

}  // namespace takt
