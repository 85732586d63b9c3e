#pragma once
// Arguments and answers of the requests that exchange what is simulated, or look at single components. Frames
// and units as in cell.h.
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "client_lib/cell.h"

namespace takt::client {

struct LoadOptions {
  std::vector<std::string> overrides;                    ///< KEY=VALUE, e.g. solver.step_s=0.0005
  std::optional<int> level_of_detail;                    ///< of every process
  std::optional<std::chrono::duration<double>> timeout;  ///< large meshes take their time
};

/// A new Part: either from a mesh file or like another Part.
struct SpawnRequest {
  std::string name;
  bool allow_renaming = false;    ///< a number is added to a name that is taken
  std::string mesh;               ///< file, seen from the working directory of the server
  std::string copy_of;            ///< or the Part of the scenario that it is like
  double mesh_scale = 1.0;        ///< with `mesh`
  std::optional<double> mass_kg;  ///< needed with `mesh`
  std::optional<int> hierarchy;   ///< with `mesh` 1 if not given
  Vector3 position_m;             ///< of its frame in the world
  Quaternion orientation;
};

struct EntityInfo {
  std::string name;
  ComponentType category = ComponentType::part;
  int hierarchy = 0;     ///< Parts
  double mass_kg = 0.0;  ///< Parts
};

/// Where a component is, and who holds it, at an instant between two steps.
struct EntityState {
  std::string name;
  ComponentType category = ComponentType::part;
  Vector3 position_m;
  Quaternion orientation;
  Vector3 linear_velocity, angular_velocity;
  PartState state = PartState::fixed;
  std::string partner;  ///< who holds it, or ""
  double time_s = 0.0;
  std::uint64_t step = 0;
  std::uint32_t epoch = 0;
};

/// What of a Part is to be changed; what is not given stays as it is.
struct EntityPlacement {
  std::optional<Vector3> position_m{};
  std::optional<Quaternion> orientation{};
  std::optional<Vector3> linear_velocity{}, angular_velocity{};  ///< of the origin of B, in the world
};

}  // namespace takt::client
