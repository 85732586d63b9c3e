#pragma once
// The control requests that exchange what is simulated: executed by the host of the cell (cell_host.h), with
// or without a loaded scenario; all others are for the loop of the loaded one (control.h).
#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "server/runtime/requests/control.h"
#include "server/scenario/scenario_reader.h"

namespace takt {

/// Arguments: `uri`, the scenario file, relative to the working directory of the server (file:// in front is
/// allowed); `overrides`, one KEY=VALUE a line; `lod`, the level of detail of every process.
struct LoadScenario {
  std::filesystem::path file;
  ScenarioOptions options;
};
struct UnloadScenario {};
/// The file of the loaded scenario again, with the same overrides.
struct ReloadScenario {};
/// A new Part, while the simulation is stopped. Arguments: `name`; `allow_renaming` true: a number is added
/// to a name that is taken; `uri`, its mesh file, with `mass_kg`, `mesh_scale` (1), `hierarchy` (1); or
/// instead `copy_of`, the Part of the loaded scenario that it is like (`mass_kg` and `hierarchy` may differ);
/// `position` (3 numbers, m), and `orientation` (quaternion x y z w), of its frame in the world.
struct SpawnEntity {
  std::string name;
  bool allow_renaming = false;
  std::filesystem::path mesh;
  std::string copy_of;
  double mesh_scale = 1.0;
  std::optional<double> mass_kg;
  std::optional<int> hierarchy;
  Pose X_WB;
};
/// `entity`: any Part, while the simulation is stopped.
struct DeleteEntity {
  std::string name;
};
/// A reset of a scenario to which something was spawned, or from which something was deleted: its scope
/// includes that (4).
struct ResetSpawned {
  bool spawned_only = false;  ///< scope 4 alone
};
/// The whole state of the simulation into a file `name`.snapshot in the directory of snapshots.
struct SaveSnapshot {
  std::string name;
};
/// Back to that state, of the same scenario with the same Parts; without a name: the newest periodic one.
/// Whether it plays, its pace and its controllers stay; the epoch counts up.
struct RestoreSnapshot {
  std::string name;
};
/// All that changes the simulation from here on into a file `name`.taktlog in the directory of recordings.
struct StartRecording {
  std::string name;
};
struct StopRecording {};
/// Which pairs are to be sent as contact_pressures, for how long from now on (wall time); answered at once.
/// Arguments: `pairs`, names BASE-TARGET with * for any characters, separated by commas; `for_s` (10); 0 ends
/// it.
struct WatchPressures {
  std::string pairs;
  double for_s = 10.0;
};
using HostAction =
    std::variant<LoadScenario, UnloadScenario, ReloadScenario, SpawnEntity, DeleteEntity, ResetSpawned,
                 SaveSnapshot, RestoreSnapshot, StartRecording, StopRecording, WatchPressures>;

inline constexpr std::array<std::string_view, 10> kHostRequests{
    "load_scenario", "unload_scenario",  "reload_scenario", "spawn_entity",   "delete_entity",
    "save_snapshot", "restore_snapshot", "start_recording", "stop_recording", "watch_pressures"};

/// Nothing when the request is none of these. `with_spawned`: something was spawned or deleted, so that a
/// reset may be one of these.
std::optional<std::variant<HostAction, ControlReply>> parse_host_request(const ControlRequest& request,
                                                                         bool with_spawned = false);

}  // namespace takt
