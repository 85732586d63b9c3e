#pragma once
// The Parts of tests/support/pushed_crowd.h as boxes for other engines.
#include "tests/performance/peers.h"
#include "tests/support/pushed_crowd.h"

namespace takt::bench {

/// Processor time (s).
inline double run_until(double end_s, test::PushedCrowd& crowd, Simulation& simulation) {
  const double begin = processor_s();
  while (simulation.time_s() < end_s && simulation.step(crowd.commands(simulation))) continue;
  return processor_s() - begin;
}

struct PushedScene {
  static constexpr double kTravel_m = test::PushedCrowd::kLongest_m - test::PushedCrowd::kGap_m;
  static constexpr double kRest_s = 3.0;  ///< Bullet lets bodies sleep after two seconds

  PeerScene scene;
  std::size_t first = 0;  ///< of the Parts among the bodies
  int count = 0;

  PushedScene(int parts, double timed_s) : count(parts) {
    using Crowd = test::PushedCrowd;
    const auto add = [this](const Vec3& size_m, const Vec3& p, double mass_kg) -> PeerBody& {
      return scene.bodies.emplace_back(box(size_m, p, mass_kg));
    };
    scene.begin_s = kRest_s;
    scene.duration_s = timed_s;
    scene.sleeping = true;
    for (int t = 0; t < (count + 99) / 100; ++t) add({1.1, 1.1, 0.05}, {1.2 * t, 0.0, -0.025}, 0.0);
    first = scene.bodies.size();
    for (int i = 0; i < count; ++i)
      add({Crowd::kBox_m, Crowd::kBox_m, Crowd::kBox_m},
          Crowd::place(i).p + Vec3(0.0, 0.0, 0.5 * Crowd::kBox_m), 0.2);
    for (int r = 0; r < std::min(Crowd::kPushed, count); ++r) {
      const Vec3 behind(0.0, -0.5 * Crowd::kBox_m - 0.01 - Crowd::kGap_m, 0.04);
      add({0.04, 0.02, 0.06}, Crowd::place(Crowd::kApart * r).p + behind, 0.0).v_W = [](double t) {
        const double after_s = t - kRest_s;
        const bool moves = after_s > 0.0 && Crowd::kSpeed_m_per_s * after_s < Crowd::kLongest_m;
        return Vec3(0.0, moves ? Crowd::kSpeed_m_per_s : 0.0, 0.0);
      };
    }
  }

  /// Where a Part stands at the end: in front of what pushed it.
  static double y_at_end(int part) {
    using Crowd = test::PushedCrowd;
    const bool pushed = part % Crowd::kApart == 0 && part / Crowd::kApart < Crowd::kPushed;
    return Crowd::place(part).p.y() + (pushed ? kTravel_m : 0.0);
  }
  double error_m(const std::vector<Pose>& end) const {
    double worst = 0.0;
    for (int i = 0; i < count; ++i)
      worst = std::max(worst, std::abs(end[first + static_cast<std::size_t>(i)].p.y() - y_at_end(i)));
    return worst;
  }
};

}  // namespace takt::bench
