#pragma once
// A force between components besides holding springs and surface contact: a spring, a magnet, a cable. If the
// plant model of a device (device_model.h) is also a ForceElement, it joins the system of equations with the
// device, without further registration.
#include <span>

#include "plant_models/plant_model.h"

namespace takt {

class ForceElement {
 public:
  virtual ~ForceElement() = default;
  /// Adds the wrench on each component (`wrenches`: by component id), about its centre of mass
  /// (BodyMotion::p_WBcm), axes of the world. Pure: it depends only on the motion and on discrete state.
  /// Forces must act in pairs, to conserve momentum. Implicit solvers treat it explicitly, so its stiffness
  /// limits their step.
  virtual void add_wrenches(const CellMotion& motion, std::span<Wrench> wrenches) const = 0;
};

}  // namespace takt
