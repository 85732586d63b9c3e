// Mistakes in every section of a scenario file: each error has the file, the line, the key, the value found
// and the values allowed. And rarely used options reach the scenario.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "server/devices/screw_joints.h"
#include "server/scenario/scenario_reader.h"
#include "tests/support/kept_scenarios.h"
#include "tests/support/temporary_directory.h"

namespace takt {
namespace {

using ::testing::HasSubstr;

const std::string kFirstLines = "takt_scenario: 1\nname: cell\n";

/// The text after the first two lines of every scenario: it begins in line 3.
Scenario read_text(const std::string& text, const std::vector<std::string>& overrides = {}) {
  const test::TemporaryDirectory directory;
  directory.write("cell.yaml", kFirstLines + text);
  directory.write("a.obj", "");  // only its existence matters to the reader
  directory.write("r.urdf", "");
  ScenarioOptions options;
  options.overrides = overrides;
  return read_scenario(directory.path() / "cell.yaml", options);
}

/// The same, kept for the test of the schema.
Scenario scenario_of(const std::string& text, const std::vector<std::string>& overrides = {}) {
  const std::string whole = kFirstLines + text;
  try {
    Scenario scenario = read_text(text, overrides);
    test::keep_scenario(whole, overrides, "");
    return scenario;
  } catch (const ScenarioError& error) {
    test::keep_scenario(whole, overrides, error.what());
    throw;
  }
}

std::string mistake_in(const std::string& text, const std::vector<std::string>& overrides = {}) {
  try {
    scenario_of(text, overrides);
  } catch (const ScenarioError& error) {
    return error.what();
  }
  return "no error";
}

struct Mistake {
  std::string text;
  std::vector<std::string> words;
};

void expect_named(const std::vector<Mistake>& mistakes) {
  for (const Mistake& mistake : mistakes) {
    const std::string answer = mistake_in(mistake.text);
    for (const std::string& word : mistake.words) EXPECT_THAT(answer, HasSubstr(word)) << mistake.text;
  }
}

std::string part_with(const std::string& fields, const std::string& name = "A") {
  return "  " + name + ": {mesh: a.obj, mass_kg: 1, hierarchy: 2" + (fields.empty() ? "" : ", ") + fields +
         "}\n";
}
std::string one_part(const std::string& fields) {
  return "parts:\n" + part_with(fields);
}
std::string one_robot(const std::string& fields) {
  return "robots:\n  R: {urdf: r.urdf, initial_joints_rad: [0, 0]" + std::string(fields.empty() ? "" : ", ") +
         fields + "}\n";
}
std::string drives(const std::string& fields) {
  return one_robot("drives: {" + fields + "}");
}
const std::string kDetailed =
    "model: detailed, gear_ratio: 100, motor_inertia_kg_m2: 1e-4, torque_constant_N_m_per_A: 0.1, "
    "current_loop_rad_per_s: 1000, current_loop_damping: 0.7";

TEST(ScenarioMistakes, MistakesInPartsAreNamed) {
  expect_named({
      {one_part("color: red"), {"cell.yaml:4:", "parts.A.color", "'red'", "three or four numbers in [0, 1]"}},
      {one_part("color: [1, 0]"), {"parts.A.color", "a list of 2 values", "three or four"}},
      {one_part("color: [1, 0, 2]"), {"parts.A.color", "found 2", "[0, 1]"}},
      {one_part("center_of_mass_m: [0, 0, 0]"),
       {"cell.yaml:4:", "parts.A.center_of_mass_m", "one of the two", "together, or neither"}},
      {one_part("inertia_kg_m2: [1, 1, 1, 0, 0, 0]"), {"parts.A.inertia_kg_m2", "together, or neither"}},
      {one_part("center_of_mass_m: [0, 0, 0], inertia_kg_m2: [1, 1, 0, 0, 0, 0]"),
       {"parts.A.inertia_kg_m2", "a list of 6 values", "positive definite"}},
      {one_part("center_of_mass_m: [0, 0, 0], inertia_kg_m2: [1, 1, 1, 2, 0, 0]"),
       {"parts.A.inertia_kg_m2", "positive definite"}},
      {one_part("convex: [hull]"), {"parts.A.convex", "a list of 1 values", "vhacd"}},
      {one_part("convex: {method: magic}"), {"parts.A.convex.method", "'magic'", "hull, objects, file"}},
      {one_part("convex: {method: file, file: b.obj}"), {"parts.A.convex.file", "b.obj", "existing file"}},
      {one_part("pose: {rpy_rad: [0, 0, 0], rpy_deg: [0, 0, 0]}"),
       {"cell.yaml:4:", "parts.A.pose", "several orientations", "quaternion_xyzw"}},
      {one_part("pose: {quaternion_xyzw: [0, 0, 0, 2]}"),
       {"parts.A.pose.quaternion_xyzw", "length 2", "a unit quaternion"}},
      {one_part("pose: level"), {"parts.A.pose", "'level'", "a mapping of keys to values"}},
      {"parts: [A, B]\n", {"cell.yaml:3:", "parts", "a list of 2 values", "a mapping of names"}},
      {"parts:\n  A: heavy\n", {"cell.yaml:4:", "parts.A", "'heavy'", "a mapping of keys to values"}},
      {"parts:\n  A: {mesh: [a.obj], mass_kg: 1, hierarchy: 2}\n",
       {"parts.A.mesh", "a list of 1 values", "a path relative to the scenario file"}},
      {"parts:\n  A: {mesh: \"\", mass_kg: 1, hierarchy: 2}\n", {"parts.A.mesh", "''", "a path relative"}},
      {"parts:\n  9A: {mesh: a.obj, mass_kg: 1, hierarchy: 2}\n", {"the name '9A'"}},
      {one_part("twist: {velocity_m_per_s: [0, 0, 0], velocity_m_per_s: [1, 0, 0]}"),
       {"parts.A.twist.velocity_m_per_s", "the key twice", "each key once"}},
      {one_part("") + "name: again\n", {"cell.yaml:5:", "name", "the key twice"}},
      {"description: \"\"\n", {"cell.yaml:3:", "description", "''", "a text"}},
      {"csv_period_s: [1]\n", {"cell.yaml:3:", "csv_period_s", "a list of 1 values", "> 0 s"}},
      {"interaction: {weight_feed_forward: [true]}\n",
       {"interaction.weight_feed_forward", "a list of 1 values", "true or false"}},
      {"report_at: soon\n", {"cell.yaml:3:", "report_at", "'soon'", "a list of {name, time_s}"}},
      {"report_at:\n  - {name: M, time_s: -1}\n", {"cell.yaml:4:", "report_at.time_s", "-1", ">= 0 s"}},
      {"controller: {parameters: {[1]: 2}}\n", {"controller.parameters", "a list of 1 values", "a name"}},
      {"solver: {matrix: magic}\n", {"solver.matrix", "'magic'", "automatic, separate, coupled"}},
  });
}

TEST(ScenarioMistakes, MistakesInRobotsAndTheirDrivesAreNamed) {
  const auto detailed_without = [](const std::string& key) {
    std::string text = kDetailed;
    const auto begin = text.find(", " + key);
    text.erase(begin, text.find(',', begin + 1) - begin);
    return drives(text);
  };
  expect_named({
      {"robots:\n  R: {urdf: r.urdf, initial_joints_rad: [0], initial_joints_deg: [0]}\n",
       {"cell.yaml:4:", "robots.R.initial_joints_rad", "initial_joints_deg as well", "one of"}},
      {drives("model: magic"), {"cell.yaml:4:", "robots.R.drives.model", "'magic'", "ideal, simplified"}},
      {drives("model: ideal, gear_ratio: 100"),
       {"robots.R.drives.gear_ratio", "an unknown key", "bandwidth"}},
      {drives("bandwidth_rad_per_s: [20, -1]"), {"robots.R.drives.bandwidth_rad_per_s", "-1", "> 0 rad/s"}},
      {drives("gear_ratio: [100, 0]"), {"robots.R.drives.gear_ratio", "found 0", "other than 0"}},
      {drives(kDetailed + ", bandwidth_rad_per_s: 20"), {"bandwidth_rad_per_s", "an unknown key"}},
      {drives(kDetailed + ", friction: glue"), {"drives.friction", "'glue'", "stiction, regularised, none"}},
      {drives(kDetailed + ", position_encoder: belt"), {"position_encoder", "'belt'", "motor, joint"}},
      {drives(kDetailed + ", breakaway_factor: 0.5"), {"drives.breakaway_factor", "0.5", ">= 1"}},
      {detailed_without("gear_ratio"),
       {"cell.yaml:4:", "drives.gear_ratio", "missing", "one for each joint"}},
      {detailed_without("motor_inertia_kg_m2"), {"drives.motor_inertia_kg_m2", "missing"}},
      {detailed_without("torque_constant_N_m_per_A"), {"drives.torque_constant_N_m_per_A", "missing"}},
      {detailed_without("current_loop_rad_per_s"), {"drives.current_loop_rad_per_s", "missing"}},
      {one_robot("max_acceleration_rad_per_s2: [1, 1, 1]"),
       {"robots.R.max_acceleration_rad_per_s2", "3 values", "one, or 2, one for each joint"}},
      {one_robot("safe_action: stop, command_deadline_s: 0.1"),
       {"robots.R.max_acceleration_rad_per_s2", "missing", "needed for safe_action: stop"}},
      {one_robot("safe_action: jump"), {"robots.R.safe_action", "'jump'", "hold, stop"}},
      {one_robot("command_period_s: 0.01, command_deadline_s: 0.005"),
       {"robots.R.command_deadline_s", "0.005", "at least command_period_s, 0.01"}},
      {one_robot("power: {loss_factor: 0.9}"), {"robots.R.power.loss_factor", "0.9", ">= 1"}},
      {one_robot("trajectory: {profile: spline}"), {"robots.R.trajectory.profile", "'spline'", "trapezoid"}},
      {one_robot("trajectory: {end_rad: [1]}"), {"robots.R.trajectory.end_rad", "a list of 2 numbers"}},
      {one_robot("") + "grippers:\n  G: {robot: S}\n",
       {"cell.yaml:6:", "grippers.G.robot", "'S'", "a robot of this scenario: R"}},
      {"robots:\n  R: {urdf: r.urdf, initial_joints_rad: []}\n  S: {urdf: r.urdf, initial_joints_rad: []}\n"
       "grippers:\n  G: {robot: T}\n",
       {"grippers.G.robot", "'T'", "a robot of this scenario: R, S"}},
      {"robots:\n  R/1: {urdf: r.urdf, initial_joints_rad: []}\n", {"robots", "the name 'R/1'"}},
      {"robots:\n  R: {urdf: r.urdf, initial_joints_rad: []}\ngrounds:\n  R: {mesh: a.obj}\n",
       {"robots", "the name 'R' again", "unique"}},
      {"grounds:\n  G/1: {mesh: a.obj}\n", {"grounds", "the name 'G/1'"}},
      {one_part("") + "processes:\n  P: {level_of_detail: 1, members: A}\n",
       {"cell.yaml:6:", "processes.P.members", "'A'", "all, or a list of names"}},
      {one_part("") + "processes:\n  P: {level_of_detail: 1, members: [[A]]}\n",
       {"processes.P.members", "a list of 1 values", "a name"}},
      {one_part("") + "processes:\n  P: {level_of_detail: 4, members: all}\n",
       {"processes.P.level_of_detail", "'4'", "a whole number in ["}},
  });
}

TEST(ScenarioMistakes, MistakesInContactPairsAreNamed) {
  const auto pair = [](const std::string& fields) { return "contact:\n  pairs:\n    - {" + fields + "}\n"; };
  expect_named({
      {pair("pair: A"), {"cell.yaml:5:", "contact.pairs.pair", "'A'", "two names"}},
      {pair("pair: [A, [B]]"), {"contact.pairs.pair", "a list of 1 values", "two names"}},
      {pair("pair: [A, \"\"]"), {"contact.pairs.pair", "''", "two names"}},
      {pair("friction: 1"), {"contact.pairs.pair", "missing", "two names"}},
      {pair("pair: [A, B], friction_at_degC: [[20, [1]]]"), {"rising temperatures"}},
      {pair("pair: [A, B], friction_at_degC: [[20, .inf]]"), {"rising temperatures"}},
      {pair("pair: [A, B], friction_at_degC: [20, 30]"), {"found '20'", "rising temperatures"}},
      {"contact: {components: {A: {role: top}}}\n",
       {"cell.yaml:3:", "contact.components.A.role", "'top'", "by_rule, base, target"}},
      {"contact: {components: {A: 3}}\n", {"contact.components.A", "'3'", "a mapping of keys"}},
  });
  const Scenario scenario = scenario_of(
      "contact:\n  components: {A: {role: base}, B: {role: target}, C: {friction: 1}}\n"
      "  pairs:\n    - {pair: [A, B], force: contact, base: B, friction_law: regularised}\n"
      "    - {pair: [A, C], base: A}\n");
  ASSERT_EQ(scenario.contact.components.size(), 3U);
  EXPECT_EQ(scenario.contact.components[0].role, ContactRole::base);
  EXPECT_EQ(scenario.contact.components[1].role, ContactRole::target);
  EXPECT_EQ(scenario.contact.components[2].role, ContactRole::by_rule);
  ASSERT_EQ(scenario.contact.pairs.size(), 2U);
  EXPECT_EQ(scenario.contact.pairs[0].force, PairForce::contact);
  EXPECT_EQ(scenario.contact.pairs[0].base, "B");
  EXPECT_EQ(scenario.contact.pairs[0].stated.value(&ContactParameters::friction_law),
            FrictionLaw::regularised);
  EXPECT_EQ(scenario.contact.pairs[1].base, "A");
  EXPECT_TRUE(scenario_of("contact: {pairs: }\n").contact.pairs.empty());
}

TEST(ScenarioMistakes, MistakesInDevicesAreNamed) {
  const std::string furnace = "furnaces:\n  Oven: {ground: Floor}\n";
  const std::string ground = "grounds:\n  Base: {mesh: a.obj}\n  Wall: {mesh: a.obj}\n";
  const std::string thread = "pitch_m: 1e-3, length_m: 0.01, driving_torque_N_m: 1";
  const auto screw = [&thread](const std::string& in, const std::string& more = "") {
    return part_with("thread: {in: " + in + ", " + thread + more + "}");
  };
  expect_named({
      {ground + furnace,
       {"cell.yaml:7:", "furnaces.Oven.ground", "'Floor'", "a ground of this scenario: Base, Wall"}},
      {"parts:\n" + screw("B"),
       {"cell.yaml:4:", "parts.A.thread.in", "found 'B'", "another part, or a ground"}},
      {"parts:\n" + screw("A"), {"parts.A.thread.in", "found 'A'", "another part, or a ground"}},
      {"parts:\n" + screw("B") + part_with("thread: {in: C, " + thread + "}", "B") + part_with("", "C"),
       {"cell.yaml:4:", "parts.A.thread.in", "found 'B', which has a thread itself"}},
      {"parts:\n" + screw("B", ", axis: [0, 0, 0]"),
       {"parts.A.thread.axis", "a vector without direction", "[0, 0, 1]"}},
      {one_part("heat: {specific_heat_J_per_kg_K: 900, emissivity: 1.5}"),
       {"parts.A.heat.emissivity", "1.5", "[0, 1]"}},
      {one_robot("") + "grippers:\n  G: {robot: R, body_mesh: a.obj, jaw_mesh: a.obj, max_width_m: 0.1, "
                       "jaw_speed_m_per_s: 0.1, max_force_N: 10}\n"
                       "screwdrivers:\n  D: {gripper: H}\n",
       {"screwdrivers.D.gripper", "found 'H'", "a gripper of this scenario: G"}},
  });
  // A thread in a ground, and one in a part without one, are read.
  const Scenario scenario =
      scenario_of("parts:\n" + screw("Base", ", axis: [0, 0, 2]") +
                  part_with("thread: {in: C, " + thread + "}", "B") + part_with("", "C") + ground);
  const auto joint = [&scenario](std::size_t part) {
    const StatedDevice* device = scenario.parts[part].device("thread");
    EXPECT_NE(device, nullptr);
    return device != nullptr ? std::any_cast<ScenarioScrewJoint>(device->section) : ScenarioScrewJoint{};
  };
  EXPECT_EQ(joint(0).held_by.component, "Base");
  EXPECT_EQ(joint(0).axis_B.normalized(), Vec3::UnitZ());
  EXPECT_EQ(joint(1).held_by.component, "C");
}

TEST(ScenarioMistakes, MistakesInAssertionsAreNamed) {
  const auto demand = [](const std::string& fields) {
    return "parts:\n" + part_with("") + part_with("", "B") + "assertions:\n  a: {" + fields + "}\n";
  };
  expect_named({
      {demand("check: pose, part: C, tolerance_m: 1"),
       {"cell.yaml:7:", "assertions.a.part", "'C'", "a part of this scenario: A, B"}},
      {demand("check: contact_force, pair: [A, B], above: 2, below: 1"),
       {"assertions.a.above", "more than 'below'", "an interval that is not empty"}},
      {demand("check: contact_force, pair: A, below: 1"), {"assertions.a.pair", "'A'", "two names"}},
      {demand("check: contact_force, pair: [[A], B], below: 1"), {"assertions.a.pair", "two names"}},
      {demand("check: contact_force, pair: [A, [B]], below: 1"), {"assertions.a.pair", "two names"}},
      {demand("check: held_by, part: A, by: Hand"),
       {"assertions.a.by", "'Hand'", "a component of this scenario: A, B"}},
      {demand("check: held_by, part: A"), {"assertions.a.by", "missing"}},
      {demand("check: pose, part: A, tolerance_m: 0"), {"assertions.a.tolerance_m", "0", "> 0 m"}},
      {demand("check: pose, part: A, tolerance_m: 1, tolerance_deg: -1"), {"tolerance_deg", "-1", "> 0 deg"}},
  });
  const Scenario held = scenario_of(demand("check: held_by, part: A, by: B"));
  EXPECT_EQ(held.assertions.at(0).subject, "A");
  EXPECT_EQ(held.assertions.at(0).holder, "B");
  EXPECT_EQ(scenario_of(demand("check: held_by, part: A, by: nothing")).assertions.at(0).holder, "");
  const Scenario posed = scenario_of(demand("check: pose, part: A, tolerance_m: 1, tolerance_deg: 180"));
  EXPECT_DOUBLE_EQ(posed.assertions.at(0).tolerance_rad, std::numbers::pi);
}

TEST(ScenarioMistakes, MistakesOnTheCommandLineAreNamed) {
  const std::string text = one_part("");
  EXPECT_THAT(mistake_in(text, {"=1"}), HasSubstr("--set =1: found no '='"));
  EXPECT_THAT(mistake_in(text, {"parts=[1"}), HasSubstr("--set parts=[1: the value is not valid YAML"));
  EXPECT_THAT(
      mistake_in(text, {"name.first=x"}),
      HasSubstr("--set name.first=x: 'name' is not a mapping; allowed: the keys of the scenario file"));
  EXPECT_THAT(mistake_in(one_part("pose: {position_m: [0, 0, 0]}"), {"parts.A.pose.position_m.3=1"}),
              HasSubstr("found '3'; allowed: an element of the list, 0 to 2"));
  const std::string posed = one_part("pose: {position_m: [0, 0, 0]}");
  EXPECT_THAT(mistake_in(posed, {"parts.A.pose.position_m[3]=1"}),
              HasSubstr("found '3'; allowed: an element of the list, 0 to 2"));
  EXPECT_THAT(mistake_in(posed, {"parts.A.pose.position_m[z]=1"}),
              HasSubstr("found '[z]'; allowed: the number of an element in brackets, e.g. position_m[2]"));
  EXPECT_THAT(mistake_in(posed, {"parts.A.pose.position_m[2]=up"}),
              HasSubstr("--set: parts.A.pose.position_m"));
  EXPECT_THAT(
      mistake_in(text, {"parts.A.pose.position_m[2]=1"}),
      HasSubstr("found no list 'position_m' in the scenario; allowed: an element of a list that it has, "
                "or the whole list, --set 'parts.A.pose.position_m=[...]'"));
  // A section replaced as a whole is the command line's, with all its keys; other sections are not.
  EXPECT_THAT(mistake_in(text, {"parts.A={mesh: a.obj, mass_kg: -1, hierarchy: 2}"}),
              HasSubstr("--set: parts.A.mass_kg: found -1"));
  EXPECT_THAT(mistake_in(one_part("mesh_scale: 0"), {"parts.A.mass_kg=2"}), HasSubstr("cell.yaml:4:"));
  const Scenario moved =
      scenario_of(posed, {"parts.A.pose.position_m[2]=0.5", "parts.A.pose.position_m.0=2"});
  EXPECT_EQ(moved.parts.at(0).X_WB.p, Vec3(2.0, 0.0, 0.5));
  // Null has no keys yet: they are created.
  EXPECT_EQ(scenario_of("world:\n", {"world.temperature_degC=30"}).temperature_degC, 30.0);
}

TEST(ScenarioChoices, ChoicesOfDrivesAreRead) {
  using Drives = ScenarioDrives;
  const auto drives_of = [](const std::string& fields) {
    return scenario_of(drives(fields)).robots.at(0).drives;
  };
  EXPECT_EQ(drives_of("model: ideal, bandwidth_rad_per_s: [20, 30]").model, Drives::Model::ideal);
  EXPECT_EQ(drives_of("").model, Drives::Model::simplified);
  const Drives detailed = drives_of(kDetailed + ", friction: none, position_encoder: joint");
  EXPECT_EQ(detailed.model, Drives::Model::detailed);
  EXPECT_EQ(detailed.friction, Drives::Friction::none);
  EXPECT_EQ(detailed.position_encoder, Drives::PositionEncoder::joint);
  EXPECT_EQ(drives_of(kDetailed + ", friction: regularised").friction, Drives::Friction::regularised);
  EXPECT_EQ(drives_of(kDetailed).friction, Drives::Friction::stiction);
  const ScenarioRobot stops =
      scenario_of(
          one_robot("safe_action: stop, command_deadline_s: 0.1, max_acceleration_rad_per_s2: [1, 2]"))
          .robots.at(0);
  EXPECT_EQ(stops.deadline.safe_action, SafeAction::stop);
  EXPECT_EQ(stops.deadline.max_acceleration_rad_per_s2.values, (std::vector<double>{1, 2}));
}

TEST(ScenarioChoices, ChoicesOfConvexPiecesSolversAndMembersAreRead) {
  EXPECT_EQ(scenario_of(one_part("convex: {method: objects}")).parts[0].convex.kind,
            ConvexSource::Kind::objects);
  const ConvexSource of_file = scenario_of(one_part("convex: {method: file, file: a.obj}")).parts[0].convex;
  EXPECT_EQ(of_file.kind, ConvexSource::Kind::file);
  EXPECT_EQ(of_file.file.filename(), "a.obj");
  const Scenario scenario =
      scenario_of(one_part("center_of_mass_m: [1, 2, 3], inertia_kg_m2: [1, 2, 3, 0.1, 0, 0], "
                           "pose: {rpy_rad: [0, 0, 1]}, color: [1, 0, 0, 0.5]") +
                  "solver: {matrix: separate}\n"
                  "processes:\n  P: {level_of_detail: 1, members: all}\n");
  EXPECT_EQ(scenario.parts[0].center_of_mass_m, Vec3(1, 2, 3));
  ASSERT_TRUE(scenario.parts[0].inertia_kg_m2.has_value());
  EXPECT_EQ((*scenario.parts[0].inertia_kg_m2)(0, 1), 0.1);
  EXPECT_EQ((*scenario.parts[0].inertia_kg_m2)(1, 1), 2.0);
  EXPECT_DOUBLE_EQ(scenario.parts[0].X_WB.R(0, 0), std::cos(1.0));
  EXPECT_EQ(scenario.parts[0].color[3], 0.5F);
  EXPECT_EQ(scenario.matrix, SystemMatrix::separate);
  EXPECT_TRUE(scenario.processes.at(0).all_members);
}

TEST(ScenarioChoices, ChoicesOfTheCommandLineApplyToTheContactLevel) {
  const std::string text = "solver: {method: rk2, contact: {method: cvode, tolerance: 1.0e-6}}\n";
  EXPECT_EQ(scenario_of(text).contact_solver.method, "cvode");
  EXPECT_EQ(scenario_of(text, {"solver.method=ida"}).contact_solver.method, "ida");
  const Scenario finer = scenario_of(text, {"solver.tolerance=1e-9"});
  EXPECT_EQ(finer.contact_solver.method, "cvode");
  EXPECT_EQ(finer.contact_solver.tolerance, 1e-9);
}

TEST(ScenarioMistakes, FilesThatGrowWhileTheyAreReadAreRefused) {
  // Not for other readers of YAML, which may follow aliases or nest without a bound.
  const auto error_of = [](const std::string& text, const std::vector<std::string>& overrides = {}) {
    try {
      read_text(text, overrides);
    } catch (const ScenarioError& error) {
      return std::string(error.what());
    }
    return std::string("no error");
  };
  // Nine aliases of nine aliases, twelve times: 2.8e11 values behind them.
  std::string bomb = "&l0 [1, 1, 1, 1, 1, 1, 1, 1, 1]";
  for (int i = 1; i < 12; ++i) {
    std::string next = "&l" + std::to_string(i) + " [" + bomb;
    for (int k = 0; k < 8; ++k) next += ", *l" + std::to_string(i - 1);
    bomb = next + "]";
  }
  for (const std::string key : {"parts", "world", "solver", "robots", "name", "extra"})
    EXPECT_THAT(error_of(key + ": " + bomb + "\n"), HasSubstr("cell.yaml:3:")) << key;
  EXPECT_THAT(error_of("", {"parts=" + bomb}), HasSubstr("found a list of 9 values"));
  constexpr int kDeep = 100'000, kMany = 1'000'001;
  EXPECT_THAT(error_of("parts: " + std::string(kDeep, '[') + std::string(kDeep, ']') + "\n"),
              HasSubstr("cell.yaml:3:"));
  std::string many = "parts: [";
  for (int i = 0; i < kMany; ++i) many += "1,";
  EXPECT_THAT(error_of(many + "]\n"), HasSubstr("more than 1000000 values"));
  EXPECT_THAT(error_of("# " + std::string(17'000'000, 'x') + "\n"), HasSubstr("16 MB"));
}

}  // namespace
}  // namespace takt
