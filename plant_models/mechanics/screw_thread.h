#pragma once
// A thread at the level of a timetable: it holds until it has been turned out. What a thesis-like cell needs
// of a screw is how long that takes and what torque it asks for; thread flanks, preload and wear are not
// modelled.
//
//   turns = length / pitch,  time = turns / speed,  travel along the axis = pitch * turns
// The thread resists with the same torque on its whole length. Who has less does not turn it.

namespace takt {

struct ScrewThread {
  double pitch_m = 0.0;
  double length_m = 0.0;           ///< engaged when screwed in
  double driving_torque_Nm = 0.0;  ///< needed to turn it, either way

  /// Angle by which it is turned out when it lets go (rad).
  double whole_angle_rad() const;
  double travel_m(double angle_rad) const;
};

/// What comes of turning for a while.
struct ThreadTurn {
  double angle_rad = 0.0;  ///< turned by, positive: outwards
  double torque_Nm = 0.0;  ///< of the screwdriver, never negative
  bool free = false;       ///< it has been turned out
};

/// For `duration_s` a screwdriver with at most `max_torque_Nm` turns, at `speed_rad_per_s` (positive: out), a
/// thread that has been turned out by `turned_rad` before. At its seat it turns no further in: the
/// screwdriver then presses with all it has.
ThreadTurn turn_thread(const ScrewThread& thread, double turned_rad, double speed_rad_per_s,
                       double max_torque_Nm, double duration_s);

}  // namespace takt
