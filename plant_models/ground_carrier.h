#pragma once
// A plant model without states that moves Grounds (an axis), or the surface of one (a conveyor), by a function of time that
// changes only between steps.
#include <span>

namespace takt {

class GroundCarrier {
 public:
  virtual ~GroundCarrier() = default;
  /// Component ids of the Grounds that it moves.
  virtual std::span<const int> carried() const { return {}; }
  /// Component id of the Ground whose surface it moves, or -1.
  virtual int belt() const { return -1; }
  /// Component id of the Ground that it stands on and moves with, or -1: the world.
  virtual int mount() const { return -1; }
  /// Discrete, at time t: false brakes to rest, commands are kept; true follows them again. It begins allowed.
  virtual void allow_motion(double t, bool allowed) = 0;
  /// True if, without a further command, nothing moves from t on, relative to the mount.
  virtual bool at_rest(double t) const = 0;
  /// Its position, or the travel of its surface, and the derivative: m or rad, part of the state's hash.
  virtual double coordinate(double t) const = 0;
  virtual double speed(double t) const = 0;
};

}  // namespace takt
