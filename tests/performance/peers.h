#pragma once
// Scenes of boxes for bench_peers, and the engines of rigid bodies that run them.
#include <functional>
#include <vector>

#include "plant_models/spatial.h"

namespace takt::bench {

struct PeerBody {
  Vec3 size_m = Vec3::Zero();  ///< edges of a box, its frame in the middle
  Pose X_WB;
  double mass_kg = 0.0;                 ///< 0: it does not feel forces
  std::function<Vec3(double t)> v_W{};  ///< of a body without mass; none: it stands
  int slides_on = -1;                   ///< body on which it slides without turning
  Vec3 axis_W = Vec3::UnitX();          ///< of that
  double force_N = 0.0;                 ///< along it
};

struct PeerScene {
  std::vector<PeerBody> bodies;
  Vec3 gravity_m_per_s2{0.0, 0.0, -9.80665};
  double friction = 0.3;
  double begin_s = 0.0;  ///< not timed: the bodies come to rest before the motion
  double duration_s = 1.0;
  bool sleeping = false;
};

struct PeerSetting {
  double step_s = 0.001;
  int iterations = 10;           ///< of the constraint solver; 0: exact
  bool both_directions = false;  ///< of friction; Bullet has one by default
};

struct PeerEnd {
  double cpu_s = 0.0;
  std::vector<Pose> X_WB;  ///< by body
};

struct Peer {
  const char* name;
  const char* package;                            ///< of Debian
  PeerEnd (*run)(const PeerScene&, PeerSetting);  ///< nullptr: not built in
  std::vector<PeerSetting> settings;              ///< the cheapest one that is as accurate counts
};

Peer bullet();
Peer ode();

}  // namespace takt::bench
