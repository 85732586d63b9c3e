#pragma once
// What axes and belts carry, and what their drives do: at the begin of each step the wrenches on their Grounds (the substitute
// force or contact), of robots that stand on these (from level of detail 2 on), of axes that stand on these, and of what moves
// with the axis itself give the force of each drive, by d'Alembert's principle. A motion that needs more than its drive has
// stops (MovingGrounds::take_load).
#include <cstddef>
#include <span>
#include <vector>

#include "plant_models/plant_model.h"
#include "server/simulation/model/part_mechanism.h"

namespace takt {

class MovingGrounds;

class AxisLoads final : public PartMechanism {
 public:
  struct Model {
    std::vector<int> axes;  ///< devices, without conveyors
  };
  static constexpr const char* kName = "loads of axes";
  /// `model` outlives it.
  explicit AxisLoads(const Model& model);

  void start(ComponentInteraction& interaction) override;
  void begin_step(StepControl& control) override;
  std::span<const DeviceNotice> notices() const override { return notices_; }
  bool update(double h, const CellMotion& motion, CellPlant& plant,
              ComponentInteraction& interaction) override;
  void save(StateWriter&) const override {}
  void load(StateReader&) override { notices_.clear(); }

 private:
  void note(const MovingGrounds& axis, CellPlant& plant);

  const Model& model_;
  std::vector<Wrench> loads_W_;  ///< by component, of Grounds, about their origins
  std::vector<DeviceNotice> notices_;
};

}  // namespace takt
