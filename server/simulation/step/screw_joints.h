#pragma once
// Parts that are held by their thread, and screwdrivers that turn them out; between steps.
//
// A threaded Part is attached to what it is screwed into (ComponentInteraction::attach), so it goes where
// that goes, no Gripper takes it along, and at level of detail 3 no surface contact acts between the two. A
// screwdriver is a Gripper with a bit at its tool centre point: while its signal `speed` is not zero and the
// bit meets the head of such a Part, it turns the Part, which moves along its axis by one pitch per turn. The
// torque acts between Gripper and what the thread is in. Once turned out, the Part is free: whoever touches
// it by the usual rules has it.
#include <vector>

#include "plant_models/mechanics/screw_thread.h"
#include "plant_models/plant_model.h"
#include "server/simulation/model/cell_model.h"

namespace takt {

class CellPlant;
class ComponentInteraction;
class StateReader;
class StateWriter;

class ScrewJoints {
 public:
  enum ThreadSignal : int { turns, held, kThreadSignals };
  enum DriverSignal : int { speed, torque, engaged, power, energy, kDriverSignals };

  explicit ScrewJoints(const CellModel& model);

  bool any() const { return !model_.threads.empty(); }
  /// Initial state: all are screwed in. `interaction` has just been reset.
  void start(ComponentInteraction& interaction);
  /// After the connections of a step of length h have been decided. True if a thread let go: who is attached
  /// has changed, and with it which pairs act by contact.
  bool update(double h, const CellMotion& motion, CellPlant& plant, ComponentInteraction& interaction);
  /// At level 3, where Grippers pull by contact, a thread has a stiffness of its own.
  void set_stiffness(std::size_t thread, bool by_contact, ComponentInteraction& interaction) const;
  const std::vector<ScrewJointModel>& models() const { return model_.threads; }

  void save(StateWriter& out) const;
  void load(StateReader& in);

 private:
  bool is_held(std::size_t thread, const ComponentInteraction& interaction) const;
  int engaged_thread(const ScrewdriverModel& driver, const CellMotion& motion) const;

  const CellModel& model_;
  std::vector<double> turned_rad_;  ///< by thread
};

}  // namespace takt
