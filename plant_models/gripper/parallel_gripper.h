#pragma once
// A parallel gripper at LoD 1: two jaws on straight guides that move at rated speed and stop at contact.
//
// Frames: F flange of the carrying robot, G gripper (palm), L and R the jaws. Jaws open along +y (left) and
// -y (right) of G; a jaw's frame lies on its grip face, so the face of the left jaw is at y = left, that of
// the right one at y = -right. The right jaw is the left one turned by 180 degrees about z. Each jaw travels
// on its own: the one that touches first waits for the other.
#include <array>
#include <limits>

#include "plant_models/plant_model.h"

namespace takt {

struct ParallelGripperParameters {
  int robot = -1;                   ///< index into CellMotion::arms
  int palm = -1;                    ///< component ids
  std::array<int, 2> jaws{-1, -1};  ///< left, right
  Pose X_FG;
  double max_width_m = 0.0;  ///< both jaws together
  double initial_width_m = 0.0;
  double jaw_speed_m_per_s = 0.0;  ///< of each jaw
};

class ParallelGripper final : public PlantModel {
 public:
  enum Side : int { left = 0, right = 1 };

  explicit ParallelGripper(const ParallelGripperParameters& parameters);
  void write_motion(double t, const double* x, CellMotion& motion) const override;

  /// Discrete, between accepted steps: from t on the jaws travel to `width_m` (distance of both jaws).
  void move_to(double t, double width_m);
  /// Discrete: limits this jaw to `coordinate_m`, its place of contact; blocked() then reports it.
  void stop_jaw(double t, Side side, double coordinate_m);
  void reset() override;
  /// Discrete: the largest force of each jaw of a dynamic robot (N), from 0 to infinity; the drive's own limit also holds.
  void limit_force(double force_N) { force_limit_N_ = force_N; }
  double force_limit_N() const { return force_limit_N_; }
  /// Discrete: a jaw travels on from this coordinate to where it was going.
  void continue_from(double t, Side side, double coordinate_m);

  /// Discrete: a jaw travels from one coordinate to another, replacing its present motion. A target beyond
  /// zero is allowed: the jaw of a dynamic robot then presses.
  void drive_jaw(double t, Side side, double from_m, double to_m);

  /// Distance of a jaw's grip face from the centre (m), never negative.
  double coordinate(double t, Side side) const;
  /// Its derivative (m/s).
  double speed(double t, Side side) const;
  /// Time at which a jaw that travels at t reaches its target: its speed jumps. Infinity if no jaw travels.
  double next_time_event(double t) const override;
  void save(StateWriter& out) const override;
  void load(StateReader& in) override;
  double width(double t) const { return coordinate(t, left) + coordinate(t, right); }
  bool closing(double t, Side side) const;
  bool moving(double t) const;
  /// Target of a jaw's travel, or its position at rest.
  double target(Side side) const { return tracks_[static_cast<size_t>(side)].target; }
  bool blocked(Side side) const { return tracks_[static_cast<size_t>(side)].blocked; }
  const ParallelGripperParameters& parameters() const { return parameters_; }

  /// Pose of a jaw in G at a coordinate.
  static Pose jaw_pose(Side side, double coordinate_m);

 private:
  struct Track {  ///< constant speed from `start` at t0 to `target`
    double t0 = 0.0, start = 0.0, target = 0.0;
    bool blocked = false;
  };
  ParallelGripperParameters parameters_;
  std::array<Track, 2> tracks_;
  double force_limit_N_ = std::numeric_limits<double>::infinity();
};

}  // namespace takt
