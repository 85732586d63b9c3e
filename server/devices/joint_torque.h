#pragma once
// A torque on a joint of a robot that a signal gives: the drive of a joint whose model is elsewhere (an FMU, a device in Lua,
// a client), or a torque besides the drive (a balancer, friction). It acts while the robot is dynamic, and is held over a
// step of the cell.
#include <optional>
#include <string>

#include "server/devices/device_type.h"
#include "server/simulation/model/hashed_state.h"

namespace takt {

/// The keys of such a torque in a scenario.
struct ScenarioJointTorque {
  std::string robot, joint, place_of_joint;
  bool keeps_drive = false;
  double armature_kg_m2 = 0.0;
  std::optional<double> max_torque_N_m;
};
DeviceType joint_torque_type();

struct JointTorqueParameters {
  std::size_t robot = 0, joint = 0;
};

class JointTorque final : public DeviceModel, public HashedState {
 public:
  enum Signal : int { torque, position, velocity, kSignals };

  explicit JointTorque(const JointTorqueParameters& parameters) : p_(parameters) {}

  void write_motion(double t, const double* x, CellMotion& motion) const override;
  void reset() override { torque_ = 0.0; }
  void set_signal(double t, int signal, double value) override;
  void read_signals(double t, const double* x, const CellMotion& motion,
                    std::span<double> signals) const override;
  std::uint64_t discrete_hash() const override;
  void save(StateWriter& out) const override;
  void load(StateReader& in) override;

 private:
  JointTorqueParameters p_;
  double torque_ = 0.0;  ///< N m or N
};

}  // namespace takt
