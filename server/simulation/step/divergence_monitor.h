#pragma once
// Notices what no cell does: Parts that leave the world, energy that nothing put in, joints that run away.
// Looked at between steps; nothing here acts but through the fault that Simulation makes of a sentence.
//
// Energy: no Part has more than what it was given at the start or by request, what it can have won by falling
// from the highest place at which any Part has been, and what the fastest Gripper has done so far. As speed,
// that of the whole kinetic energy, rotation included, per mass:
//   sqrt(2 E / m) <= 3 sqrt((v_given + v_gripper)^2 + 2 g (highest - height) + 2 W / m) + 1 m/s
// W is the largest net work that force elements have done on all Parts, by the trapezoidal rule over the steps.
// The factor is for bodies that pass on what they have to lighter ones (a ball on a heavier ball leaves with
// three times the speed), the last term for what springs and surfaces store.
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

  /// A Part (its place among the Parts) moves like this from now on because somebody wanted so.
  void given(std::size_t part, const BodyMotion& motion);

  /// At one instant, of these Parts (places, ascending) and all robots. Empty, or what is wrong. Allocates
  /// only in the latter case.
  std::string look(double time_s, std::span<const int> parts, const CellMotion& motion,
                   const ComponentInteraction& interaction, const CellPlant& plant);

  /// Empty, or why no Part can be there.
  std::string outside(const Vec3& p_W) const;

 private:
  double height(const Vec3& p_W) const;
  double speed_of_energy(std::size_t part, const BodyMotion& motion) const;
  void note_grippers(const CellMotion& motion, std::span<const int> parts,
                     const ComponentInteraction& interaction);
  void note_force_elements(double time_s, const CellMotion& motion, const CellPlant& plant);
  std::string runaway_joint(double time_s, const CellPlant& plant) const;

  const CellModel& model_;
  double gravity_m_per_s2_ = 0.0;
  Vec3 up_W_ = Vec3::Zero();
  double lever_m_ = 0.0;  ///< from a Gripper's origin to the farthest point of what it can touch
  double highest_m_ = 0.0, given_m_per_s_ = 0.0, gripper_m_per_s_ = 0.0;  ///< so far
  struct Work {
    double time_s = 0.0, power_W = 0.0;       ///< at the newest look
    double net_J = 0.0, largest_net_J = 0.0;  ///< so far
  };
  Work work_;                     ///< of force elements on Parts
  std::vector<Wrench> wrenches_;  ///< room for their forces, by component
};

}  // namespace takt
