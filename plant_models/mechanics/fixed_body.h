#pragma once
// A Ground: a body at rest in the world.
#include "plant_models/plant_model.h"

namespace takt {

class FixedBody final : public PlantModel {
 public:
  FixedBody(int body, const Pose& X_WB) : body_(body), X_WB_(X_WB) {}
  int body() const override { return body_; }
  void write_motion(double, const double*, CellMotion& motion) const override {
    motion.bodies[static_cast<size_t>(body_)] = {X_WB_, {}, X_WB_.p};
  }

 private:
  int body_;
  Pose X_WB_;
};

}  // namespace takt
