#pragma once
// Detects contact forces that reverse their change from step to step. Mechanics has no such forces; they come
// from a solver that steps over the time constant of a force (above all friction regularised over a small
// velocity). Poses hide the error; joint torques, power and contact forces of such a run are wrong.
#include <cstdint>
#include <span>
#include <vector>

#include "server/contact/surface/contact_interaction.h"
#include "server/simulation/model/cell_model.h"
#include "server/simulation/model/snapshot.h"

namespace takt {

class StateReader;
class StateWriter;

class ForceAlternation {
 public:
  explicit ForceAlternation(const CellModel& model);

  void reset();
  /// At the accepted state of each step in which pairs act by surface contact. Does not allocate.
  void update(double t, std::uint64_t step, const CellMotion& motion, ContactInteraction& contacts);
  /// In a step without acting pairs: later forces are not compared with earlier ones.
  void pause();
  /// Parts found in the last update. Each Part is reported once.
  std::span<const AlternatingForce> found() const { return found_; }

  void save(StateWriter& out) const;
  void load(StateReader& in);

 private:
  struct Track {
    Vec3 force_W = Vec3::Zero(), change_W = Vec3::Zero();
    int reversals = 0;  ///< in succession
    bool known = false, reported = false;
  };
  bool reverses(Track& track, const Vec3& force_W, double least_N) const;

  const CellModel& model_;
  std::vector<Track> tracks_;   ///< by Part
  std::vector<Vec3> forces_W_;  ///< by component
  std::vector<AlternatingForce> found_;
};

}  // namespace takt
