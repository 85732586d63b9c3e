#pragma once
// Vacuum grippers, magnetic grippers, three-jaw grippers and tool changers: devices that hold a Part until its load
// exceeds their force.
//
// A holder sits on a component: a Gripper (there it is at the tool centre point, unless `mount` says otherwise), a Part
// (a tool) or a Ground (a fixture). Its frame H has its z axis towards the Part. A held Part is attached to that
// component (ComponentInteraction::attach) at every level of detail. Between the steps the holder compares the
// force that the connection transmits with its own:
//   vacuum    F = pressure difference * area of the sealed cups; pull along -z: P <= F; shear S <= mu (F - P)
//   magnet    F = holding force; as vacuum
//   3 jaws    F of each jaw; resultant load <= 3 mu F
//   changer   F = locking force; resultant load <= F
// Where it does not hold, the Part is lost in the step that begins there. Moments about the holder are not considered.
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "server/devices/device_type.h"
#include "server/geometry/aabb.h"
#include "server/geometry/convex/convex_shape.h"

namespace takt {

/// The component that carries a holder, and where.
struct ScenarioHolderPlace {
  std::string on;
  std::optional<Pose> X_CH;
};

/// The keys of a vacuum gripper in a scenario.
struct ScenarioVacuumGripper {
  struct Cup {
    Vec3 p_HC = Vec3::Zero();
    double diameter_m = 0.0;
  };
  ScenarioHolderPlace place;
  std::vector<Cup> cups;
  double pressure_Pa = 0.0;                                ///< largest difference to the surroundings
  double leak = 0.0;                                       ///< share of it that is lost
  double evacuation_time_s = 0.05, release_time_s = 0.02;  ///< time constants
  double grip_at = 0.5;  ///< share of the pressure from which a sealed Part is held
  double friction = 0.5;
  double reach_m = 0.002;
};
DeviceType vacuum_gripper_type();

/// The keys of a magnetic gripper in a scenario.
struct ScenarioMagneticGripper {
  ScenarioHolderPlace place;
  double force_N = 0.0, residual = 0.0, friction = 0.15, diameter_m = 0.0;
  double reach_m = 0.001;
};
DeviceType magnetic_gripper_type();

/// The keys of a three-jaw gripper in a scenario.
struct ScenarioThreeJawGripper {
  ScenarioHolderPlace place;
  double max_diameter_m = 0.0, jaw_speed_m_per_s = 0.0, force_N = 0.0, friction = 0.3;
  double finger_length_m = 0.02, centering_m = 0.001;
};
DeviceType three_jaw_gripper_type();

/// The keys of a tool changer in a scenario.
struct ScenarioToolChanger {
  struct Tool {
    std::string part;
    Pose X_BK;  ///< coupling in the tool's frame
  };
  ScenarioHolderPlace place;
  std::vector<Tool> tools;
  double locking_force_N = 0.0;
  double reach_m = 0.002, reach_rad = 0.035;
};
DeviceType tool_changer_type();

class PartHolders final : public PartMechanism {
 public:
  enum class Kind { vacuum, magnet, three_jaw, changer };
  struct Cup {
    Vec3 p_HC = Vec3::Zero();
    double radius_m = 0.0;
    double area_m2() const;
  };
  struct Tool {
    int part = -1;
    Pose X_BK;
  };
  struct Holder {
    Kind kind{};
    int device = -1;
    int on = -1;  ///< component
    Pose X_CH;
    double friction = 0.0, reach_m = 0.0, reach_rad = 0.0;
    double force_N = 0.0;   ///< magnet, each jaw, locking
    double residual = 0.0;  ///< share of it without command
    std::vector<Cup> cups;  ///< vacuum; of a magnet its face
    double pressure_Pa = 0.0, evacuation_time_s = 1.0, release_time_s = 1.0, grip_at = 0.0;
    double max_diameter_m = 0.0, jaw_speed_m_per_s = 0.0, finger_length_m = 0.0, centering_m = 0.0;
    std::vector<Tool> tools;
  };
  struct Model {
    std::vector<Holder> holders;
    std::vector<int> parts;         ///< components
    std::vector<Vec3> weights_W{};  ///< of these (N)
  };
  static constexpr const char* kName = "part holders";
  /// Signals of all kinds begin with these; further ones follow by kind.
  enum Signal : int { on_now, present_now, part_now, force_now, load_now, shear_now, kSignals };
  enum VacuumSignal : int { pressure_now = kSignals, cups_now };
  enum JawSignal : int { diameter_now = kSignals };
  enum ChangerSignal : int { tool_now = kSignals };

  /// `model` outlives it.
  explicit PartHolders(const Model& model);

  void start(ComponentInteraction& interaction) override;
  void begin_step(StepControl&) override { notices_.clear(); }
  bool update(double h, const CellMotion& motion, CellPlant& plant,
              ComponentInteraction& interaction) override;
  std::span<const DeviceNotice> notices() const override { return notices_; }
  void save(StateWriter& out) const override;
  void load(StateReader& in) override;

 private:
  struct State {
    int held = -1;       ///< component
    bool fresh = false;  ///< its connection closes in the next step
    bool spent = false;  ///< a Part was lost: the next one needs another command
    double pressure_Pa = 0.0;
    double radius_m = 0.0;  ///< of the jaws
    int sealed = 0, tool = 0;
  };
  /// Force of the connections of a Part, and of all Parts that holders on it hold (N, on the Parts).
  Vec3 transmitted(int part, const CellMotion& motion, const ComponentInteraction& interaction) const;
  void update_holder(std::size_t index, double h, const CellMotion& motion, CellPlant& plant,
                     ComponentInteraction& interaction, bool& changed);
  bool carries(const Holder& holder, double force_N, const Vec3& f_H) const;
  /// The force, at the pressure that a vacuum gripper has, carries the Part at rest.
  bool lifts(const Holder& holder, const State& state, const Pose& X_WH, int part) const;
  double force_of(const Holder& holder, const State& state, bool commanded) const;
  int sealed_cups(const Holder& holder, const Pose& X_WH, int part, ComponentInteraction& interaction) const;
  int find_part(const Holder& holder, State& state, const Pose& X_WH, ComponentInteraction& interaction,
                const CellMotion& motion);
  bool may_take(const Holder& holder, int part, const ComponentInteraction& interaction) const;
  /// Which fingers (bits) at this radius overlap with the Part.
  int fingers_on(const Holder& holder, const Pose& X_WH, double radius_m, int part,
                 ComponentInteraction& interaction) const;
  /// Moves the jaws for one step; the Part that stopped them, or -1.
  int move_jaws(const Holder& holder, State& state, bool closing, double h, const Pose& X_WH,
                ComponentInteraction& interaction);

  const Model& model_;
  std::vector<State> states_;
  std::vector<int> near_;
  ConvexShape probe_;                 ///< a point
  std::vector<ConvexShape> fingers_;  ///< by holder: of a three-jaw gripper, at radius 0 along x of H
  std::vector<DeviceNotice> notices_;
};

}  // namespace takt
