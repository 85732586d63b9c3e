#pragma once
// Scenes of boxes for bench_peers, and the engines of rigid bodies that run them.
#include <cmath>
#include <functional>
#include <vector>

#include "plant_models/spatial.h"
#include "tests/performance/processor_time.h"

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

inline PeerBody box(const Vec3& size_m, const Vec3& p, double mass_kg) {
  PeerBody body;
  body.size_m = size_m;
  body.X_WB.p = p;
  body.mass_kg = mass_kg;
  return body;
}

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

/// Calls `step` with the time in the middle of each step. Returns the processor time after the beginning.
template <class Step>
double run_timed(const PeerScene& scene, PeerSetting setting, const Step& step) {
  const auto steps_until = [&](double end_s) { return std::lround(end_s / setting.step_s); };
  const long steps = steps_until(scene.begin_s + scene.duration_s), first = steps_until(scene.begin_s);
  double begin = processor_s();
  for (long i = 0; i < steps; ++i) {
    if (i == first) begin = processor_s();
    step(setting.step_s * (static_cast<double>(i) + 0.5));
  }
  return processor_s() - begin;
}

Peer bullet();
Peer ode();

}  // namespace takt::bench
