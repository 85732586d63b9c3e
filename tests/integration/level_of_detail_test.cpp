// Levels of detail, power and contacts over DDS, by the client, the command line and raw endpoints.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "client_lib/client.h"
#include "server/headless/device_report.h"
#include "server/scenario/scenario_builder.h"
#include "tests/support/child_process.h"
#include "tests/support/dds_service.h"
#include "tests/support/hosting_client.h"
#include "tests/support/test_device.h"

namespace {

using takt::Client;
using takt::ClientError;
using takt::Contact;
using takt::Contacts;
using takt::Event;
using takt::Power;
using takt::Seconds;
using takt::State;
using takt::Status;
using takt::test::ChildProcess;
using takt::test::DdsService;
using takt::test::kGenerous;

takt::ClientOptions options() {
  takt::ClientOptions options;
  options.cell = takt::test::test_cell();
  options.domain = static_cast<int>(takt::test::test_domain());
  options.timeout = kGenerous;
  options.liveliness_timeout = kGenerous;
  return options;
}

takt::RunLoopOptions loop_options(bool start_paused) {
  takt::RunLoopOptions options;
  if (start_paused) options.state = takt::SimulationState::paused;
  return options;
}

std::shared_ptr<takt::CellModel> model_with_idle_power() {
  auto model = takt::test::service_model(takt::test::test_cell());
  for (auto& dynamics : model->dynamics) dynamics->parameters.power.idle_W = 200.0;
  return model;
}

TEST(LevelOfDetailOverDds, TheLevelChangesWhileRunningAndPowerAndEffortsAreSent) {
  const DdsService service(loop_options(false), model_with_idle_power());
  Client client(options());
  takt::test::RawCellClient raw;
  const auto joints =
      raw.dds.read<sensor_msgs::msg::JointState>(raw.topic("Robot1/joint_states"), true, false, 10);
  EXPECT_TRUE(client.state().robots[0].motor_power.empty());
  ASSERT_EQ(client.status().processes.size(), 1U);
  EXPECT_EQ(client.status().processes[0].level_of_detail, 1);
  EXPECT_EQ(client.status().solver, "rk2");

  const std::string process = client.status().processes[0].name;
  client.set_level_of_detail(2, process);
  const auto changed = client.wait_for(
      takt::topics::event, [](const Event& e) { return e.code == "level_of_detail_changed"; }, kGenerous);
  ASSERT_TRUE(changed.has_value());
  EXPECT_EQ(changed->subject, process);
  ASSERT_TRUE(client.wait_for(
      takt::topics::status,
      [](const Status& s) { return s.processes.at(0).level_of_detail == 2 && s.solver_steps > 0; },
      kGenerous));

  // A motion of the first axis, so that its drive works.
  const State now = client.state();
  std::vector<double> target = now.robot("Robot1").position;
  target[0] += 0.01;
  client.send_joint_command("Robot1", target);
  const auto working = client.wait_for(
      takt::topics::power,
      [](const Power& p) {
        return p.consumers.size() == 2 && p.consumers[0].mechanical_energy > 0.0 &&
               p.consumers[0].electrical_energy > 0.0;
      },
      kGenerous);
  ASSERT_TRUE(working.has_value());
  EXPECT_EQ(working->consumers[0].name, "Robot1");
  EXPECT_EQ(working->consumers[1].name, "Robot2");
  EXPECT_EQ(working->consumers[0].mechanical_power.size(), 8U);  // six joints and two jaws
  const auto later = client.wait_for(
      takt::topics::power, [&](const Power& p) { return p.time >= working->time + 0.5; }, kGenerous);
  ASSERT_TRUE(later.has_value());
  for (std::size_t r = 0; r < 2; ++r) {
    EXPECT_GE(later->consumers[r].electrical_power, 200.0);
    // Idle power alone makes this much.
    EXPECT_GE(later->consumers[r].electrical_energy - working->consumers[r].electrical_energy,
              200.0 * (later->time - working->time) - 1e-6);
    double sum = 0.0;
    for (const double power : later->consumers[r].mechanical_power) sum += power;
    EXPECT_NEAR(sum, later->consumers[r].mechanical_total, 1e-9 + 1e-9 * std::abs(sum));
  }
  const auto dynamic = client.wait_for(
      takt::topics::state, [](const State& s) { return s.robots[0].motor_power.size() == 6; }, kGenerous);
  ASSERT_TRUE(dynamic.has_value());
  EXPECT_GT(std::abs(dynamic->robots[0].effort.at(1)), 10.0);  // the arm's weight on the lift joint
  ASSERT_TRUE(
      joints->wait_for([](const auto& m) { return m.effort.size() == 6 && std::abs(m.effort[1]) > 10.0; }));

  client.set_level_of_detail(1);
  ASSERT_TRUE(client.wait_for(
      takt::topics::power, [](const Power& p) { return p.consumers.empty(); }, kGenerous));
  const auto kinematic = client.wait_for(
      takt::topics::state, [](const State& s) { return s.robots[0].motor_power.empty(); }, kGenerous);
  ASSERT_TRUE(kinematic.has_value());
  EXPECT_EQ(kinematic->robots[0].effort.at(1), 0.0);
  EXPECT_EQ(kinematic->grippers[0].force, 0.0);
  try {
    client.set_level_of_detail(2, "welding");
    FAIL() << "a process that does not exist was changed";
  } catch (const ClientError& error) {
    EXPECT_EQ(error.result(), takt::ControlResult::not_found);  // not found
    EXPECT_NE(std::string(error.what()).find(process), std::string::npos) << error.what();
  }
}

TEST(LevelOfDetailOverDds, JawsPublishTheForceOfTheirDrives) {
  const DdsService service(loop_options(true));
  Client client(options());
  client.set_level_of_detail(2);
  client.set_gripper("Gripper1", takt::GripperAction::close);
  double width = 1.0;
  for (int i = 0; i < 1000 && width > 0.06; ++i) {
    client.step(20);
    width = client.state().gripper("Gripper1").width;
  }
  // Half way the jaws move with their speed; their drives hold them against weight and inertia.
  const State moving = client.state();
  EXPECT_LT(moving.gripper("Gripper1").width, 0.07);
  EXPECT_GT(moving.gripper("Gripper1").force, 0.0);
  EXPECT_LE(moving.gripper("Gripper1").force, 150.0);
}

/// Furnaces and screwdrivers draw power at any level of detail.
TEST(LevelOfDetail, DevicesConsumePowerAsInTheReport) {
  const auto model = model_with_idle_power();
  takt::test::add_chamber(*model);  // has no meter
  takt::test::add_heater(*model);
  DdsService service(loop_options(true), model);
  Client client(options());
  client.step(1000);
  const auto at_end = [](const Power& p) { return p.step == 1000; };
  const auto alone = client.wait_for(takt::topics::power, at_end, kGenerous);
  ASSERT_TRUE(alone.has_value());
  ASSERT_EQ(alone->consumers.size(), 1U);
  EXPECT_EQ(alone->consumers[0].name, "Heater");
  EXPECT_TRUE(alone->consumers[0].mechanical_power.empty());
  EXPECT_EQ(alone->consumers[0].electrical_power, 650.0);
  EXPECT_NEAR(alone->consumers[0].electrical_energy, 650.0, 1e-6);
  ChildProcess person({std::string(TAKT_BIN_DIR) + "/takt", "power", "--cell", takt::test::test_cell(),
                       "--domain", std::to_string(takt::test::test_domain())});
  EXPECT_EQ(person.wait(), 0) << person.text;
  EXPECT_NE(person.text.find("electrical    650.00 W     650.00 J"), std::string::npos) << person.text;

  client.set_level_of_detail(2);
  client.step(1000);
  const auto all = client.wait_for(
      takt::topics::power, [](const Power& p) { return p.step == 2000; }, kGenerous);
  ASSERT_TRUE(all.has_value());
  service.stop();
  takt::Snapshot snapshot = service.simulation().make_snapshot();
  service.simulation().read_snapshot(snapshot);
  const auto reported = takt::consumed_energies(model->description, snapshot);
  ASSERT_EQ(all->consumers.size(), 3U);
  ASSERT_EQ(reported.size(), 3U);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(all->consumers[i].name, reported[i].consumer);
    EXPECT_EQ(all->consumers[i].electrical_energy, reported[i].energy_J);
    EXPECT_EQ(all->consumers[i].electrical_power, reported[i].power_W);
  }
}

TEST(TaktCommand, LodAndPowerArePrinted) {
  const DdsService service(loop_options(true), model_with_idle_power());
  const std::string domain = std::to_string(takt::test::test_domain());
  const auto takt = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), std::string(TAKT_BIN_DIR) + "/takt");
    arguments.insert(arguments.end(), {"--cell", takt::test::test_cell(), "--domain", domain});
    return arguments;
  };
  ChildProcess none(takt({"power"}));
  EXPECT_EQ(none.wait(), 1);
  EXPECT_NE(none.text.find("takt lod 2"), std::string::npos) << none.text;
  ChildProcess four(takt({"lod", "4"}));
  EXPECT_EQ(four.wait(), 2) << four.text;
  ChildProcess three(takt({"lod", "3"}));
  EXPECT_EQ(three.wait(), 1) << three.text;
  EXPECT_NE(three.text.find("no section 'contact'"), std::string::npos) << three.text;
  ChildProcess no_contacts(takt({"contacts"}));
  EXPECT_EQ(no_contacts.wait(), 1);
  EXPECT_NE(no_contacts.text.find("takt lod 3"), std::string::npos) << no_contacts.text;
  ChildProcess nobody(takt({"lod", "2", "welding"}));
  EXPECT_EQ(nobody.wait(), 1);
  EXPECT_NE(nobody.text.find("no process 'welding'"), std::string::npos) << nobody.text;
  ChildProcess two(takt({"lod", "2"}));
  EXPECT_EQ(two.wait(), 0);
  EXPECT_NE(two.text.find("is now 2"), std::string::npos) << two.text;
  Client(options()).step(100);
  ChildProcess person(takt({"power"}));
  EXPECT_EQ(person.wait(), 0) << person.text;
  EXPECT_NE(person.text.find("Robot2"), std::string::npos) << person.text;
  ChildProcess program(takt({"power", "--json", "--until", "0.1"}));
  EXPECT_EQ(program.wait(), 0) << program.text;
  const std::string key = "\"electrical_energy\":";
  const std::size_t at = program.text.find(key);
  ASSERT_NE(at, std::string::npos) << program.text;
  EXPECT_NEAR(std::stod(program.text.substr(at + key.size())), 20.0, 1e-9) << program.text;
  ChildProcess status(takt({"status"}));
  EXPECT_EQ(status.wait(), 0) << status.text;
  EXPECT_NE(status.text.find("solver            rk2, 100 steps, 0 rejected"), std::string::npos)
      << status.text;
}

constexpr double kGravity = 9.80665;

/// Upward force of a Ground on a component, or 0 where the two do not press.
double carried(const Contacts& contacts, const std::string& part, const std::string& ground) {
  const int of = contacts.cell->find_component(part), by = contacts.cell->find_component(ground);
  for (const Contact& c : contacts.contacts) {
    if (c.base == of && c.target == by) return c.force.z;
    if (c.base == by && c.target == of) return -c.force.z;
  }
  return 0.0;
}

TEST(ContactsOverDds, TheCellSwitchesToLevelThreeAndBackWhileRunning) {
  const DdsService service(loop_options(true), takt::test::service_contact_model(takt::test::test_cell()));
  Client client(options());
  const auto takt = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), std::string(TAKT_BIN_DIR) + "/takt");
    arguments.insert(arguments.end(), {"--cell", takt::test::test_cell(), "--domain",
                                       std::to_string(takt::test::test_domain())});
    return arguments;
  };
  EXPECT_FALSE(client.explain_part("P").surface_contact);
  ChildProcess three(takt({"lod", "3"}));
  EXPECT_EQ(three.wait(), 0) << three.text;
  EXPECT_NE(three.text.find("is now 3"), std::string::npos) << three.text;
  EXPECT_TRUE(client.wait_for(
      takt::topics::status, [](const Status& s) { return s.processes.at(0).level_of_detail == 3; },
      kGenerous));
  client.step(300);
  const auto standing = client.wait_for(
      takt::topics::contacts, [](const Contacts& c) { return c.step == 300; }, kGenerous);
  ASSERT_TRUE(standing.has_value());
  ASSERT_EQ(standing->contacts.size(), 2U);
  EXPECT_EQ(standing->omitted, 0U);
  EXPECT_NEAR(carried(*standing, "P", "Table1"), 0.3 * kGravity, 0.01 * 0.3 * kGravity);
  EXPECT_NEAR(carried(*standing, "C", "Table1"), 0.5 * kGravity, 0.01 * 0.5 * kGravity);
  for (const Contact& c : standing->contacts) {
    EXPECT_GT(c.elements, 0U);
    EXPECT_GT(c.area, 1e-5);
    EXPECT_NEAR(c.normal_force, std::abs(c.force.z), 1e-9);
    // Even pressure of a flat face.
    EXPECT_NEAR(c.largest_pressure * c.area, c.normal_force, 0.05 * c.normal_force);
    EXPECT_GT(c.largest_penetration, 0.0);
    EXPECT_NEAR(c.center_of_pressure.z, 0.7, 1e-4);
  }
  const takt::PartExplanation why = client.explain_part("P");
  EXPECT_TRUE(why.surface_contact);
  ASSERT_EQ(why.pressing.size(), 1U);
  EXPECT_EQ(why.pressing[0].by, "Table1");
  EXPECT_NEAR(why.pressing[0].force.z, 0.3 * kGravity, 0.01 * 0.3 * kGravity);
  EXPECT_NE(why.explanation.find("Table1 (2.9"), std::string::npos) << why.explanation;

  ChildProcess person(takt({"contacts"}));
  EXPECT_EQ(person.wait(), 0) << person.text;
  EXPECT_NE(person.text.find("P - Table1"), std::string::npos) << person.text;
  EXPECT_NE(person.text.find("depth um"), std::string::npos) << person.text;
  ChildProcess program(takt({"contacts", "--json", "--until", "0.3"}));
  EXPECT_EQ(program.wait(), 0) << program.text;
  EXPECT_NE(program.text.find("\"largest_penetration\":"), std::string::npos) << program.text;
  ChildProcess explained(takt({"explain", "P"}));
  EXPECT_EQ(explained.wait(), 0) << explained.text;
  EXPECT_NE(explained.text.find("Table1 presses: 2.9"), std::string::npos) << explained.text;

  // The counts of the same run in this process, over the wire.
  const auto counted = client.wait_for(
      takt::topics::status, [](const Status& s) { return s.step == 300; }, kGenerous);
  ASSERT_TRUE(counted.has_value());
  EXPECT_EQ(counted->contact_pairs, 2U);
  takt::ContactCallCounts counts;
  ASSERT_TRUE(service.loop->between_steps([&] { counts = service.host.simulation()->contact_counts(); }));
  EXPECT_GT(counts.made, 300U);
  EXPECT_EQ(counted->contact_calls, counts.made);
  EXPECT_EQ(counted->contact_calls_skipped, counts.skipped);
  EXPECT_EQ(counted->contact_elements, counts.elements);
  EXPECT_GT(counted->contact_rebuilds, 0U);
  ChildProcess status(takt({"status"}));
  EXPECT_EQ(status.wait(), 0) << status.text;
  EXPECT_NE(status.text.find("surface contact   2 pairs press; "), std::string::npos) << status.text;

  client.set_level_of_detail(1);
  ASSERT_TRUE(client.wait_for(
      takt::topics::contacts, [](const Contacts& c) { return c.contacts.empty(); }, kGenerous));
}

/// Sum of area times pressure of the elements (N).
double pressed_with(const takt_msgs::msg::ContactPressure& pair) {
  double force = 0.0;
  const auto corner = [&](std::size_t element, std::size_t k) {
    const auto& c = pair.corners;
    return takt::Vec3(c[9 * element + 3 * k], c[9 * element + 3 * k + 1], c[9 * element + 3 * k + 2]);
  };
  for (std::size_t i = 0; i < pair.pressures.size(); ++i)
    force +=
        0.5 * (corner(i, 1) - corner(i, 0)).cross(corner(i, 2) - corner(i, 0)).norm() * pair.pressures[i];
  return force;
}

TEST(ContactsOverDds, PressuresOfRequestedPairsAreSent) {
  using takt_msgs::msg::ContactPressures;
  const DdsService service(loop_options(true), takt::test::service_contact_model(takt::test::test_cell()));
  Client client(options());
  takt::test::RawCellClient raw;
  const auto pressures =
      raw.dds.read<takt_msgs::msg::ContactPressures>(raw.topic("contact_pressures"), false, false, 10);
  client.set_level_of_detail(3);
  client.step(300);
  ASSERT_TRUE(client.wait_for(
      takt::topics::contacts, [](const Contacts& c) { return c.step == 300; }, kGenerous));

  const auto unknown = raw.request("watch_pressures", {{"pairs", "P-Table9"}});
  EXPECT_EQ(unknown.result, 2);
  EXPECT_NE(unknown.message.find("P-Table1"), std::string::npos) << unknown.message;
  // There are no samples until a request; then they arrive although the cell stands.
  ASSERT_EQ(raw.request("watch_pressures", {{"pairs", "P-Table1"}, {"duration", "86400"}}).result, 1);
  ContactPressures sample;
  ASSERT_TRUE(pressures->wait_for([](const auto& m) { return !m.pairs.empty(); }, &sample));
  EXPECT_FALSE(pressures->wait_briefly([](const auto& all) { return all.front().pairs.size() != 1; }));
  EXPECT_EQ(sample.step, 300U);
  ASSERT_EQ(sample.pairs.size(), 1U);
  const auto& pair = sample.pairs.front();
  EXPECT_EQ(service.model->description.components.at(static_cast<std::size_t>(pair.base)).name, "P");
  EXPECT_EQ(pair.corners.size(), 9 * pair.pressures.size());
  EXPECT_EQ(pair.omitted, 0U);
  EXPECT_NEAR(pressed_with(pair), 0.3 * kGravity, 0.01 * 0.3 * kGravity);
  EXPECT_NEAR(pair.largest_pressure, *std::max_element(pair.pressures.begin(), pair.pressures.end()),
              1e-6 * pair.largest_pressure);
  // Another pair more; then none.
  ASSERT_EQ(raw.request("watch_pressures", {{"pairs", "Table1-C"}, {"duration", "86400"}}).result, 1);
  ASSERT_TRUE(pressures->wait_for([](const auto& m) { return m.pairs.size() == 2; }));
  const auto none = raw.request("watch_pressures", {{"pairs", "*"}, {"duration", "0"}});
  ASSERT_EQ(none.values.size(), 1U);
  EXPECT_EQ(raw.value(none, none.values[0].name), "0");
}

TEST(ContactsOverDds, PressuresOfPairsWithoutContactAreRefused) {
  const DdsService service(loop_options(true));
  takt::test::RawCellClient raw;
  const auto refused = raw.request("watch_pressures", {{"pairs", "*"}});
  EXPECT_EQ(refused.result, 3);
  EXPECT_NE(refused.message.find("section contact"), std::string::npos) << refused.message;
}

TEST(ContactsOverDds, RestingPartsOfThePacedBlockScenarioAreCarriedByTheirTable) {
  takt::ScenarioOptions scenario;
  scenario.overrides = {"solver.method=implicit", "solver.step_s=0.001"};
  scenario.level_of_detail = 3;
  auto model = std::make_shared<takt::CellModel>(
      *takt::load_cell(std::string(TAKT_CONFIG_DIR) + "/scenarios/block_assembly.yaml", scenario));
  takt::RunLoopOptions paced = loop_options(false);
  paced.pace = takt::Pace::realtime;
  const DdsService service(paced, model);
  Client client(options());
  const std::vector<std::pair<std::string, double>> weights{
      {"P", 0.3 * kGravity}, {"C", 0.5 * kGravity}, {"O", 0.8 * kGravity}, {"B", 1.0 * kGravity}};
  std::size_t samples = 0, bad = 0;
  const auto end = client.wait_for(
      takt::topics::contacts,
      [&](const Contacts& contacts) {
        if (contacts.time < 0.5) return false;  // they come to rest
        ++samples;
        double all = 0.0;
        for (const auto& [part, weight] : weights) {
          const double force = carried(contacts, part, "Table1");
          if (std::abs(force - weight) > 0.01 * weight) ++bad;
          all += force;
        }
        if (std::abs(all - 2.6 * kGravity) > 0.01 * 2.6 * kGravity || contacts.contacts.size() != 4) ++bad;
        return contacts.time >= 3.0;
      },
      kGenerous);
  ASSERT_TRUE(end.has_value());
  EXPECT_GT(samples, 10U);
  EXPECT_EQ(bad, 0U);
  EXPECT_EQ(client.status().fault, "");
}

}  // namespace
