#pragma once
// Failures injected into a plant model at chosen calls, and a model with everything that solvers handle:
// events, a known corner, stiffness, a Jacobian, and all its modes in the state, so that it has no memory of
// its own.
#include <cmath>
#include <limits>
#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

#include "plant_models/plant_model.h"

namespace takt::test {

enum class FailureKind { not_a_number, infinite, thrown };

/// When the model fails; calls of all its functions are counted together.
struct FailurePlan {
  FailureKind kind = FailureKind::not_a_number;
  long first = 0, last = -1;  ///< calls that fail; none by default
  long calls = 0;

  /// Counts a call. True: its result must be spoilt.
  bool next() {
    const long call = ++calls;
    if (call < first || call > last) return false;
    if (kind == FailureKind::thrown) throw std::runtime_error("the injected failure");
    return true;
  }
  double value() const {
    return kind == FailureKind::infinite ? std::numeric_limits<double>::infinity()
                                         : std::numeric_limits<double>::quiet_NaN();
  }
};

/// Forwards everything to another model and spoils its results. The plan must outlive it.
class FailingModel final : public PlantModel {
 public:
  FailingModel(std::unique_ptr<PlantModel> inner, FailurePlan& plan)
      : inner_(std::move(inner)), plan_(plan) {}
  int state_count() const override { return inner_->state_count(); }
  void initial_state(double* x) const override { inner_->initial_state(x); }
  void write_motion(double t, const double* x, CellMotion& motion) const override {
    inner_->write_motion(t, x, motion);
    plan_.next();
  }
  void derivatives(double t, const double* x, const CellMotion& motion, std::span<const Wrench> wrenches,
                   double* xdot) const override {
    inner_->derivatives(t, x, motion, wrenches, xdot);
    if (plan_.next()) xdot[plan_.calls % state_count()] = plan_.value();
  }
  int indicator_count() const override { return inner_->indicator_count(); }
  void indicators(double t, const double* x, const CellMotion& motion, std::span<const Wrench> wrenches,
                  double* g) const override {
    inner_->indicators(t, x, motion, wrenches, g);
    if (plan_.next()) g[0] = plan_.value();
  }
  bool switch_modes(double t, double* x, const CellMotion& motion,
                    std::span<const Wrench> wrenches) override {
    const bool changed = inner_->switch_modes(t, x, motion, wrenches);
    if (plan_.next()) x[plan_.calls % state_count()] = plan_.value();
    return changed;
  }
  double next_time_event(double t) const override {
    const double event = inner_->next_time_event(t);
    return plan_.next() ? -plan_.value() : event;
  }
  void jacobian_pattern(std::vector<std::pair<int, int>>& entries) const override {
    inner_->jacobian_pattern(entries);
    entries_ = static_cast<long>(entries.size());
  }
  void jacobian(double t, const double* x, const CellMotion& motion, double* values) const override {
    inner_->jacobian(t, x, motion, values);
    if (plan_.next()) values[plan_.calls % entries_] = plan_.value();
  }
  void time_derivative(double t, const double* x, const CellMotion& motion, double* rate) const override {
    inner_->time_derivative(t, x, motion, rate);
    if (plan_.next()) rate[plan_.calls % state_count()] = plan_.value();
  }
  void state_scales(double* scales) const override { inner_->state_scales(scales); }

 private:
  std::unique_ptr<PlantModel> inner_;
  FailurePlan& plan_;
  mutable long entries_ = 0;
};

/// A mass of 1 kg on a floor with true dry friction, pushed by F sin(w t) and from kCorner on by kMore
/// besides, and a stiff follower of sin t. It breaks away forwards, slides, and has stopped for good at kEnd.
class SlidingModel final : public PlantModel {
 public:
  static constexpr double kForce = 3.0, kOmega = 200.0, kBreakAway = 2.6, kSliding = 1.8;
  static constexpr double kCorner = 0.0071, kMore = 0.5, kRate = 1000.0, kEnd = 0.02;
  enum State { position, speed, mode, follower };

  int state_count() const override { return 4; }
  void initial_state(double* x) const override {
    x[position] = x[speed] = x[mode] = 0.0;
    x[follower] = 1.0;
  }
  void write_motion(double, const double*, CellMotion&) const override {}
  void derivatives(double t, const double* x, const CellMotion&, std::span<const Wrench>,
                   double* xdot) const override {
    xdot[position] = x[speed];
    xdot[speed] = x[mode] == 0.0 ? 0.0 : force(t) - x[mode] * kSliding;
    xdot[mode] = 0.0;
    xdot[follower] = -kRate * (x[follower] - std::sin(t)) + std::cos(t);
  }
  int indicator_count() const override { return 1; }
  void indicators(double t, const double* x, const CellMotion&, std::span<const Wrench>,
                  double* g) const override {
    g[0] = x[mode] == 0.0 ? kBreakAway - std::abs(force(t)) : x[mode] * x[speed];
  }
  bool switch_modes(double t, double* x, const CellMotion&, std::span<const Wrench>) override {
    if (x[mode] != 0.0) {
      // A body at break-away has speed zero and is accelerated; it has not stopped.
      if (x[mode] * x[speed] > 0.0 || x[mode] * force(t) > kSliding) return false;
      x[speed] = x[mode] = 0.0;
      return true;
    }
    if (std::abs(force(t)) < kBreakAway) return false;
    x[mode] = force(t) > 0.0 ? 1.0 : -1.0;
    return true;
  }
  double next_time_event(double t) const override {
    return t < kCorner ? kCorner : std::numeric_limits<double>::infinity();
  }
  void jacobian_pattern(std::vector<std::pair<int, int>>& entries) const override {
    entries = {{position, speed}, {follower, follower}};
  }
  void jacobian(double, const double*, const CellMotion&, double* values) const override {
    values[0] = 1.0, values[1] = -kRate;
  }
  void time_derivative(double t, const double*, const CellMotion&, double* rate) const override {
    rate[follower] += kRate * std::cos(t) - std::sin(t);
  }
  void state_scales(double* scales) const override {
    scales[position] = 1e-3, scales[speed] = 1e-2, scales[mode] = scales[follower] = 1.0;
  }

  static double force(double t) { return kForce * std::sin(kOmega * t) + (t < kCorner ? 0.0 : kMore); }

  // Closed forms.
  static double break_away_time() { return std::asin(kBreakAway / kForce) / kOmega; }
  static double speed_at(double t) {
    const double t0 = break_away_time(), later = std::max(0.0, t - kCorner);
    return kForce / kOmega * (std::cos(kOmega * t0) - std::cos(kOmega * t)) - kSliding * (t - t0) +
           kMore * later;
  }
  static double stop_time() {
    double low = 0.015, high = kEnd;  // slides, would move backwards
    for (int i = 0; i < 100; ++i) {
      const double middle = 0.5 * (low + high);
      (speed_at(middle) > 0.0 ? low : high) = middle;
    }
    return low;
  }
  static double final_position() {
    const double t0 = break_away_time(), t = stop_time(), slid = t - t0, later = t - kCorner;
    return kForce / kOmega *
               (slid * std::cos(kOmega * t0) - (std::sin(kOmega * t) - std::sin(kOmega * t0)) / kOmega) -
           0.5 * kSliding * slid * slid + 0.5 * kMore * later * later;
  }
  static double final_follower() { return std::sin(kEnd) + std::exp(-kRate * kEnd); }
};

}  // namespace takt::test
