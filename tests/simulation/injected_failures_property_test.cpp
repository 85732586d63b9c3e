// Failures injected into any call of a plant model, with every solver: recovered, or reported in a sentence;
// invalid numbers never leave the solver, and the state stays the last accepted one.
#include <gtest/gtest.h>

#include <cmath>

#include "server/simulation/step/simulation.h"
#include "tests/support/effort.h"
#include "tests/support/injected_failures.h"
#include "tests/support/ode_models.h"
#include "tests/support/service_cell.h"

namespace takt::test {
namespace {

constexpr FailureKind kKinds[] = {FailureKind::not_a_number, FailureKind::infinite, FailureKind::thrown};
constexpr long kForEver = std::numeric_limits<long>::max();
constexpr double kTolerance = 1e-5, kStep = 0.001;
constexpr int kSteps = 20;

std::string reported(std::string_view solver, FailureKind kind, long call) {
  return std::string(solver) + ", kind " + std::to_string(static_cast<int>(kind)) + ", call " +
         std::to_string(call);
}

bool finite(const std::vector<double>& x) {
  return std::all_of(x.begin(), x.end(), [](double value) { return std::isfinite(value); });
}

/// The sliding mass with a solver.
struct Slide {
  explicit Slide(std::string_view name)
      : model(std::make_unique<SlidingModel>(), plan),
        loose({&model}),
        solver(loose.solver(std::string(name), kTolerance)) {}

  /// Steps up to the end or a failure, which keeps x of the step's start. The number of the next step.
  int run(int step = 0) {
    for (; step < kSteps; ++step) {
      const std::vector<double> accepted = loose.x;
      try {
        loose.system().update_motion(kStep * step, loose.x);
      } catch (const std::runtime_error&) {  // outside of the solver
        loose.x = accepted;
        return step;
      }
      if (!solver->advance(loose.system(), kStep * step, kStep, loose.x)) {
        EXPECT_NE(solver->failure(), "");
        loose.x = accepted;
        return step;
      }
      EXPECT_EQ(solver->failure(), "");
      if (!finite(loose.x)) return -1;
    }
    return step;
  }

  FailurePlan plan;
  FailingModel model;
  LooseSystem loose;
  std::unique_ptr<Integrator> solver;
};

void expect_right(std::string_view name, const std::vector<double>& x, const std::vector<double>& good) {
  if (!solver_has_error_control(name)) {
    EXPECT_EQ(x, good);
    return;
  }
  EXPECT_NEAR(x[SlidingModel::position], SlidingModel::final_position(), 2e-7);
  EXPECT_EQ(x[SlidingModel::speed], 0.0);
  EXPECT_EQ(x[SlidingModel::mode], 0.0);
  EXPECT_NEAR(x[SlidingModel::follower], SlidingModel::final_follower(), 1e-3);
}

/// One plan of failures with one solver; returns whether the solver recovered.
bool expect_recovery_or_reason(std::string_view name, FailureKind kind, long first, long last,
                               const std::vector<double>& good) {
  SCOPED_TRACE(reported(name, kind, first));
  Slide slide(name);
  slide.plan.kind = kind, slide.plan.first = first, slide.plan.last = last;
  const int reached = slide.run();
  EXPECT_GE(reached, 0) << "a state that is not finite got out";
  const bool recovered = reached == kSteps;
  if (recovered) expect_right(name, slide.loose.x, good);
  EXPECT_LT(slide.plan.calls, 60'000);

  slide.plan.last = -1;
  if (!recovered) {
    // From the last accepted state on, as a new solver.
    Slide fresh(name);
    fresh.loose.x = slide.loose.x;
    slide.solver->restart();
    EXPECT_EQ(slide.run(reached), kSteps) << slide.solver->failure();
    EXPECT_EQ(fresh.run(reached), kSteps);
    EXPECT_EQ(slide.loose.x, fresh.loose.x) << "after a restart in step " << reached;
    expect_right(name, slide.loose.x, good);
  }
  slide.loose.system().initial_state(slide.loose.x);
  slide.solver->reset();
  EXPECT_EQ(slide.run(), kSteps) << slide.solver->failure();
  EXPECT_EQ(slide.loose.x, good) << "after a reset";
  return recovered;
}

TEST(InjectedFailures, AFailureInAnyCallEndsInRecoveryOrAReason) {
  for (const std::string_view name : solver_names()) {
    Slide good(name);
    ASSERT_EQ(good.run(), kSteps) << name << ": " << good.solver->failure();
    EXPECT_GE(good.solver->statistics().mode_switches, 2U) << name;
    const long calls = good.plan.calls;
    ASSERT_GT(calls, 5 * kSteps) << name;
    int recovered = 0;
    long tried = 0;
    for (const FailureKind kind : kKinds) {
      // Every call of the first steps and of those around events, then every seventh; a fifth of them in the
      // short form.
      const long apart = effort() > 1 ? 1 : 5;
      for (long k = 1; k <= calls && !HasFailure(); k += k < 400 ? apart : 7 * apart, ++tried)
        recovered += expect_recovery_or_reason(name, kind, k, k, good.loose.x) ? 1 : 0;
    }
    // Solvers with error control recover from most transient failures.
    if (solver_has_error_control(name)) {
      EXPECT_GT(recovered, tried / 5) << name;
    }
    RecordProperty(std::string(name), std::to_string(recovered) + " of " + std::to_string(tried));
  }
}

TEST(InjectedFailures, APersistentFailureEndsWithAReason) {
  for (const std::string_view name : solver_names()) {
    Slide good(name);
    ASSERT_EQ(good.run(), kSteps) << name << ": " << good.solver->failure();
    for (const FailureKind kind : kKinds)
      for (long k = 1; k < good.plan.calls - 5 && !HasFailure(); k += k < 100 ? 1 : 41)
        EXPECT_FALSE(expect_recovery_or_reason(name, kind, k, kForEver, good.loose.x)) << k;
  }
}

bool finite(const Snapshot& snapshot) {
  return std::all_of(snapshot.components.begin(), snapshot.components.end(), [](const ComponentSample& c) {
    return c.p_WB.allFinite() && c.q_WB.coeffs().allFinite() && c.V_WB.v.allFinite() &&
           c.V_WB.w.allFinite() && c.F_Bo_W.f.allFinite() && c.F_Bo_W.t.allFinite();
  });
}

TEST(InjectedFailures, ACellKeepsItsLastStateAndRestartsAfterAReset) {
  constexpr std::uint64_t kCellSteps = 8;  // the mass breaks away and passes the corner
  for (const std::string_view name : solver_names()) {
    const auto model = service_model();
    model->solver.name = name;
    FailurePlan plan;
    model->auxiliary_models.push_back(
        {"the mass",
         [&plan] { return std::make_unique<FailingModel>(std::make_unique<SlidingModel>(), plan); }});
    Simulation simulation(model);
    Snapshot snapshot = simulation.make_snapshot();
    const auto run = [&] {
      while (simulation.step_index() < kCellSteps && simulation.step({})) simulation.read_snapshot(snapshot);
    };
    plan.calls = 0;
    run();
    ASSERT_EQ(simulation.fault(), "") << name;
    const long calls = plan.calls;
    const std::uint64_t good_hash = simulation.state_hash();
    int faults = 0;
    for (const FailureKind kind : kKinds) {
      for (long k = 1; k <= calls && !HasFailure(); k += 1 + calls / 60) {
        SCOPED_TRACE(reported(name, kind, k));
        plan.last = -1;
        simulation.reset();
        plan.kind = kind, plan.first = plan.last = k, plan.calls = 0;
        run();
        EXPECT_TRUE(finite(snapshot));
        if (simulation.step_index() == kCellSteps && simulation.fault().empty()) continue;
        ++faults;
        EXPECT_NE(simulation.fault().find("; the last accepted state is kept"), std::string::npos)
            << simulation.fault();
        if (kind == FailureKind::thrown) {
          EXPECT_NE(simulation.fault().find("the injected failure"), std::string::npos) << simulation.fault();
        }
        const std::uint64_t step = simulation.step_index(), hash = simulation.state_hash();
        EXPECT_FALSE(simulation.step({}));
        simulation.read_snapshot(snapshot);
        EXPECT_EQ(snapshot.step, step);
        EXPECT_EQ(snapshot.state_hash, hash);
        EXPECT_TRUE(finite(snapshot));

        simulation.reset();
        EXPECT_EQ(simulation.fault(), "");
        run();
        EXPECT_EQ(simulation.state_hash(), good_hash);
      }
    }
    EXPECT_GT(faults, 0) << name;
  }
}

}  // namespace
}  // namespace takt::test
