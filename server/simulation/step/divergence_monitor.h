#pragma once
// Detects physically impossible states: Parts that leave the bounds of the cell, energy without a source,
// joints that diverge. It is evaluated between steps and has no effect except the fault of the Simulation.
//
// Energy: no Part may have more than the sum of its initial or requested energy, the gain of a fall from the
// highest place at which any Part has been, the energy at the speed of the fastest Gripper so far, and the work
// of force elements. Expressed as the speed of the whole kinetic energy, rotation included, per mass:
//   sqrt(2 E / m) <= 3 sqrt((v_given + v_gripper)^2 + 2 g (highest - height) + 2 W / m) + 1 m/s
// W is the largest net work that force elements have done on all Parts, by the trapezoidal rule over the steps.
// The factor allows for bodies that pass their energy on to lighter ones (a ball on a heavier ball leaves
// with three times the speed), the last term for energy stored in springs and surfaces.
#include <span>
#include <string>
#include <vector>

#include "plant_models/plant_model.h"
#include "server/contact/holding/component_interaction.h"

namespace takt {

struct CellModel;
class CellPlant;
class StateReader;
class StateWriter;

class DivergenceMonitor {
 public:
  explicit DivergenceMonitor(const CellModel& model);
  void reset();
  void save(StateWriter& out) const;
  void load(StateReader& in);

  /// A request has set the motion of this Part (its place among the Parts).
  void given(std::size_t part, const BodyMotion& motion);

  /// Checks these Parts (places, ascending) and all robots at one instant. Empty, or a sentence about the
  /// fault. Allocates only in the latter case.
  std::string look(double time_s, std::span<const int> parts, const CellMotion& motion,
                   const ComponentInteraction& interaction, const CellPlant& plant);

  /// Empty, or the reason why this position is out of bounds.
  std::string outside(const Vec3& p_W) const;

 private:
  double height(const Vec3& p_W) const;
  double speed_of_energy(std::size_t part, const BodyMotion& motion) const;
  void note_grippers(const CellMotion& motion, std::span<const int> parts,
                     const ComponentInteraction& interaction);
  void note_carriers(const CellMotion& motion, std::span<const int> parts,
                     const ComponentInteraction& interaction, const CellPlant& plant);
  void note_force_elements(double time_s, const CellMotion& motion, const CellPlant& plant);
  std::string runaway_joint(double time_s, const CellPlant& plant) const;

  const CellModel& model_;
  double gravity_m_per_s2_ = 0.0;
  Vec3 up_W_ = Vec3::Zero();
  double lever_m_ = 0.0;  ///< from a Gripper's origin to the farthest point of its possible contacts
  double highest_m_ = 0.0, given_m_per_s_ = 0.0, gripper_m_per_s_ = 0.0;  ///< maxima since the reset
  struct Work {
    double time_s = 0.0, power_W = 0.0;       ///< at the newest evaluation
    double net_J = 0.0, largest_net_J = 0.0;  ///< since the reset
  };
  Work work_;                     ///< of force elements on Parts
  std::vector<Wrench> wrenches_;  ///< work space for their forces, by component
};

}  // namespace takt
