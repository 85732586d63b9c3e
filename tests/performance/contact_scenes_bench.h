#pragma once
// Parts of bench_contact and bench_screw.
#include <cmath>
#include <numbers>
#include <string>

#include "server/scenario/scenario.h"
#include "tests/performance/processor_time.h"

namespace takt::bench {

/// The scenes of config/scenarios/contact, by several solvers and, where it is built in and can do the scene,
/// by Bullet. `large`: the peg in its hole with 100 000 triangles in each body too (meshes in build/large).
void contact_scenes(bool large);
/// `count` random poses and twists of every pair of the scenes; exit code 1 if any answer is not finite.
int contact_poses(int count);

/// Rotation about z so far, of a body that turns by less than half a turn between two calls.
class Turned {
 public:
  void note(double angle_rad) {
    sum_ += std::remainder(angle_rad - last_, 2.0 * std::numbers::pi);
    last_ = angle_rad;
  }
  double rad() const { return sum_; }

 private:
  double sum_ = 0.0, last_ = 0.0;
};

struct PeerRun {
  bool done = false;  ///< false: it cannot do this scene, for the reason `why`
  std::string why;
  double cpu_s = 0.0, end_error_m = 0.0;
  double turned_rad = 0.0;  ///< of the first Part about z
};
/// Bullet, rigid bodies: Parts as convex hulls (as GImpact meshes where they are not convex), Grounds as
/// triangle meshes.
PeerRun run_bullet(const Scenario& scenario, double step_s);

}  // namespace takt::bench
