#pragma once
// A thread as a timed process: it holds until it is turned out completely. The model contains the time and
// the torque of a screw; thread flanks, preload and wear are not modelled.
//
//   turns = length / pitch,  time = turns / speed,  travel along the axis = pitch * turns
// The thread resists with the same torque on its whole length. A smaller torque does not turn it.

namespace takt {

struct ScrewThread {
  double pitch_m = 0.0;
  double length_m = 0.0;            ///< engaged when screwed in
  double driving_torque_N_m = 0.0;  ///< needed to turn it, either way

  /// Angle at which the thread releases (rad).
  double whole_angle_rad() const;
  double travel_m(double angle_rad) const;
};

/// Result of turning for a while.
struct ThreadTurn {
  double angle_rad = 0.0;   ///< turned by, positive: outwards
  double torque_N_m = 0.0;  ///< of the screwdriver, never negative
  bool free = false;        ///< it has been turned out
};

/// For `duration_s` a screwdriver with at most `max_torque_N_m` turns, at `speed_rad_per_s` (positive: out), a
/// thread that is already turned out by `turned_rad`. At its seat it turns no further in: the screwdriver
/// then exerts its largest torque.
ThreadTurn turn_thread(const ScrewThread& thread, double turned_rad, double speed_rad_per_s,
                       double max_torque_N_m, double duration_s);

/// Beyond its seat a screw is tightened: its torque rises by `stiffness_N_m_per_rad` for each radian from the
/// driving torque on.
struct ScrewTightening {
  double stiffness_N_m_per_rad = 0.0;

  /// Angle beyond the seat at which the torque is reached (rad).
  double angle_rad(const ScrewThread& thread, double torque_N_m) const;
};

/// Result of turning in for a while.
struct ThreadIn {
  double down_rad = 0.0;    ///< turned in by, with travel
  double tight_rad = 0.0;   ///< turned beyond the seat by
  double torque_N_m = 0.0;  ///< of the nut runner
  bool reached = false;     ///< the torque limit
};

/// For `duration_s` a nut runner turns in, at `speed_rad_per_s` > 0, a thread that is turned out by `turned_rad` and
/// beyond its seat by `tight_rad`, up to the torque limit. Below the driving torque nothing turns.
ThreadIn turn_in(const ScrewThread& thread, const ScrewTightening& tightening, double turned_rad,
                 double tight_rad, double speed_rad_per_s, double torque_limit_N_m, double duration_s);

}  // namespace takt
