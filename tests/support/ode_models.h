#pragma once
// Plant models with known solutions, and a system of them without any cell around.
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "server/simulation/solver/integrator.h"

namespace takt::test {

/// Names of solvers: those of SUNDIALS, and all that control their error.
inline const std::vector<std::string> kAdaptive{"cvode", "esdirk", "esdirk4", "ida"};
inline const std::vector<std::string> kErrorControlled{"automatic", "rosenbrock", "cvode",
                                                       "esdirk",    "esdirk4",    "ida"};

/// Models as one OdeSystem: no connections; `bodies` Parts without contact.
class LooseSystem {
 public:
  explicit LooseSystem(std::vector<PlantModel*> models, std::size_t bodies = 0)
      : components_(bodies),
        interaction_(components_, pairs_, {}),
        system_(std::move(models), interaction_, bodies, 0) {
    x.resize(static_cast<std::size_t>(system_.state_count()));
    system_.initial_state(x);
  }
  OdeSystem& system() { return system_; }
  std::unique_ptr<Integrator> solver(const std::string& name, double tolerance = 1e-6) const {
    return make_integrator({name, tolerance, 0.0}, system_);
  }
  /// Advances by `steps` steps of h from step number `first`. False where the solver fails.
  bool run(Integrator& solver, double h, int steps, int first = 0) {
    for (int i = first; i < first + steps; ++i) {
      system_.update_motion(h * i, x);
      if (!solver.advance(system_, h * i, h, x)) return false;
    }
    return true;
  }
  std::vector<double> x;

 private:
  std::vector<Component> components_;
  ComponentPairs pairs_;
  ComponentInteraction interaction_;
  OdeSystem system_;
};

class FreeModel : public PlantModel {
 public:
  void write_motion(double, const double*, CellMotion&) const override {}
};

/// u' = u (1 - u), w' = w u, y' = -2 t y^2: nonlinear, coupled, dependent on time, with a closed form.
/// Linearly implicit solvers get the true Jacobian, a wrong one, zeros, or no entries at all.
class NonlinearModel final : public FreeModel {
 public:
  enum class Jacobian { none, zero, wrong, exact };
  explicit NonlinearModel(Jacobian kind = Jacobian::none) : kind_(kind) {}
  int state_count() const override { return 3; }
  void initial_state(double* x) const override { x[0] = 0.2, x[1] = 1.0, x[2] = 1.0; }
  void derivatives(double t, const double* x, const CellMotion&, std::span<const Wrench>,
                   double* xdot) const override {
    xdot[0] = x[0] * (1.0 - x[0]);
    xdot[1] = x[1] * x[0];
    xdot[2] = -2.0 * t * x[2] * x[2];
  }
  void jacobian_pattern(std::vector<std::pair<int, int>>& entries) const override {
    if (kind_ != Jacobian::none) entries = {{0, 0}, {1, 0}, {1, 1}, {2, 2}};
  }
  void jacobian(double t, const double* x, const CellMotion&, double* values) const override {
    if (kind_ == Jacobian::none) return;
    const double share = kind_ == Jacobian::exact ? 1.0 : kind_ == Jacobian::wrong ? 0.6 : 0.0;
    values[0] = share * (1.0 - 2.0 * x[0]);
    values[1] = share * x[1];
    values[2] = share * x[0];
    values[3] = share * -4.0 * t * x[2];
  }
  void time_derivative(double, const double* x, const CellMotion&, double* rate) const override {
    if (kind_ == Jacobian::exact) rate[2] = -2.0 * x[2] * x[2];
  }
  static double error(double t, const std::vector<double>& x) {
    const double growth = 0.8 + 0.2 * std::exp(t);
    const double u = 0.2 * std::exp(t) / growth;
    return std::abs(x[0] - u) + std::abs(x[1] - growth) + std::abs(x[2] - 1.0 / (1.0 + t * t));
  }

 private:
  Jacobian kind_;
};

/// x' = -rate (x - sin t) + cos t, x(0) = offset: follows a moving reference, stiffly.
class StiffModel final : public FreeModel {
 public:
  StiffModel(double rate, double offset) : rate_(rate), offset_(offset) {}
  int state_count() const override { return 1; }
  void initial_state(double* x) const override { x[0] = offset_; }
  void derivatives(double t, const double* x, const CellMotion&, std::span<const Wrench>,
                   double* xdot) const override {
    xdot[0] = -rate_ * (x[0] - std::sin(t)) + std::cos(t);
  }
  void jacobian_pattern(std::vector<std::pair<int, int>>& entries) const override { entries = {{0, 0}}; }
  void jacobian(double, const double*, const CellMotion&, double* values) const override {
    values[0] = -rate_;
  }
  void time_derivative(double t, const double*, const CellMotion&, double* rate) const override {
    rate[0] = rate_ * std::cos(t) - std::sin(t);
  }

 private:
  double rate_, offset_;
};

/// A ball on a plate: falls, bounces with a coefficient of restitution. Modes: falling, rising.
class BouncingModel final : public FreeModel {
 public:
  static constexpr double kGravity = 9.80665, kHeight = 0.5, kRestitution = 0.8;
  int state_count() const override { return 2; }
  void initial_state(double* x) const override { x[0] = kHeight, x[1] = 0.0; }
  void derivatives(double, const double* x, const CellMotion&, std::span<const Wrench>,
                   double* xdot) const override {
    xdot[0] = x[1], xdot[1] = -kGravity;
  }
  int indicator_count() const override { return 1; }
  void indicators(double, const double* x, const CellMotion&, std::span<const Wrench>,
                  double* g) const override {
    g[0] = rising_ ? x[1] : x[0];
  }
  bool switch_modes(double t, double* x, const CellMotion&, std::span<const Wrench>) override {
    if (rising_ && x[1] <= 0.0) {
      rising_ = false;
      return true;
    }
    if (rising_ || x[0] > 0.0 || x[1] >= 0.0) return false;
    x[0] = 0.0, x[1] *= -kRestitution;
    bounces.push_back(t);
    rising_ = true;
    return true;
  }
  /// Time of bounce k = 0, 1, ...
  static double bounce_time(int k) {
    const double first = std::sqrt(2.0 * kHeight / kGravity);
    double t = first, flight = 2.0 * first;
    for (int i = 0; i < k; ++i) t += (flight *= kRestitution);
    return t;
  }
  std::vector<double> bounces;

 private:
  bool rising_ = false;
};

/// A mass of 1 kg pushed by F sin(w t) on a floor with true dry friction: sticks, breaks away, slides,
/// sticks.
class StickSlipModel final : public FreeModel {
 public:
  static constexpr double kForce = 3.0, kOmega = 2.0, kBreakAway = 2.0, kSliding = 1.2;
  int state_count() const override { return 2; }
  void initial_state(double* x) const override { x[0] = x[1] = 0.0; }
  void derivatives(double t, const double* x, const CellMotion&, std::span<const Wrench>,
                   double* xdot) const override {
    xdot[0] = x[1];
    xdot[1] = direction_ == 0 ? 0.0 : force(t) - direction_ * kSliding;
  }
  int indicator_count() const override { return 1; }
  void indicators(double t, const double* x, const CellMotion&, std::span<const Wrench>,
                  double* g) const override {
    g[0] = direction_ == 0 ? kBreakAway - std::abs(force(t)) : direction_ * x[1];
  }
  bool switch_modes(double t, double* x, const CellMotion&, std::span<const Wrench>) override {
    if (direction_ != 0) {
      // A body at break-away has speed zero and is accelerated; it has not stopped.
      if (direction_ * x[1] > 0.0 || direction_ * force(t) > kSliding) return false;
      x[1] = 0.0;
      direction_ = 0;
    } else {
      if (std::abs(force(t)) < kBreakAway) return false;
      direction_ = force(t) > 0.0 ? 1 : -1;
    }
    switches.push_back(t);
    return true;
  }
  static double force(double t) { return kForce * std::sin(kOmega * t); }
  static double break_away_time() { return std::asin(kBreakAway / kForce) / kOmega; }
  /// Speed while sliding for the first time.
  static double speed(double t) {
    const double t0 = break_away_time();
    return kForce / kOmega * (std::cos(kOmega * t0) - std::cos(kOmega * t)) - kSliding * (t - t0);
  }
  std::vector<double> switches;

 private:
  int direction_ = 0;
};

/// x' = 1 up to the corner at `corner`, x' = -2 after it.
class CornerModel final : public FreeModel {
 public:
  explicit CornerModel(double corner) : corner_(corner) {}
  int state_count() const override { return 1; }
  void initial_state(double* x) const override { x[0] = 0.0; }
  void derivatives(double t, const double*, const CellMotion&, std::span<const Wrench>,
                   double* xdot) const override {
    xdot[0] = t < corner_ ? 1.0 : -2.0;
  }
  double next_time_event(double t) const override {
    return t < corner_ ? corner_ : std::numeric_limits<double>::infinity();
  }

 private:
  double corner_;
};

/// Switches its mode at every call.
class RestlessModel final : public FreeModel {
 public:
  int state_count() const override { return 1; }
  void initial_state(double* x) const override { x[0] = 1.0; }
  void derivatives(double, const double*, const CellMotion&, std::span<const Wrench>,
                   double* xdot) const override {
    xdot[0] = sign_;
  }
  int indicator_count() const override { return 1; }
  void indicators(double, const double* x, const CellMotion&, std::span<const Wrench>,
                  double* g) const override {
    g[0] = -sign_ * (x[0] - 1.0005);  // holds until x crosses 1.0005, from either side
  }
  bool switch_modes(double, double* x, const CellMotion&, std::span<const Wrench>) override {
    if (sign_ * (x[0] - 1.0005) < 0.0) return false;
    sign_ = -sign_;
    return true;
  }

 private:
  double sign_ = 1.0;
};

/// An oscillator whose derivative is not a number at chosen calls.
class FaultyModel final : public FreeModel {
 public:
  int state_count() const override { return 2; }
  void initial_state(double* x) const override { x[0] = 1.0, x[1] = 0.0; }
  void derivatives(double, const double* x, const CellMotion&, std::span<const Wrench>,
                   double* xdot) const override {
    xdot[0] = x[1], xdot[1] = -kOmega * kOmega * x[0];
    ++calls;
    if (calls >= first_bad && calls <= last_bad) xdot[1] = std::numeric_limits<double>::quiet_NaN();
  }
  static double position(double t) { return std::cos(kOmega * t); }
  static constexpr double kOmega = 30.0;
  mutable long calls = 0;
  long first_bad = 0, last_bad = -1;
};

}  // namespace takt::test
