#pragma once
// A force between components besides holding springs and surface contact: a spring, a magnet, a cable. The plant model
// of a device (device_model.h) that is a ForceElement as well joins the system of equations with it; nothing else is
// registered.
#include <span>

#include "plant_models/plant_model.h"

namespace takt {

class ForceElement {
 public:
  virtual ~ForceElement() = default;
  /// Adds what acts on each component (`wrenches`: by component id), about its centre of mass (BodyMotion::p_WBcm), axes
  /// of the world. Pure: it depends on the motion and on what changes between steps alone. Forces act in pairs, or
  /// momentum is not conserved. Implicit solvers treat it explicitly, so its stiffness limits their step.
  virtual void add_wrenches(const CellMotion& motion, std::span<Wrench> wrenches) const = 0;
};

}  // namespace takt
