#pragma once
// Clamps and fixtures: while its jaws are closed, a clamp fixes the Parts in its volume to the Ground that it stands on.
//
// A clamped Part is attached (ComponentInteraction::attach) at every level of detail: the substitute force holds it where it was
// when the jaws had closed, its holder so far lets go, and at level of detail 3 no surface contact acts between
// the two. The jaws have no shape and no limit of force. Opening frees the Parts at once, and the usual rules choose their holders.
#include <string>
#include <vector>

#include "server/devices/device_type.h"

namespace takt {

/// The keys of a clamp in a scenario.
struct ScenarioClamp {
  std::string ground;
  Vec3 center_G = Vec3::Zero(), size_m = Vec3::Zero();
  double closing_time_s = 0.0;
  bool closed = false;  ///< at the start
};
DeviceType clamp_type();

class Clamps final : public PartMechanism {
 public:
  struct Clamp {
    int ground = -1, device = -1;
    Vec3 center_G = Vec3::Zero(), size_m = Vec3::Zero();
    double closing_time_s = 0.0;  ///< and of opening
    bool closed = false;          ///< at the start
  };
  struct Model {
    std::vector<Clamp> clamps;
  };
  static constexpr const char* kName = "clamps";
  enum Signal : int { close, closed, opened, part_present, holding, kSignals };

  /// `model` outlives it.
  explicit Clamps(const Model& model) : model_(model), states_(model.clamps.size()) {}

  void start(ComponentInteraction& interaction) override;
  bool update(double h, const CellMotion& motion, CellPlant& plant,
              ComponentInteraction& interaction) override;
  void save(StateWriter& out) const override;
  void load(StateReader& in) override;

 private:
  struct State {
    double share = 0.0;     ///< of the way of the jaws: 0 opened, 1 closed
    std::vector<int> held;  ///< Parts that it has attached, ascending
  };
  static bool is_inside(const Clamp& clamp, int part, const CellMotion& motion);

  const Model& model_;
  std::vector<State> states_;
  std::vector<int> parts_;
};

}  // namespace takt
