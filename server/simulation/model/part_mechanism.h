#pragma once
// A mechanism that holds, moves or releases Parts between steps besides contact and grippers, such as screw
// joints, or that measures, such as force-torque sensors. A cell model lists mechanisms (CellModel::mechanisms); a device registers one
// (server/devices/device_type.h).
#include <functional>

#include "plant_models/plant_model.h"

namespace takt {

class CellPlant;
class ComponentInteraction;
class StateReader;
class StateWriter;

class PartMechanism {
 public:
  virtual ~PartMechanism() = default;

  /// Initial state. `interaction` has just been reset.
  virtual void start(ComponentInteraction& interaction) = 0;
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
};

}  // namespace takt
