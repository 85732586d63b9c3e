// Levels of detail through the run loop: change, refusal, reset, and the state of a plant that fails.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/support/injected_failures.h"
#include "tests/support/loop_reader.h"
#include "tests/support/service_cell.h"

namespace takt {
namespace {

using test::LoopReader;

RunLoopOptions paused() {
  RunLoopOptions options;
  options.pace = Pace::free;
  options.state = SimulationState::paused;
  return options;
}

void expect_levels(LoopReader& reader, int level) {
  ASSERT_TRUE(reader.wait_until([&] { return reader.snapshot && reader.status; }));
  for (const RobotSample& robot : reader.snapshot->robots) EXPECT_EQ(robot.level_of_detail, level);
  ASSERT_EQ(reader.status->process_count, 1U);
  EXPECT_EQ(reader.status->process_levels[0], level);
}

bool finite(const Snapshot& snapshot) {
  bool good = true;
  for (const ComponentSample& c : snapshot.components)
    good = good && c.p_WB.allFinite() && c.q_WB.coeffs().allFinite() && c.V_WB.v.allFinite() &&
           c.V_WB.w.allFinite() && c.F_Bo_W.f.allFinite() && c.F_Bo_W.t.allFinite();
  for (const RobotSample& r : snapshot.robots) {
    for (int j = 0; j < kMaxJoints; ++j) {
      const auto k = static_cast<std::size_t>(j);
      good = good && std::isfinite(r.position[k]) && std::isfinite(r.velocity[k]) &&
             std::isfinite(r.effort[k]) && std::isfinite(r.power.mechanical_W[k]);
    }
    good = good && std::isfinite(r.power.electrical_W) && std::isfinite(r.power.electrical_energy_J) &&
           std::isfinite(r.power.mechanical_energy_J) && std::isfinite(r.power.mechanical_total_W);
  }
  for (const GripperSample& g : snapshot.grippers)
    good = good && std::isfinite(g.width_m) && std::isfinite(g.force_N);
  return good;
}

TEST(RunLoopLevel, ChangesAreReportedAndAResetKeepsTheLevel) {
  Simulation simulation(test::service_model());
  RunLoop loop(simulation, paused());
  LoopReader reader(loop);
  loop.start();
  const ControlReply changed = reader.request("set_level_of_detail", {{"level_of_detail", "2"}});
  ASSERT_EQ(changed.result, ControlResult::ok) << changed.message;
  EXPECT_EQ(changed.message, "The level of detail of all processes is now 2.");
  const auto event = reader.wait_for_event("level_of_detail_changed");
  ASSERT_TRUE(event);
  EXPECT_EQ(describe(*event, loop.cell()).message, changed.message);
  ASSERT_EQ(reader.request("step", {{"steps", "20"}}).result, ControlResult::ok);
  ASSERT_TRUE(reader.wait_until([&] { return reader.snapshot && reader.snapshot->step == 20; }));
  expect_levels(reader, 2);
  // The arm stands against gravity, idle power and all: torque of the shoulder's lift joint.
  EXPECT_GT(std::abs(reader.snapshot->robots[0].effort[1]), 10.0);

  ASSERT_EQ(reader.request("reset").result, ControlResult::ok);
  ASSERT_TRUE(reader.wait_until([&] { return reader.snapshot->epoch == 1 && reader.status->epoch == 1; }));
  expect_levels(reader, 2);
  EXPECT_EQ(reader.snapshot->step, 0U);
  EXPECT_GT(std::abs(reader.snapshot->robots[0].effort[1]), 10.0);
  loop.stop();
}

TEST(RunLoopLevel, ARobotWithoutInertiaKeepsItsLevelAndTheReasonIsReported) {
  const auto model = test::service_model();
  model->dynamics[1].reset();
  model->no_dynamics[1] = "the link 'forearm_link' has no inertia";
  Simulation simulation(model);
  RunLoop loop(simulation, paused());
  LoopReader reader(loop);
  loop.start();
  const ControlReply refused = reader.request("set_level_of_detail", {{"level_of_detail", "2"}});
  EXPECT_EQ(refused.result, ControlResult::failed);
  EXPECT_EQ(refused.message,
            "The level of detail stays as it is: Robot2 can only be kinematic: the link 'forearm_link' has "
            "no inertia");
  EXPECT_EQ(reader.count("level_of_detail_changed"), 0U);
  expect_levels(reader, 1);
  EXPECT_EQ(reader.request("step").result, ControlResult::ok);
  loop.stop();
}

TEST(RunLoopLevel, SurfaceContactNeedsItsSection) {
  Simulation simulation(test::service_model());
  RunLoop loop(simulation, paused());
  LoopReader reader(loop);
  loop.start();
  const ControlReply refused = reader.request("set_level_of_detail", {{"level_of_detail", "3"}});
  EXPECT_EQ(refused.result, ControlResult::failed);
  EXPECT_EQ(refused.message,
            "The level of detail stays as it is: surface contact was not prepared: the scenario has no "
            "section 'contact' and no process that begins at level 3");
  expect_levels(reader, 1);
  EXPECT_FALSE(reader.snapshot->contacts.acting);
  loop.stop();
}

TEST(RunLoopLevel, ContactsArePublishedAtLevelThree) {
  Simulation simulation(test::service_contact_model());
  RunLoop loop(simulation, paused());
  LoopReader reader(loop);
  loop.start();
  const ControlReply changed = reader.request("set_level_of_detail", {{"level_of_detail", "3"}});
  ASSERT_EQ(changed.result, ControlResult::ok) << changed.message;
  ASSERT_EQ(reader.request("step", {{"steps", "300"}}).result, ControlResult::ok);
  ASSERT_TRUE(reader.wait_until([&] { return reader.snapshot && reader.snapshot->step == 300; }));
  ASSERT_TRUE(reader.snapshot->contacts.acting);
  ASSERT_EQ(reader.snapshot->contacts.count, 2U);  // P and C on the table
  double sum = 0.0;
  for (const ContactSample& pair : reader.snapshot->contacts.pressing()) sum += pair.result.normal_force_N;
  EXPECT_NEAR(sum, 0.8 * 9.80665, 0.01 * 0.8 * 9.80665);
  ASSERT_EQ(reader.request("reset").result, ControlResult::ok);
  ASSERT_TRUE(reader.wait_until([&] { return reader.snapshot->epoch == 1; }));
  EXPECT_TRUE(reader.snapshot->contacts.acting) << "a reset keeps the level";
  EXPECT_EQ(reader.snapshot->contacts.count, 0U) << "at the start they touch, and nothing presses yet";
  loop.stop();
}

TEST(RunLoopLevel, ADivergingPlantPausesTheLoopAndOnlyFiniteNumbersArePublished) {
  const auto model = test::service_model();
  // Servos far too fast for a fixed step of 1 ms, with motors without limits.
  for (auto& robot : model->dynamics) {
    for (DriveParameters& drive : robot->drives)
      std::visit(
          [](auto& d) {
            if constexpr (requires { d.frequency_rad_per_s; }) d.frequency_rad_per_s = 1e6;
            if constexpr (requires { d.max_torque; }) d.max_torque = std::numeric_limits<double>::infinity();
            if constexpr (requires { d.speed_gain_per_s; }) d.speed_gain_per_s = 1e6;
          },
          drive);
  }
  Simulation simulation(model);
  bool all_finite = true;
  RunLoopOptions options = paused();
  options.on_instant = [&](const Simulation& s) { all_finite = all_finite && finite(s.make_snapshot()); };
  RunLoop loop(simulation, options);
  LoopReader reader(loop);
  loop.start();
  ASSERT_EQ(reader.request("set_level_of_detail", {{"level_of_detail", "2"}}).result, ControlResult::ok);
  JointCommand command = test::swing(0, 0.5);
  command.stamp = {};
  command.velocity = {};
  loop.append(command, 1, monotonic_now_ns());
  ASSERT_EQ(reader.request("set_state", {{"state", "1"}}).result, ControlResult::ok);
  const auto fault = reader.wait_for_event("simulation_fault");
  ASSERT_TRUE(fault);
  const std::string reported = describe(*fault, loop.cell()).message;
  EXPECT_NE(reported.find("of Robot"), std::string::npos) << reported;
  ASSERT_TRUE(reader.wait_until([&] { return reader.status && !reader.status->fault.empty(); }));
  EXPECT_EQ(reader.status->state, SimulationState::paused);
  EXPECT_TRUE(finite(*reader.snapshot));
  EXPECT_EQ(reader.request("reset").result, ControlResult::ok);
  EXPECT_EQ(reader.request("step").result, ControlResult::ok);
  loop.stop();
  EXPECT_TRUE(all_finite);
}

/// One failure of a plant model, at a call in the middle of the run, at level of detail 2.
void expect_pause_and_event(std::string_view solver, test::FailureKind kind, const std::string& reason) {
  SCOPED_TRACE(std::string(solver) + ", kind " + std::to_string(static_cast<int>(kind)));
  const auto model = test::service_model();
  model->solver.name = solver;
  model->robot_levels.assign(model->robots.size(), 2);
  test::FailurePlan plan;
  plan.kind = kind, plan.first = 40;
  plan.last = kind == test::FailureKind::thrown ? 40 : 10'000;  // numbers: longer than solvers try again
  model->auxiliary_models.push_back({"the mass", [&plan] {
                                       return std::make_unique<test::FailingModel>(
                                           std::make_unique<test::SlidingModel>(), plan);
                                     }});
  Simulation simulation(model);
  bool all_finite = true;
  RunLoopOptions options;
  options.pace = Pace::free;
  options.on_instant = [&](const Simulation& s) { all_finite = all_finite && finite(s.make_snapshot()); };
  RunLoop loop(simulation, options);
  LoopReader reader(loop);
  loop.start();
  const auto fault = reader.wait_for_event("simulation_fault");
  ASSERT_TRUE(fault);
  EXPECT_NE(describe(*fault, loop.cell()).message.find(reason), std::string::npos)
      << describe(*fault, loop.cell()).message;
  ASSERT_TRUE(reader.wait_until([&] { return reader.status && !reader.status->fault.empty(); }));
  EXPECT_EQ(reader.status->state, SimulationState::paused);
  const std::uint64_t step = reader.status->step;
  EXPECT_EQ(reader.request("step").result, ControlResult::incorrect_state);
  EXPECT_EQ(reader.status->step, step);
  // The loop still answers, and its answers are finite.
  EXPECT_EQ(reader.request("explain_part", {{"part", "P"}}).result, ControlResult::ok);
  loop.stop();
  EXPECT_TRUE(all_finite);
  EXPECT_TRUE(finite(simulation.make_snapshot()));

  plan.last = -1;
  RunLoopOptions again = options;
  again.state = SimulationState::paused;
  RunLoop second(simulation, again);
  LoopReader second_reader(second);
  second.start();
  ASSERT_EQ(second_reader.request("reset").result, ControlResult::ok);
  EXPECT_EQ(second_reader.request("step", {{"steps", "10"}}).result, ControlResult::ok);
  second.stop();
  EXPECT_EQ(simulation.step_index(), 10U);
  EXPECT_EQ(simulation.fault(), "");
  EXPECT_TRUE(all_finite);
}

/// A Part that spins too fast for the step: its quaternion grows, and at last diverges.
TEST(RunLoopFault, PeriodicSnapshotsOfARunawayAreRefusedWithAnEvent) {
  const auto model = test::service_model();
  Simulation simulation(model);
  RunLoopOptions options = paused();
  options.save_every_s = 1e-9;  // after every step
  RunLoop loop(simulation, options);
  LoopReader reader(loop);
  loop.start();
  ASSERT_EQ(reader.request("step", {{"steps", "10"}}).result, ControlResult::ok);
  const std::string part = loop.cell().components[static_cast<std::size_t>(model->parts.front().body)].name;
  ASSERT_EQ(reader.request("set_entity_state", {{"entity", part}, {"angular_velocity", "0 0 10000"}}).result,
            ControlResult::ok);
  ASSERT_EQ(reader.request("set_state", {{"state", "1"}}).result, ControlResult::ok);
  ASSERT_TRUE(reader.wait_for_event("simulation_fault"));
  ASSERT_EQ(reader.count("snapshot_failed"), 1U) << "reported once";
  const auto refused = reader.wait_for_event("snapshot_failed");
  const EventText reported = describe(*refused, loop.cell());
  EXPECT_NE(reported.message.find("was not taken: the state"), std::string::npos) << reported.message;
  loop.stop();
  const SavedState* newest = loop.saver().saved().take();
  ASSERT_NE(newest, nullptr);
  Simulation other(model);
  EXPECT_EQ(other.restore_state(newest->bytes), "") << "the newest one that was taken is good";
}

TEST(RunLoopFault, ASolverThatGivesUpPausesTheCellWithAnEvent) {
  expect_pause_and_event("rk2", test::FailureKind::not_a_number, "of the mass");
  for (const std::string_view solver : {"implicit", "cvode", "esdirk", "ida"})
    for (const auto kind : {test::FailureKind::not_a_number, test::FailureKind::infinite})
      expect_pause_and_event(solver, kind, "the last accepted state is kept");
}

TEST(RunLoopFault, APlantModelThatThrowsPausesTheCellWithAnEvent) {
  for (const std::string_view solver : solver_names())
    expect_pause_and_event(solver, test::FailureKind::thrown, "the injected failure");
}

}  // namespace
}  // namespace takt
