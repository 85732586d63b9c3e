#include "server/runtime/host/snapshots.h"

#include <utility>

#include "idl/common/text.h"
#include "server/runtime/recording/snapshot_file.h"

namespace takt {
namespace {

std::string instant(const SnapshotIdentity& identity) {
  return fixed_text(identity.time_s, 3) + " s (step " + std::to_string(identity.step) + ")";
}

Refusal no_directory() {
  return {ControlResult::unsupported, "This server keeps no snapshots; --snapshots DIR says where to."};
}

}  // namespace

Snapshots::Snapshots(const HostOptions& options, ScenarioSlot& slot, OutboundQueue& outbound)
    : options_(options), slot_(slot), outbound_(outbound) {
  if (!options_.snapshots.empty()) store_.emplace(options_.snapshots, options_.cell);
}

void Snapshots::begin() {
  if (store_) store_->begin();
}

Session Snapshots::session_of(const LoadedScenario* loaded) const {
  Session session;
  if (loaded != nullptr) {
    session.source = loaded->source;
    session.changes = loaded->changes;
  }
  session.pace = slot_.pace();
  session.factor = slot_.pace_factor();
  session.state = SimulationState::stopped;
  return session;
}

void Snapshots::attach(LoadedScenario* loaded) {
  if (!store_) return;
  if (loaded != nullptr) {
    if (options_.loop.save_every_s > 0.0) loaded->writer.emplace(*loaded->loop, *store_, session_of(loaded));
    return;
  }
  if (const std::string failure = store_->write(session_of(nullptr)); !failure.empty())
    outbound_.events.post(events::SnapshotFailed{failure});
}

std::optional<Refusal> Snapshots::refusal(const std::string& name) const {
  if (!store_) return no_directory();
  if (std::string refused = name.empty() ? "" : SessionStore::refused_name(name); !refused.empty())
    return Refusal{ControlResult::failed, std::move(refused)};
  if (!slot_.loaded())
    return Refusal{ControlResult::incorrect_state, "No scenario is loaded; load_scenario loads one."};
  return std::nullopt;
}

Outcome<requests::SaveSnapshot> Snapshots::save(const requests::SaveSnapshot& request) {
  if (auto refused = refusal(request.name)) return *std::move(refused);
  const auto loaded = slot_.loaded();
  SavedState saved;
  std::string why;
  if (!loaded->loop->between_steps([&] { why = loaded->loop->saver().save(saved); }))
    return Refusal{ControlResult::incorrect_state, "The simulation has ended; nothing was saved."};
  if (!why.empty())
    return Refusal{ControlResult::failed, "Nothing was saved, as it could not be restored: " + why};
  const std::filesystem::path file = store_->file_of(request.name);
  SnapshotResult written = write_snapshot_file(file, saved.identity, saved.bytes);
  if (!written.good()) return Refusal{ControlResult::failed, std::move(written.message)};
  const double time_s = saved.identity.time_s;
  const std::uint64_t step = saved.identity.step;
  return {outbound_.events.post(events::SnapshotSaved{request.name, time_s, step}),
          {file.string(), saved.bytes.size(), time_s, step}};
}

Outcome<requests::GetSnapshots> Snapshots::list() const {
  if (!store_) return no_directory();
  requests::GetSnapshotsResponse response{store_->named()};
  return {counted(response.snapshots.size(), "snapshot.", "snapshots."), std::move(response)};
}

Outcome<requests::RestoreSnapshot> Snapshots::restore(const requests::RestoreSnapshot& request) {
  if (auto refused = refusal(request.name)) return *std::move(refused);
  const auto loaded = slot_.loaded();
  std::vector<std::filesystem::path> files = store_->periodic();
  if (!request.name.empty()) files = {store_->file_of(request.name)};
  SnapshotResult result{SnapshotError::not_found, "There is no periodic snapshot yet."};
  for (const auto& file : files) {
    SnapshotFile content;
    result = read_snapshot_file(file, content);
    if (result.good()) result = check_identity(file, content.identity, loaded->simulation);
    if (!result.good()) continue;
    std::string why = "The simulation has ended; nothing was restored.";
    std::uint32_t epoch = 0;
    (void)loaded->loop->between_steps([&] {
      why = loaded->loop->restore(content.state);
      epoch = loaded->simulation.epoch();
    });
    if (!why.empty()) {
      result = {SnapshotError::damaged, why};
      continue;
    }
    const double time_s = content.identity.time_s;
    const std::uint64_t step = content.identity.step;
    return {outbound_.events.post(events::SnapshotRestored{time_s, step}), {time_s, step, epoch}};
  }
  return Refusal{result.error == SnapshotError::not_found ? ControlResult::not_found : ControlResult::failed,
                 result.message};
}

std::optional<Session> Snapshots::session() const {
  return store_ ? store_->read() : std::nullopt;
}

std::string Snapshots::resume(const Session& session) {
  slot_.set_pace(session.pace, session.factor);
  if (!session.source) {
    slot_.exchange(nullptr);
    return "no scenario is loaded, as before";
  }
  auto next = slot_.build(*session.source, session.changes);
  std::string how = "the scenario starts from its beginning, as no periodic snapshot can be used";
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
  slot_.exchange(std::move(next), state);
  return how + ", " + std::string(to_string(state));
}

}  // namespace takt
