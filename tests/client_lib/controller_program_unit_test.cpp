// Programs: waits, signals, the view of the cell, and errors with their place.
#include <gmock/gmock.h>

#include "tests/support/controller_test_cell.h"

namespace takt::controller {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

/// Time of the first update in which the gripper's command closes; the marks of these programs. -1: not
/// within 60 s.
double closing_time(const std::string& text, int gripper = 0) {
  const ProgramFile file(text);
  const CellDescription cell = block_cell();
  Controller controller(file.path(), cell);
  IdealPlant plant(controller, cell);
  double time_s = -1.0;
  plant.run(60.0, [&](const Output& output) {
    for (const GripperSetPoint& command : output.grippers) {
      if (command.gripper == gripper && command.verb == GripperAction::close) time_s = plant.time_s();
    }
    return time_s >= 0.0 || output.finished;
  });
  return time_s;
}

/// The exception of update() or of the constructor within 60 s.
std::string error_of(const std::string& text) {
  const ProgramFile file(text);
  const CellDescription cell = block_cell();
  try {
    Controller controller(file.path(), cell);
    IdealPlant plant(controller, cell);
    plant.run(60.0, [](const Output& output) { return output.finished; });
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "no error";
}

std::string in_routine(const std::string& body) {
  return "routine('Robot1', function(r)\n" + body + "\nend)\n";
}

TEST(Program, AProgramWaitsForTimes) {
  EXPECT_NEAR(closing_time(in_routine("r:wait_until(3.8) r.gripper:close()")), 3.8, 1e-12);
  EXPECT_NEAR(closing_time(in_routine("r:wait_until(4.9) r.gripper:close()")), 4.904, 1e-12);
  EXPECT_NEAR(closing_time(in_routine("r:wait(1.0) r:wait(0.5) r.gripper:close()")), 1.504, 0.0041);
  EXPECT_EQ(closing_time(in_routine("r:wait_until(-1) r:wait(0) r.gripper:close()")), 0.0);
  EXPECT_NEAR(closing_time("period_s = 0.25\n" + in_routine("r:wait(1) r.gripper:close()")), 1.0, 1e-12);
}

TEST(Program, TheProgramContinuesWhenTheRobotHasArrived) {
  const std::string program = in_routine(
      "local q = r.joints\n q[1] = q[1] + 0.5\n r:move_joints(q, {duration_s = 2})\n"
      "assert(cell.robots.Robot1.position[1] == q[1])\n r.gripper:close()");
  EXPECT_NEAR(closing_time(program), 2.0, 1e-12);
}

TEST(Program, SignalsArriveInTheSamePeriodInBothDirections) {
  const char* const giving = " r:wait(1) signal('go') r:wait(30) end)\n";
  const char* const taking = " r:wait_signal('go') r.gripper:close() end)\n";
  EXPECT_NEAR(closing_time("routine('Robot2', function(r)" + std::string(giving) +
                           "routine('Robot1', function(r)" + std::string(taking)),
              1.0, 1e-12);
  EXPECT_NEAR(closing_time("routine('Robot1', function(r)" + std::string(giving) +
                               "routine('Robot2', function(r)" + std::string(taking),
                           1),
              1.0, 1e-12);
  // An earlier signal is not missed.
  EXPECT_NEAR(closing_time("signal('go')" + in_routine("r:wait_signal('go') r.gripper:close()")), 0.0, 0.0);
}

TEST(Program, RoutinesReportTheirActionsAndTimes) {
  const ProgramFile file(
      "routine('Robot1', function(r)\n"
      "  r:step('pick')\n"
      "  r:wait(0.5)\n"
      "  r:wait_signal('go')\n"
      "  r:step('place')\n"
      "  r:wait_until(3)\n"
      "end)\n"
      "routine('Robot2', function(r) r:wait(2) signal('go') r:wait(100) end)\n");
  const CellDescription cell = block_cell();
  Controller controller(file.path(), cell);
  const auto run = [&](double until_s) {
    IdealPlant plant(controller, cell);
    plant.run(until_s, [](const Output&) { return false; });
  };
  run(1.0);
  EXPECT_TRUE(controller.steps().steps().empty()) << "they were not requested";
  controller.restart();
  controller.keep_steps();
  run(4.0);
  struct Expected {
    int robot;
    const char* name;
    int line;
    bool named;
    double begin_s, end_s;
  };
  const std::vector<Expected> expected{
      {0, "pick", 2, true, 0.0, 2.0},        {0, "wait", 3, false, 0.0, 0.504},
      {1, "wait", 8, false, 0.0, 2.0},       {0, "wait_signal", 4, false, 0.504, 2.0},
      {1, "wait", 8, false, 2.0, -1.0},      {0, "place", 5, true, 2.0, 3.0},
      {0, "wait_until", 6, false, 2.0, 3.0},
  };
  ASSERT_EQ(controller.steps().steps().size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const ProgramStep& step = controller.steps().steps()[i];
    EXPECT_EQ(step.robot, expected[i].robot) << i;
    EXPECT_EQ(step.name, expected[i].name) << i;
    EXPECT_EQ(step.line, expected[i].line) << i;
    EXPECT_EQ(step.named, expected[i].named) << i;
    EXPECT_NEAR(step.begin_s, expected[i].begin_s, 1e-9) << i;
    EXPECT_NEAR(step.end_s, expected[i].end_s, 1e-9) << i;
  }
  controller.restart();
  EXPECT_TRUE(controller.steps().steps().empty());
}

TEST(Program, TheNewestStepsOfALongProgramAreKept) {
  const ProgramFile file(
      "routine('Robot1', function(r)\n"
      "  r:step('all')\n"
      "  for _ = 1, 20 do r:wait(0.1) end\n"
      "  r:wait(100)\n"
      "end)\n");
  const CellDescription cell = block_cell();
  Controller controller(file.path(), cell);
  controller.keep_steps(3);
  IdealPlant plant(controller, cell);
  plant.run(4.0, [](const Output&) { return false; });
  const StepLog& log = controller.steps();
  EXPECT_EQ(log.first(), 1 + 20 + 1 - 3);
  ASSERT_EQ(log.steps().size(), 3U);
  EXPECT_EQ(log.steps()[1].line, 3);
  EXPECT_NEAR(log.steps()[1].end_s, log.steps()[2].begin_s, 1e-12);
  EXPECT_EQ(log.steps()[2].line, 4);
  EXPECT_LT(log.steps()[2].end_s, 0.0);
  // 22 steps begin, and 20 of them end.
  EXPECT_EQ(log.changes(), 42U);
}

TEST(Program, AProgramReadsTheCell) {
  const ProgramFile file(
      in_routine("r:wait_for(function(cell) return cell.components.P.partner == 'Gripper1' end)\n"
                 "assert(cell.components.O.partner == nil)\n"
                 "local p = cell.components.P.pose\n assert(p.x == 0.25 and p.z == 0.5 and p.yaw == 0)\n"
                 "assert(cell.grippers.Gripper2.width == 0.15 and not cell.grippers.Gripper2.closed)\n"
                 "local g = cell.grippers.Gripper2\n"
                 "assert(g.part == nil and g.in_position and not g.moving and g.force == 0)\n"
                 "g = cell.grippers.Gripper1\n"
                 "assert(g.part == 'P' and g.moving and not g.in_position and g.force == 12.5)\n"
                 "assert(cell.time == 0.016)\n r.gripper:close(20)"));
  const CellDescription cell = block_cell();
  Controller controller(file.path(), cell);
  IdealPlant plant(controller, cell);
  plant.state().components[7].position = {0.25, 0.0, 0.5};
  plant.state().grippers[1].in_position = true;
  plant.state().grippers[0].moving = true;
  plant.state().grippers[0].part = 7;
  plant.state().grippers[0].force = 12.5;
  EXPECT_FALSE(plant.update().finished);
  plant.state().components[7].partner = 3;
  EXPECT_FALSE(plant.update().finished);
  plant.state().components[7].partner = 2;
  const Output& output = plant.update();
  EXPECT_TRUE(output.finished);
  EXPECT_EQ(output.grippers.at(0).verb, GripperAction::close);
  EXPECT_EQ(output.grippers.at(0).max_force_N, 20.0);
}

TEST(Program, EveryFieldOfTheMessagesIsReadableByItsName) {
  CellDescription cell = block_cell();
  cell.devices = {{"Oven", {{"door", "", true, 0.0, 1.0}, {"temperature", "degC", false, 0.0, 0.0}}}};
  cell.components[7].mass = 0.25;
  cell.step_size = 0.002;
  CellState state = initial_state(cell);
  state.step = 12;
  state.state_hash = 0xDEADBEEFDEADBEEF;
  state.components[7].state = PartState::assembled;
  state.components[7].linear_velocity = {1.0, 2.0, 3.0};
  state.robots[1].effort = {1.0, 2.0, 3.0, 4.0, 5.0, 6.0};
  state.devices[0].signals = {1.0, 80.0};
  state.applied = {{"Robot1", 7, {2, 5}}};
  const ProgramFile file(R"(
    assert(cell.description.step_size == 0.002 and #cell.description.components == 8)
    local mass = cell.description.components.P.mass
    routine('Robot1', function(r)
      assert(mass == 0.25 and cell.description.components[8].name == 'P')
      assert(cell.description.grippers.Gripper1.tool_center_point.position.z == 0.2)
      assert(cell.description.robots.Robot1.base.pose.x == -0.75)
      assert(cell.description.robots.Robot1.joints.elbow_joint.type == 'revolute')
      assert(cell.description.grippers.Gripper2.robot == 'Robot2')
      assert(cell.step == 12 and cell.state_hash == '0xdeadbeefdeadbeef')
      local P = cell.components.P
      assert(P.state == 'assembled' and P.linear_velocity.y == 2)
      local effort = cell.robots.Robot2.effort
      assert(#effort == 6 and effort[3] == 3 and effort.elbow_joint == 3 and effort[7] == nil)
      assert(cell.devices.Oven.signals.temperature == 80 and cell.devices[1].signals[1] == 1)
      assert(cell.devices[2] == nil)
      assert(cell.applied.Robot1.count == 7 and cell.applied[1].newest_stamp.sec == 2)
      assert(tostring(P) == 'part of the cell')
      local before = P.position
      r:wait(0.008)
      assert(before.x == 0 and P.position.x == 0.5, 'a vector stays, a component does not')
    end))");
  Controller controller(file.path(), cell);
  EXPECT_FALSE(controller.update(state).finished);
  state.time = 0.008;
  state.components[7].position.x = 0.5;
  EXPECT_TRUE(controller.update(state).finished);
}

TEST(Program, AProgramBeginsWithTheHoldOfAGripper) {
  const ProgramFile file(in_routine("r:wait(1)"));
  const CellDescription cell = block_cell();
  for (const bool closed : {true, false}) {
    Controller controller(file.path(), cell);
    IdealPlant plant(controller, cell);
    plant.state().grippers[0].part = 7;
    plant.state().grippers[0].width = 0.03;
    plant.state().grippers[0].closed = closed;  // not closed: jaws that stand against a Part without a hold
    const GripperSetPoint command = controller.update(plant.state()).grippers.at(0);
    EXPECT_EQ(command.verb, closed ? GripperAction::close : GripperAction::width);
    EXPECT_EQ(command.width_m, 0.03);
    EXPECT_EQ(command.max_force_N, cell.grippers[0].max_force);
  }
}

TEST(Program, StandingCommandsAreSentEveryPeriod) {
  const ProgramFile file(in_routine("r:wait(1) r.gripper:width(0.06) r:wait(1) r.gripper:open() r:wait(1)"));
  const CellDescription cell = block_cell();
  Controller controller(file.path(), cell);
  EXPECT_EQ(controller.driven_robots(), std::vector<int>{0});
  EXPECT_EQ(controller.driven_grippers(), std::vector<int>{0});
  EXPECT_EQ(controller.period_s(), 0.008);
  IdealPlant plant(controller, cell);
  plant.state().grippers[0].width = 0.1;
  int widths = 0, opens = 0;
  plant.run(3.5, [&](const Output& output) {
    EXPECT_EQ(output.joints.size(), 1U);
    EXPECT_EQ(output.joints[0].position, kHome1);
    EXPECT_EQ(output.joints[0].velocity, JointArray{});
    EXPECT_EQ(output.grippers.size(), 1U);
    EXPECT_EQ(output.finished, plant.time_s() > 2.9999);
    const GripperSetPoint& command = output.grippers[0];
    if (command.verb == GripperAction::open) ++opens;
    if (command.verb == GripperAction::width) {
      ++widths;
      EXPECT_EQ(command.width_m, plant.time_s() < 0.9999 ? 0.1 : 0.06);
    }
    return false;
  });
  EXPECT_EQ(widths, 250);
  EXPECT_EQ(opens, 188);
}

TEST(Program, PosesMultiplyAndTransform) {
  EXPECT_EQ(error_of(in_routine(R"(
    local a = pose{x = 1, y = 2, z = 3, yaw = math.pi / 2}
    local b = a * pose{x = 1}
    assert(math.abs(b.x - 1) < 1e-15 and math.abs(b.y - 3) < 1e-15 and b.z == 3)
    local c = a:inverse() * b
    assert(math.abs(c.x - 1) < 1e-15 and math.abs(c.y) < 1e-15 and math.abs(c.yaw) < 1e-15)
    local d = a:offset(0, 0, -1)
    assert(d.x == 1 and d.z == 2 and a.z == 3 and math.abs(d.yaw - math.pi / 2) < 1e-15)
    assert(tostring(pose{x = 1}) == 'pose{x=1, y=0, z=0, roll=0, pitch=0, yaw=0}')
    local t = r.tcp
    r:move_line(t:offset(0, 0, -0.1), {duration_s = 2})
    assert(math.abs(r.tcp.z - t.z + 0.1) < 1e-11 and math.abs(cell.robots.Robot1.tcp.z - t.z + 0.1) < 1e-11)
  )")),
            "no error");
}

TEST(Program, ErrorsNameFileLineRobotAndTime) {
  const std::string error =
      error_of(in_routine("r:wait(1)\nlocal function far()\n"
                          "  r:move_to(pose{x = 5, z = 1})\n  r:wait(1) end\nfar()\nr:wait(1)"));
  EXPECT_THAT(error,
              AllOf(HasSubstr(".lua:4: "), HasSubstr("{x=5, y=0, z=1,"), HasSubstr("cannot be reached"),
                    HasSubstr("short by"), HasSubstr("called from line 6"), HasSubstr("routine of Robot1"),
                    HasSubstr("at 1.000 s")));
  EXPECT_THAT(error_of("routine('Robot1', function(r)"), HasSubstr(".lua:1: "));
  EXPECT_THAT(error_of("\n\nlocal x = undefined_thing"),
              AllOf(HasSubstr(".lua:3: "), HasSubstr("undefined name 'undefined_thing'")));
  EXPECT_THAT(error_of(in_routine("\nerror('no part')")), HasSubstr(".lua:3: no part"));
  EXPECT_THAT(error_of(in_routine("r:wait_for(function() return nothing.x end)")), HasSubstr(".lua:2: "));
}

TEST(Program, UnknownNamesAreRefused) {
  EXPECT_THAT(error_of("routine('Robot3', function(r) end)"),
              HasSubstr("the cell has no robot 'Robot3'; it has Robot1, Robot2"));
  EXPECT_THAT(error_of(in_routine("return cell.components.X.pose")),
              HasSubstr("the list of components has no 'X'; it has Table1"));
  EXPECT_THAT(error_of(in_routine("return cell.grippers.X")), HasSubstr("it has Gripper1, Gripper2"));
  EXPECT_THAT(error_of(in_routine("return cell.time_s")),
              HasSubstr("CellState has no 'time_s'; it has stamp, time"));
  EXPECT_THAT(error_of(in_routine("return cell.grippers.Gripper1.width_m")),
              HasSubstr("GripperState has no 'width_m'; it has width, force, "));
  EXPECT_THAT(error_of(in_routine("return cell.components.P.position.roll")),
              HasSubstr("Vector3 has no 'roll'; it has x, y, z"));
  EXPECT_THAT(error_of(in_routine("return cell.robots.Robot1.position.elbow")),
              HasSubstr("has no 'elbow'; it has shoulder_pan_joint"));
  EXPECT_THAT(error_of(in_routine("return #cell.components.P")), HasSubstr("ComponentState is no list"));
  EXPECT_THAT(error_of("local t = cell.time " + in_routine("")), HasSubstr("only while routines run"));
  EXPECT_THAT(error_of(in_routine("r:fly()")), HasSubstr("a robot has no 'fly'"));
  EXPECT_THAT(error_of("local x = 1"), HasSubstr("has no routine"));
  EXPECT_THAT(error_of(in_routine("") + in_routine("")),
              HasSubstr(".lua:4: robot Robot1 has a routine already"));
}

TEST(Program, InvalidArgumentsAreRefused) {
  const auto error = [](const std::string& body) { return error_of(in_routine(body)); };
  EXPECT_THAT(error("r:move_joints({1, 2, 3})"),
              HasSubstr("a table of 6 joint positions is needed, not 3 values"));
  EXPECT_THAT(error("r:move_joints({1, 2, 3, 0, 0, 'x'})"), HasSubstr("wrist_3_joint: a number is needed"));
  EXPECT_THAT(error("r:move_joints({1, 2, 3, 0, 0, 0/0})"), HasSubstr("not finite"));
  EXPECT_THAT(error("r:move_joints({0, 0, 4, 0, 0, 0})"),
              HasSubstr("joint elbow_joint: position 4 rad is outside [-3.14159, 3.14159] rad"));
  EXPECT_THAT(error("r:move_joints(r.joints, {sped = 1})"),
              HasSubstr("'sped' is not known here; known are speed, acceleration_rad_per_s2, duration_s"));
  EXPECT_THAT(error("r:move_joints(r.joints, {speed = 1.5})"), HasSubstr("speed = 1.5 is not allowed"));
  EXPECT_THAT(error("r:move_to({x = 1})"), HasSubstr("a pose is needed"));
  EXPECT_THAT(error("r:move_line(r.tcp:offset(0, 0, -3))"), HasSubstr("cannot be followed"));
  EXPECT_THAT(error("r.move_line(r.tcp)"), HasSubstr("r:move_to(...)"));
  EXPECT_THAT(error("r.gripper:width(0.2)"), HasSubstr("width = 0.2 m is outside [0, 0.15] m"));
  EXPECT_THAT(error("r.gripper:close(-1)"), HasSubstr("force = -1 N is outside [0, 150] N"));
  EXPECT_THAT(error("pose{x = 1, w = 2}"), HasSubstr("'w' is not known here"));
  EXPECT_THAT(error("r:wait(-1)"), HasSubstr("negative"));
  EXPECT_THAT(error("r:wait_for(function() return false end, 2)"),
              AllOf(HasSubstr(".lua:2: the condition waited for has not come true in time"),
                    HasSubstr("at 2.000 s")));
  EXPECT_THAT(error_of("other = nil\n routine('Robot1', function(r) other = r r:wait(9) end)\n"
                       "routine('Robot2', function(r) other:move_joints(other.joints) end)"),
              HasSubstr("Robot1 cannot be driven from the routine of Robot2"));
  EXPECT_THAT(error_of("period_s = 0\n" + in_routine("")), HasSubstr("period_s = 0 is not allowed"));
}

TEST(Program, EndlessLoopsAreErrors) {
  EXPECT_THAT(error_of("while true do end"), AllOf(HasSubstr(".lua:1: "), HasSubstr("endless loop")));
  EXPECT_THAT(error_of(in_routine("while true do end")), HasSubstr("endless loop"));
  EXPECT_THAT(error_of(in_routine("while true do r:wait(0) end")), HasSubstr("endless loop"));
  EXPECT_THAT(error_of(in_routine("while true do pcall(function() while true do end end) end")),
              HasSubstr("endless loop"));
  EXPECT_THAT(error_of(in_routine("r:wait_for(function() while true do end end)")),
              HasSubstr("endless loop"));
  EXPECT_THAT(error_of(in_routine("local s = 'x' while true do s = s .. s end")),
              HasSubstr("not enough memory"));
}

TEST(Program, AProgramReachesNothingOutside) {
  for (const char* name : {"io", "os", "require", "package", "debug", "dofile", "load", "loadfile",
                           "collectgarbage", "coroutine", "getmetatable", "next"}) {
    EXPECT_THAT(error_of("return " + std::string(name)),
                HasSubstr("undefined name '" + std::string(name) + "'"));
  }
  EXPECT_EQ(error_of(in_routine("assert(math.random == nil and string.dump == nil)")), "no error");
  EXPECT_THAT(error_of("\27Lua"), Not(HasSubstr("no error")));
}

TEST(Program, TablesHaveAFixedOrder) {
  EXPECT_EQ(error_of(in_routine(R"(
    local text = ''
    for key, value in pairs({z = 1, a = 2, [3] = 3, [1.5] = 4, [true] = 5, m = 6, [false] = 7}) do
      text = text .. tostring(key) .. value .. ' '
    end
    assert(text == '1.54 33 a2 m6 z1 false7 true5 ', text)
    assert(tostring({}) == 'table' and string.format('%s', {}) == 'table')
  )")),
            "no error");
}

TEST(Controller, AFailedProgramStaysFailedUntilRestarted) {
  const ProgramFile file(in_routine("r:wait(0.1)\nerror('here')"));
  const CellDescription cell = block_cell();
  Controller controller(file.path(), cell);
  CellState state = initial_state(cell);
  controller.update(state);
  state.time = 0.2;
  EXPECT_THROW(controller.update(state), std::runtime_error);
  EXPECT_THROW(controller.update(state), std::runtime_error);
  controller.restart();
  state.time = 0.0;
  EXPECT_FALSE(controller.update(state).finished);
}

TEST(Controller, MismatchedInputIsRefused) {
  const ProgramFile file(in_routine("r:wait(10)"));
  const CellDescription cell = block_cell();
  CellState state = initial_state(cell);
  {
    Controller controller(file.path(), cell);
    state.time = 1.0;
    controller.update(state);
    state.time = 0.5;
    EXPECT_THROW(controller.update(state), std::runtime_error);
  }
  Controller controller(file.path(), cell);
  state.robots.pop_back();
  EXPECT_THROW(controller.update(state), std::runtime_error);
  EXPECT_THROW(Controller("no/such/program.lua", cell), std::runtime_error);
}

TEST(Controller, TheControllerCatchesUpWithAMissedPeriod) {
  const ProgramFile file(
      in_routine("local q = r.joints q[1] = q[1] + 0.4 r:move_joints(q, {duration_s = 0.8, "
                 "acceleration_rad_per_s2 = 9})"));
  const CellDescription cell = block_cell();
  Controller all(file.path(), cell), some(file.path(), cell);
  CellState state = initial_state(cell);
  for (int k = 0; k <= 110; ++k) {
    state.time = 0.008 * k;
    const JointSetPoint expected = all.update(state).joints.at(0);
    if (k == 40 || k == 98 || k == 99) continue;
    const JointSetPoint found = some.update(state).joints.at(0);
    EXPECT_EQ(found.position, expected.position) << k;
    EXPECT_EQ(found.velocity, expected.velocity) << k;
  }
}

}  // namespace
}  // namespace takt::controller
