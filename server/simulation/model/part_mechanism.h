#pragma once
// A mechanism that holds, moves or releases Parts between steps besides contact and grippers, such as screw
// joints, or that measures, such as force-torque sensors. A cell model lists mechanisms (CellModel::mechanisms); a device registers one
// (server/devices/device_type.h).
#include <functional>
#include <span>

#include "plant_models/plant_model.h"
#include "server/simulation/model/snapshot.h"

namespace takt {

class CellPlant;
class ComponentInteraction;
class StateReader;
class StateWriter;

/// What a mechanism may change at the begin of a step: after the commands, before the decision on connections.
class StepControl {
 public:
  virtual ~StepControl() = default;

  virtual double time_s() const = 0;
  virtual double step_s() const = 0;
  /// At the present time.
  virtual const CellMotion& motion() = 0;
  virtual CellPlant& plant() = 0;
  virtual ComponentInteraction& interaction() = 0;
  /// Whether a Part (component) is parked: out of the cell, without contact, motion and cost.
  virtual bool parked(int part) const = 0;
  /// Takes a Part out of the cell, to its pose in the model. What it is attached to lets it go before, and it lets go
  /// Parts that are attached to it. Without effect on a parked Part.
  virtual void park(int part) = 0;
  /// Brings a parked Part into the cell, at this pose of its frame B, with this twist of B's origin.
  virtual void bring_in(int part, const Pose& X_WB, const Twist& V_WB) = 0;
};

class PartMechanism {
 public:
  virtual ~PartMechanism() = default;

  /// Initial state. `interaction` has just been reset.
  virtual void start(ComponentInteraction& interaction) = 0;
  /// Called at the begin of each step.
  virtual void begin_step(StepControl& control) { static_cast<void>(control); }
  /// Events since the last begin_step(), without time and step.
  virtual std::span<const DeviceNotice> notices() const { return {}; }
  /// Called after the decision on the connections of a step of length h (s). True if attachments have
  /// changed, and with them the pairs that act by contact.
  virtual bool update(double h, const CellMotion& motion, CellPlant& plant,
                      ComponentInteraction& interaction) = 0;
  /// Called after a change of levels of detail or attachments. `by_contact`: whether a component has level 3.
  virtual void choose_stiffness(const std::function<bool(int component)>& by_contact,
                                ComponentInteraction& interaction) const {
    static_cast<void>(by_contact), static_cast<void>(interaction);
  }
  virtual void save(StateWriter& out) const = 0;
  virtual void load(StateReader& in) = 0;
  /// After load(): passes what it has set in the plant.
  virtual void loaded(CellPlant& plant) const { static_cast<void>(plant); }
};

}  // namespace takt
