// In steady state the step loop does not allocate: counted in the loop's thread.
#include <gtest/gtest.h>

#include <array>
#include <memory>

#include "server/headless/in_process_controller.h"
#include "server/runtime/loop/run_loop.h"
#include "server/runtime/recording/log_recorder.h"
#include "tests/support/algorithm_cells.h"
#include "tests/support/loop_reader.h"
#include "tests/support/ode_models.h"
#include "tests/support/service_cell.h"
#include "tests/support/step_path_counts.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/thrown_bricks.h"

namespace takt {
namespace {

using test::allocations;
using test::counting;

TEST(SolverAllocation, StepsAfterTheFirstAllocateNothing) {
  // Of our own; SUNDIALS takes its memory by malloc, when it is made and at its first step.
  for (const std::string_view name : solver_names()) {
    test::NonlinearModel model(test::NonlinearModel::Jacobian::exact);
    test::BouncingModel ball;
    ball.bounces.reserve(100);
    test::LooseSystem loose({&model, &ball});
    const auto solver = loose.solver(std::string(name));
    ASSERT_TRUE(loose.run(*solver, 0.004, 2));
    allocations = 0;
    counting = true;
    const bool good = loose.run(*solver, 0.004, 200, 2);
    counting = false;
    EXPECT_TRUE(good) << name;
    EXPECT_GE(ball.bounces.size(), 1U) << name;
    EXPECT_EQ(allocations, 0U) << name;
  }
}

// Candidate lists grow when more elements come near than ever, and keep their memory.
TEST(ContactAllocation, ListsGrowAFewTimesAndNeverForKnownPoses) {
  if constexpr (kMaxLevelOfDetail < 3) GTEST_SKIP() << "needs level of detail 3";
  for (const char* name :
       {"drop", "sliding_block", "stack_of_ten", "peg_in_hole_100um", "incline", "two_layers"}) {
    for (const char* solver : {"automatic", "rosenbrock", "cvode", "implicit"}) {
      ScenarioOptions options;
      options.overrides = {"solver.method=" + std::string(solver)};
      Simulation simulation(load_cell(
          std::filesystem::path(TAKT_CONFIG_DIR) / "scenarios" / "contact" / (std::string(name) + ".yaml"),
          options));
      const auto run = [&simulation](double end_s) {
        bool good = true;
        allocations = 0;
        counting = true;
        while (good && simulation.time_s() < end_s) good = simulation.step({});
        counting = false;
        EXPECT_TRUE(good) << simulation.fault();
        return allocations;
      };
      run(0.2);
      // A cluster that needs lists for the first time makes some twenty arrays. How many clusters do depends
      // on the motion: the most is 502 arrays, of the peg by cvode.
      EXPECT_LE(run(0.5), 600U) << name << ' ' << solver;
      EXPECT_GT(simulation.contact_counts().elements, 0U);
      // The bound of motion within which lists hold is learnt, and with it their length: two more passes.
      std::uint64_t last = 1;
      for (int pass = 0; pass < 3; ++pass) {
        simulation.reset();
        simulation.step({});
        last = run(0.5);
      }
      EXPECT_EQ(last, 0U) << name << ' ' << solver;
    }
  }
}

// Islands are made, joined and integrated again in many steps.
TEST(ContactAllocation, StepsByIslandsAllocateNothingForKnownPoses) {
  if constexpr (kMaxLevelOfDetail < 3) GTEST_SKIP() << "needs level of detail 3";
  const test::Bricks bricks;
  for (const auto& [solver, cell] : {std::pair{"method: automatic, step_s: 0.008", test::Bricks::all()},
                                     {"method: rosenbrock, step_s: 0.008", test::Bricks::all()},
                                     {"method: rosenbrock, step_s: 0.008", test::Bricks::pile(6)}}) {
    Simulation simulation(bricks.cell(cell, solver));
    std::array<std::uint64_t, 4> passes{};
    for (std::uint64_t& pass : passes) {
      simulation.reset();
      allocations = 0;
      counting = true;
      for (int i = 0; i < 40 && simulation.fault().empty(); ++i) simulation.step({});
      counting = false;
      pass = allocations;
      EXPECT_EQ(simulation.fault(), "");
    }
    EXPECT_GT(passes.front(), 0U) << "nothing is counted";
    EXPECT_EQ(passes.back(), 0U) << solver;
  }
}

// Parts gripped, lifted, slid into one another and released by surface contact: lists are rebuilt repeatedly,
// and the first pass of a motion allocates all memory for the second.
TEST(ContactAllocation, ASecondAssemblyOfTheBlocksAllocatesNothing) {
  if constexpr (kMaxLevelOfDetail < 3) GTEST_SKIP() << "needs level of detail 3";
  ScenarioOptions options;
  options.level_of_detail = 3;
  options.overrides = {"solver.method=implicit", "solver.step_s=0.001"};
  const Scenario scenario =
      read_scenario(std::filesystem::path(TAKT_CONFIG_DIR) / "scenarios" / "block_assembly.yaml", options);
  Simulation simulation(build_cell(scenario));
  std::array<std::uint64_t, 2> total{}, lists{};
  for (std::size_t pass = 0; pass < 2; ++pass) {
    simulation.reset();
    InProcessController controller(scenario.controller_program.string(), simulation);
    const std::uint64_t before = simulation.contact_counts().rebuilds;
    allocations = 0;
    while (simulation.time_s() < 12.0) {
      const auto commands = controller.commands(simulation);
      counting = true;
      const bool good = simulation.step(commands);
      counting = false;
      ASSERT_TRUE(good) << simulation.fault();
    }
    total[pass] = allocations;
    lists[pass] = simulation.contact_counts().rebuilds - before;
  }
  EXPECT_GT(total[0], 0U) << "nothing is counted";
  EXPECT_GE(lists[1], 20U) << "too few lists were made to tell";
  EXPECT_EQ(total[1], 0U);
}

TEST(RunLoopAllocation, TheLoopAllocatesNothingInSteadyStateWithCommands) {
  const auto file = test::write_service_scenario();
  std::ofstream(file, std::ios::app) << "collision_checking: {min_clearance_m: 0.05}\n";
  const auto model = std::make_shared<CellModel>(*load_cell(file));
  std::filesystem::remove(file);
  model->description.cell = "cell";
  Simulation simulation(model);
  constexpr std::uint64_t kWarm = 500, kEnd = 6000;
  std::uint64_t counted_in_loop = 0, counted_with_one = 0;
  RunLoopOptions options;
  options.pace = Pace::free;
  options.state = SimulationState::paused;
  options.on_instant = [&](const Simulation& now) {
    if (now.step_index() == kWarm) {
      allocations = 0;
      counting = true;
    } else if (now.step_index() == kEnd) {
      counted_in_loop = allocations;
      ::operator delete(
          ::operator new(1));  // checks that the counter counts; `new int` may be optimised away
      counted_with_one = allocations;
      counting = false;
    }
  };
  RunLoop loop(simulation, options);
  test::LoopReader reader(loop);
  const test::TemporaryDirectory directory;
  LogRecorder recorder(directory / "run", {});
  ASSERT_EQ(recorder.begin_scenario({}, simulation, true), "");
  loop.record_with(&recorder);
  loop.start();
  // One request before the counting begins; commands come in all the while.
  const auto steps = reader.submit("step", {{"steps", std::to_string(kEnd)}});
  std::uint64_t sent = 0;
  ASSERT_TRUE(reader.wait_until([&] {
    if (reader.snapshot && !loop.append(test::swing(0, reader.snapshot->time_s), 1, monotonic_now_ns()))
      ++sent;
    return reader.snapshot && reader.snapshot->step >= kEnd;
  }));
  EXPECT_EQ(reader.reply_to(steps)->result, ControlResult::ok);
  loop.stop();
  EXPECT_EQ(counted_in_loop, 0U);
  EXPECT_EQ(counted_with_one, 1U);
  EXPECT_GT(recorder.records(), 6U) << "nothing was recorded";
  EXPECT_FALSE(recorder.failed()) << recorder.failure();
  Snapshot snapshot = simulation.make_snapshot();
  simulation.read_snapshot(snapshot);
  EXPECT_GT(snapshot.robots[0].commands_applied, 1U) << "no command was applied while counting";
  EXPECT_GT(sent, 1U);
  EXPECT_GT(simulation.statistics().clearance_distances, 100U) << "collision checking took part";
}

// Dynamic robots: two arms with grippers under commands, and detailed drives with stick-slip.
TEST(StepAllocation, AStepAtLevelTwoAllocatesNothing) {
  struct Case {
    const char* scenario;
    const char* solver;
    const char* step_s;
    const char* matrix = "automatic";
  };
  for (const Case& c :
       {Case{"block_assembly", "rk2", "0.001"}, Case{"block_assembly", "implicit", "0.001"},
        Case{"robot_r3", "rk2", "0.00002"}, Case{"robot_r3", "implicit", "0.0001"},
        Case{"robot_r3", "cvode", "0.001"}, Case{"block_assembly", "rosenbrock", "0.001"},
        Case{"block_assembly", "rosenbrock", "0.008"}, Case{"block_assembly", "implicit", "0.001", "coupled"},
        Case{"block_assembly", "cvode", "0.001", "coupled"}, Case{"robot_r3", "rosenbrock", "0.001"}}) {
    SCOPED_TRACE(std::string(c.scenario) + " " + c.solver);
    ScenarioOptions options;
    options.overrides = {std::string("solver.method=") + c.solver, std::string("solver.step_s=") + c.step_s,
                         std::string("solver.matrix=") + c.matrix};
    options.level_of_detail = 2;
    const auto model =
        load_cell(std::string(TAKT_CONFIG_DIR) + "/scenarios/" + c.scenario + ".yaml", options);
    Simulation simulation(model);
    Snapshot snapshot = simulation.make_snapshot();
    ASSERT_EQ(simulation.level_of_detail(0), 2);
    const bool commanded = !model->grippers.empty();
    allocations = 0;
    for (int i = 0; i < 600; ++i) {
      std::vector<Command> commands;
      if (commanded && i % 8 == 0) commands.push_back(test::swing(0, simulation.time_s()));
      if (commanded && i % 200 == 100)
        commands.push_back(
            GripperCommand{0, {}, i == 100 ? GripperAction::close : GripperAction::open, 0.0, 0.0});
      counting = i > 0;
      const bool stepped = simulation.step(commands);
      simulation.read_snapshot(snapshot);
      counting = false;
      ASSERT_TRUE(stepped) << simulation.fault();
    }
    EXPECT_EQ(allocations, 0U);
    if (!commanded) {
      EXPECT_GT(simulation.statistics().solver.mode_switches, 4U);
    }
    double fastest = 0.0;
    for (const double speed : snapshot.robots[0].velocity) fastest = std::max(fastest, std::abs(speed));
    EXPECT_GT(fastest, 1e-4);
  }
}

// The state as bytes needs no allocation once the vector has grown, except for solvers that saving restarts.
TEST(SaveAllocation, ASaveWithReservedMemoryAllocatesNothing) {
  for (const char* solver : {"rk2", "implicit", "rosenbrock"}) {
    ScenarioOptions options;
    options.overrides = {std::string("solver.method=") + solver};
    options.level_of_detail = 2;
    Simulation simulation(
        load_cell(std::string(TAKT_CONFIG_DIR) + "/scenarios/block_assembly.yaml", options));
    std::vector<std::byte> bytes;
    simulation.save_state(bytes);
    bytes.reserve(2 * bytes.size());
    allocations = 0;
    for (int i = 0; i < 50; ++i) {
      ASSERT_TRUE(simulation.step({})) << simulation.fault();
      counting = true;
      simulation.save_state(bytes);
      counting = false;
    }
    EXPECT_EQ(allocations, 0U) << solver;
    EXPECT_EQ(Simulation(std::make_shared<const CellModel>(simulation.model())).restore_state(bytes), "");
  }
}

// Parts at rest by surface contact: reading contacts into a snapshot does not allocate.
TEST(StepAllocation, ReadingContactsAllocatesNothing) {
  Simulation simulation(test::service_contact_model());
  ASSERT_EQ(simulation.set_level_of_detail(-1, 3), "");
  Snapshot snapshot = simulation.make_snapshot();
  for (int i = 0; i < 200; ++i) ASSERT_TRUE(simulation.step({})) << simulation.fault();
  simulation.read_snapshot(snapshot);
  allocations = 0;
  for (int i = 0; i < 100; ++i) {
    const bool stepped = simulation.step({});
    counting = true;
    simulation.read_snapshot(snapshot);
    counting = false;
    ASSERT_TRUE(stepped) << simulation.fault();
  }
  EXPECT_EQ(snapshot.contacts.count, 2U);
  EXPECT_EQ(allocations, 0U);
}

TEST(StepAllocation, AStepUnderAnyAlgorithmAllocatesNothing) {
  test::RandomCellOptions options;
  options.seed = 5;
  options.parts = 40;
  const test::RandomCell cell(options);
  for (const InteractionAlgorithm algorithm :
       {InteractionAlgorithm::substitute_force, InteractionAlgorithm::extended_substitute_force,
        InteractionAlgorithm::partner_search}) {
    Simulation simulation(test::under_algorithm(cell, algorithm));
    std::size_t changes = 0;
    allocations = 0;
    for (int i = 0; i < 4000; ++i) {
      // All hands close, and open again.
      std::vector<Command> commands;
      const auto action = i % 1000 < 500 ? GripperAction::close : GripperAction::open;
      for (int g = 0; g < options.grippers && i % 500 == 0; ++g)
        commands.push_back(GripperCommand{g, {}, action, 0.0, 0.0});
      counting = i > 0;
      const bool stepped = simulation.step(commands);
      counting = false;
      ASSERT_TRUE(stepped) << simulation.fault();
      changes += simulation.events().connection_changes.size();
    }
    EXPECT_EQ(allocations, 0U) << to_string(algorithm);
    EXPECT_GT(changes, 0U);
  }
}

}  // namespace
}  // namespace takt
