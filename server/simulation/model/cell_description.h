#pragma once
// Description of a loaded cell for clients that read no files: names, kinds, limits, geometry. Constant from
// load to unload. Indices into these vectors are the ids used in commands and snapshots.
#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "plant_models/device_model.h"
#include "plant_models/robot/arm_kinematics.h"
#include "plant_models/robot/robot_link.h"
#include "plant_models/spatial.h"
#include "server/geometry/mesh/described_mesh.h"
#include "takt_enumerations.h"

namespace takt {

struct ComponentDescription {
  std::string name;
  ComponentType type = ComponentType::part;
  int hierarchy = 0;           ///< Parts only: higher is further down the assembly (thesis 3.4.2)
  double mass_kg = 0.0;        ///< Parts only
  Vec3 p_BBcm = Vec3::Zero();  ///< centre of mass in the component's frame B
  std::string mesh_uri;        ///< file the geometry came from
  /// Shared by all components of this file; never null.
  std::shared_ptr<const DescribedMesh> mesh = std::make_shared<const DescribedMesh>();
  std::array<float, 4> color{0.7F, 0.7F, 0.7F, 1.0F};  ///< r, g, b, a in 0..1
  bool carried = false;                                ///< a Ground that a device moves

  /// Lower and upper corner of the box around its mesh, in B; std::nullopt without a mesh.
  std::optional<std::array<Vec3, 2>> box() const;
  bool stands() const { return type == ComponentType::ground && !carried; }
};

/// Longest silence of a stream of set-points (simulated time), and the reaction to a longer one.
struct CommandDeadline {
  double deadline_s = 0.0;  ///< 0: without deadline
  SafeAction action = SafeAction::hold;
  JointArray max_acceleration{};  ///< rad/s^2 or m/s^2, of `stop`
};

struct RobotDescription {
  std::string name;
  std::string urdf;  ///< the robot's URDF text
  ArmModel arm;      ///< the same kinematics, digested: base R to flange F
  Pose X_WR;         ///< base of the robot in the world, at the start
  /// Period over which set-points are interpolated unless the sender registers one.
  double command_period_s = 0.008;
  CommandDeadline command_deadline{};
  std::vector<RobotLink> links{};  ///< all links of the URDF, the base first
  int mount = -1;                  ///< component id of the Ground that the base stands on, or -1: the world
  Pose X_MR{};                     ///< base in that Ground
};

/// One named value of a device.
struct SignalDescription {
  std::string name;
  std::string unit;
  bool commanded = false;           ///< clients may set it
  double lower = 0.0, upper = 0.0;  ///< range of permitted values
  SignalType type = SignalType::real;
};

/// A component that is neither robot nor gripper: a furnace, a press.
struct DeviceDescription {
  std::string name;
  std::vector<SignalDescription> signals;  ///< at most kMaxSignals
  std::string type{};                      ///< its section in a scenario
  int robot = -1;                          ///< whose flange carries it
  Pose X_FD{};                             ///< its frame in that flange

  /// Indices of its signals `power` (W) and `energy` (J): a device with both is a consumer of electrical
  /// energy.
  struct Meter {
    std::size_t power, energy;
  };
  std::optional<Meter> meter() const;
};

/// A signal of the cell. `device` counts devices, then grippers, then robots (signals.h).
struct SignalRef {
  int device = -1;  ///< its owner
  int signal = -1;  ///< index among the signals of the owner
  auto operator<=>(const SignalRef&) const = default;
};

/// An input that follows another signal. Value of the input: `factor` times the other one plus `offset`; with `test`: whether it is
/// beyond `threshold`; `invert`: the opposite of that.
struct SignalWire {
  enum class Test : std::uint8_t { none, above, below };
  SignalRef to, from;
  bool invert = false;
  Test test = Test::none;
  double threshold = 0.0;
  double factor = 1.0, offset = 0.0;
  std::string text{};  ///< as in the scenario
};

struct GripperDescription {
  std::string name;
  int robot = -1;  ///< index of the robot that carries it
  /// The component of type gripper that Parts are held by; its frame G is the gripper's frame.
  int component = -1;
  int left_jaw = -1;   ///< component of the jaw on the +y side
  int right_jaw = -1;  ///< component of the jaw on the -y side
  Pose X_FG;           ///< gripper frame in the flange frame
  Pose X_GT;           ///< tool centre point in the gripper frame
  double max_width_m = 0.0;
  double max_force_N = 0.0;
  double jaw_speed_m_per_s = 0.0;  ///< of each jaw
};

/// Components and robots that share a level of detail (thesis 3.6.3).
struct ProcessDescription {
  std::string name;
  int level_of_detail = 1;  ///< at the start
  std::vector<int> robots;
  std::vector<int> components;  ///< Parts, Grounds, and the Grippers of its robots
};

struct CellDescription {
  std::string cell;      ///< name of the server, first level of every topic
  std::string scenario;  ///< name of the scenario
  double step_s = 0.001;
  int level_of_detail = 1;
  Vec3 gravity_m_per_s2{0.0, 0.0, -9.80665};
  std::vector<ComponentDescription> components;
  std::vector<RobotDescription> robots;
  std::vector<GripperDescription> grippers;
  std::vector<DeviceDescription> devices;
  std::vector<SignalWire> wires;  ///< in the order of their evaluation
  std::vector<ProcessDescription> processes;
  std::vector<std::string> checked_bodies;  ///< names for the indices in a CollisionEvent
  /// Number of the loaded scenario in this run of the server, from 1; distinguishes instants of different
  /// scenarios.
  std::uint32_t scenario_generation = 1;

  /// Index by name, or -1.
  int find_component(std::string_view name) const;
  int find_robot(std::string_view name) const;
  int find_gripper(std::string_view name) const;
  int find_device(std::string_view name) const;
  int find_process(std::string_view name) const;
};

}  // namespace takt
