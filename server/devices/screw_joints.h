#pragma once
// Parts that are held by their thread, screwdrivers that turn them out, and nut runners that turn them in; between steps.
//
// A threaded Part is attached to the component that it is screwed into (ComponentInteraction::attach), so it
// moves with it, no Gripper takes it along, and at level of detail 3 no surface contact acts between the two.
// A screwdriver is a Gripper with a bit at its tool centre point: while its signal `speed` is not zero and
// the bit meets the head of such a Part, it turns the Part, which moves along its axis by one pitch per turn.
// The torque acts between Gripper and the threaded component. A Part that is turned out is free: the usual
// rules choose its holder.
//
// A nut runner turns such a Part in. The thread takes a Part that stands where it comes out, with its axis in line, once the
// bit of the runner meets its head. The Part is then attached. Beyond the seat the torque rises with the angle
// (ScrewTightening) up to the torque limit; a screwdriver needs that torque to loosen the Part.
#include <optional>
#include <string>
#include <vector>

#include "plant_models/mechanics/screw_thread.h"
#include "server/devices/device_type.h"

namespace takt {

/// The keys of the thread of a Part in a scenario.
struct ScenarioScrewJoint {
  HeldBy held_by;
  double pitch_m = 0.0, length_m = 0.0, driving_torque_N_m = 0.0;
  Vec3 axis_B = Vec3::UnitZ();     ///< along which it comes out, in the Part's frame; of any length
  Vec3 p_BH = Vec3::Zero();        ///< `head_m`: where a screwdriver meets it
  double stiffness_N_per_m = 1e6;  ///< at level of detail 3
  std::optional<Pose> X_HB;        ///< `hole`: where it sits in the other component; it starts outside
};
DeviceType screw_joint_type();

/// The keys of a bit at the tool centre point of a Gripper in a scenario.
struct ScenarioScrewdriver {
  std::string gripper;
  double max_speed_rad_per_s = 0.0, max_torque_N_m = 0.0;
  double reach_m = 0.01;  ///< from the tool centre point to the head
};
DeviceType screwdriver_type();

/// The keys of a nut runner at the tool centre point of a Gripper in a scenario.
struct ScenarioNutRunner {
  std::string gripper;
  double max_speed_rad_per_s = 0.0, max_torque_N_m = 0.0, stiffness_N_m_per_rad = 0.0;
  double reach_m = 0.01;
};
DeviceType nut_runner_type();

class ScrewJoints final : public PartMechanism {
 public:
  /// A Part that is screwed into another component at the start.
  struct Joint {
    int part = -1, holder = -1;
    int device = -1;  ///< that reports it
    ScrewThread law;
    Vec3 axis_B = Vec3::UnitZ();   ///< along which it comes out
    Vec3 p_BH = Vec3::Zero();      ///< where a screwdriver meets it
    double stiffness_ratio = 1.0;  ///< of the thread at level 3 to the Part's own spring
  };
  /// A Gripper with a bit at its tool centre point T, which points along the z axis of T.
  struct Screwdriver {
    int palm = -1, device = -1;
    Pose X_GT;
    double reach_m = 0.0, max_torque_N_m = 0.0;
  };
  /// A Gripper with the bit of a nut runner, which turns in.
  struct NutRunner {
    int palm = -1, device = -1;
    Pose X_GT;
    double reach_m = 0.0;
    ScrewTightening tightening;
  };
  struct Model {
    std::vector<Joint> joints;
    std::vector<Screwdriver> screwdrivers;
    std::vector<NutRunner> runners{};
    std::vector<Pose> seats{};       ///< by joint: X_HB of the seated Part in its holder; needed by runners
    std::vector<char> starts_out{};  ///< by joint; empty: none does
  };
  static constexpr const char* kName = "screw joints";
  enum JointSignal : int { turns, held, kJointSignals };
  enum DriverSignal : int { speed, torque, engaged, power, energy, kDriverSignals };
  enum RunnerSignal : int {
    run_speed,
    torque_limit,
    run_torque,
    angle,
    run_engaged,
    done,
    run_power,
    run_energy,
    kRunnerSignals
  };

  /// `model` outlives it.
  explicit ScrewJoints(const Model& model)
      : model_(model),
        turned_rad_(model.joints.size(), 0.0),
        tight_rad_(model.joints.size(), 0.0),
        tight_N_m_(model.joints.size(), 0.0),
        running_(model.runners.size(), 0) {}

  void start(ComponentInteraction& interaction) override;
  bool update(double h, const CellMotion& motion, CellPlant& plant,
              ComponentInteraction& interaction) override;
  /// At level 3, where Grippers pull by contact, a thread has a stiffness of its own.
  void choose_stiffness(const std::function<bool(int)>& by_contact,
                        ComponentInteraction& interaction) const override;
  void save(StateWriter& out) const override;
  void load(StateReader& in) override;

 private:
  bool is_held(const Joint& joint, const ComponentInteraction& interaction) const;
  /// The joint whose head a bit meets, or -1.
  int engaged_joint(int palm, const Pose& X_GT, double reach_m, const CellMotion& motion) const;
  bool starts_out(std::size_t joint) const {
    return !model_.starts_out.empty() && model_.starts_out[joint] != 0;
  }
  /// A Part that is out stands where the thread can take it.
  bool stands_at_thread(std::size_t joint, const CellMotion& motion) const;
  bool run(std::size_t runner, double h, const CellMotion& motion, CellPlant& plant,
           ComponentInteraction& interaction);

  const Model& model_;
  std::vector<double> turned_rad_;  ///< by joint
  std::vector<double> tight_rad_;   ///< by joint: beyond its seat
  std::vector<double> tight_N_m_;   ///< by joint: torque with which it was tightened
  std::vector<char> running_;       ///< by nut runner: in the step before
};

}  // namespace takt
