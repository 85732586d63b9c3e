#pragma once
// One DynamicRobot outside a cell: motion, wrenches and fixed-step solvers.
#include "plant_models/robot/dynamic_robot.h"

namespace takt {

class RobotBench {
 public:
  RobotBench(DynamicRobot& of, size_t bodies)
      : robot(of), x(static_cast<size_t>(of.state_count())), wrenches(bodies) {
    motion.bodies.resize(bodies);
    motion.arms.resize(1);
    robot.initial_state(x.data());
    robot.write_motion(t, x.data(), motion);
  }

  std::vector<double> derivatives(double at, const std::vector<double>& y) {
    std::vector<double> yd(y.size());
    robot.write_motion(at, y.data(), motion);
    robot.derivatives(at, y.data(), motion, wrenches, yd.data());
    return yd;
  }
  void rk4(double h) {
    const auto k1 = derivatives(t, x);
    const auto k2 = derivatives(t + 0.5 * h, plus(0.5 * h, k1));
    const auto k3 = derivatives(t + 0.5 * h, plus(0.5 * h, k2));
    const auto k4 = derivatives(t + h, plus(h, k3));
    for (size_t i = 0; i < x.size(); ++i) x[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
    finish(h);
  }
  /// Heun's method, as the solver rk2.
  void rk2(double h) {
    const auto k1 = derivatives(t, x);
    const auto k2 = derivatives(t + h, plus(h, k1));
    for (size_t i = 0; i < x.size(); ++i) x[i] += 0.5 * h * (k1[i] + k2[i]);
    finish(h);
  }
  bool switch_modes() {
    robot.write_motion(t, x.data(), motion);
    return robot.switch_modes(t, x.data(), motion, wrenches);
  }
  DynamicRobot::Output output() {
    robot.write_motion(t, x.data(), motion);
    return robot.output(t, x.data(), motion, wrenches);
  }

  DynamicRobot& robot;
  double t = 0.0;
  std::vector<double> x;
  CellMotion motion;
  std::vector<Wrench> wrenches;

 private:
  std::vector<double> plus(double h, const std::vector<double>& k) const {
    std::vector<double> y = x;
    for (size_t i = 0; i < y.size(); ++i) y[i] += h * k[i];
    return y;
  }
  void finish(double h) {
    t += h;
    switch_modes();
  }
};

}  // namespace takt
