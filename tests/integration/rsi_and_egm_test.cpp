// takt-rsi and takt-egm with peers in Python that were written from the fact sheets alone, over UDP and DDS.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <string>

#include "client_lib/kinematics/arm.h"
#include "idl/common/eigen_messages.h"
#include "idl/common/text.h"
#include "tests/support/gateway_cell.h"

namespace takt::test::rsi_and_egm {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

const std::string kRsiScenario = kConfig / "scenarios" / "block_assembly_kr16.yaml";
/// Robot1 there, degrees.
const std::string kRsiStart = "-7.597420,-104.484584,95.110994,0,99.3738,172.403001";
const std::string kEgmStart =
    "34.7269719628792,-64.84736325290658,-122.06292867467057,-83.09033944987198,90.00021045914971,"
    "-55.273238496270515";

const std::string kPrograms = std::string(TAKT_SOURCE_DIR) + "/tests/support/programs/";
using Cell = GatewayCell;

nlohmann::json result_of(const ChildProcess& peer) {
  const std::size_t at = peer.text.find('{');
  return at == std::string::npos ? nlohmann::json()
                                 : nlohmann::json::parse(peer.text.substr(at), nullptr, false);
}

const std::string kRsiController = "role: controller\nrobot: Robot1\nconfiguration: rsi.xml\n";
// On a busy machine a controller may be late.
const std::string kRsiFollower =
    "role: sensor_pc\nrobot: Robot1\nconfiguration: rsi.xml\nsilence: {deadline_s: 2}\n";
const std::string kEgmController = "role: controller\nrobot: Robot1\n";
const std::string kEgmFollower = "role: sensor\nrobot: Robot1\nsilence: {deadline_s: 2}\n";

std::string with_gpio() {
  return with(
      with(
          kRsiXml, R"(<ELEMENT TAG="DEF_Delay" TYPE="LONG"   INDX="INTERNAL" />)",
          R"(<ELEMENT TAG="DEF_Delay" TYPE="LONG" INDX="INTERNAL" /><ELEMENT TAG="GPIO.01" TYPE="BOOL" INDX="1"/>)"),
      R"(<ELEMENT TAG="Stop")",
      R"(<ELEMENT TAG="GPIO.01" TYPE="BOOL" INDX="8" HOLDON="1"/><ELEMENT TAG="Stop")");
}

struct LockstepRun {
  std::uint64_t hash = 0;
  nlohmann::json peer;
  std::string gateway;
  int code = -1;
};

LockstepRun rsi_lockstep(Cell& cell, const std::string& mapping, std::vector<std::string> peer_arguments,
                         const std::string& xml = kRsiXml) {
  ChildProcess peer(Cell::peer("rsi_client.py", std::move(peer_arguments)));
  EXPECT_TRUE(peer.wait_for_output("ready")) << peer.text;
  ChildProcess gateway(cell.gateway("rsi", mapping, {"--lockstep", "--start"}, xml));
  LockstepRun run;
  run.code = gateway.wait();
  run.gateway = gateway.text;
  if (run.code == 0) {
    EXPECT_EQ(peer.wait(), 0) << peer.text;
    run.peer = result_of(peer);
  }
  run.hash = cell.present_state().state_hash;
  return run;
}

TEST(RsiOverUdp, TheRobotIsWhereTheCorrectionOfTheCycleBeforeHasSentIt) {
  Cell cell(kRsiScenario);
  const LockstepRun run = rsi_lockstep(cell, kRsiController, {"--packets", "500"});
  EXPECT_EQ(run.code, 0) << run.gateway;
  EXPECT_LT(run.peer["worst_deg"], 2e-6);  // six decimals in both messages
  EXPECT_EQ(run.peer["delay"], 0);
  EXPECT_EQ(run.peer["ms"], 2000);
  EXPECT_THAT(run.gateway, HasSubstr("The sensor PC has ended RSI (Stop)."));
}

TEST(RsiOverUdp, TenRunsInLockstepHaveTheSameBits) {
  // Level 2: drives, torques, and a gripper that closes.
  Cell cell(kRsiScenario, 2);
  const std::string mapping =
      kRsiController +
      "outputs: {GPIO.01: {gripper: Gripper1}}\ninputs: {GPIO.01: {gripper: Gripper1, is: closed}}\n";
  std::uint64_t expected = 0;
  for (int i = 0; i < 10; ++i) {
    const LockstepRun run =
        rsi_lockstep(cell, mapping, {"--packets", "100", "--gripper", "20,60"}, with_gpio());
    EXPECT_EQ(run.code, 0) << run.gateway;
    EXPECT_EQ(run.peer["held"], 40) << run.gateway;
    if (i == 0) expected = run.hash;
    EXPECT_EQ(run.hash, expected) << i;
    cell.client().reset();
  }
  const LockstepRun other =
      rsi_lockstep(cell, mapping, {"--packets", "100", "--gripper", "20,61"}, with_gpio());
  EXPECT_NE(other.hash, expected);
}

TEST(RsiOverUdp, RelativeCorrectionsAddUpToTheSameMotion) {
  Cell cell(kRsiScenario);
  const LockstepRun run =
      rsi_lockstep(cell, kRsiController + "corrections: relative\n", {"--packets", "250", "--relative"});
  EXPECT_EQ(run.code, 0) << run.gateway;
  EXPECT_LT(run.peer["worst_deg"], 250 * 1e-6);  // of each increment
}

TEST(RsiOverUdp, CorrectionsInRadiansAreFound) {
  Cell cell(kRsiScenario);
  const LockstepRun run = rsi_lockstep(cell, kRsiController, {"--packets", "200", "--fault", "radians"});
  EXPECT_GT(run.peer["worst_deg"], 5.0);
}

TEST(RsiOverUdp, ASecondAnswerToAPacketIsNotApplied) {
  Cell cell(kRsiScenario);
  const LockstepRun run = rsi_lockstep(cell, kRsiController, {"--packets", "200", "--fault", "twice"});
  EXPECT_LT(run.peer["worst_deg"], 2e-6);
}

TEST(RsiOverUdp, AMonitoredCorrectionStopsWithTheReasonAndTheRobotHolds) {
  Cell cell(kRsiScenario);
  const double start = cell.axis1_deg();
  const LockstepRun run = rsi_lockstep(
      cell, kRsiController + "limits: {axis_monitor_deg: [6, 6, 6, 6, 6, 6]}\n", {"--packets", "500"});
  EXPECT_EQ(run.code, 1);
  EXPECT_THAT(run.gateway, HasSubstr("KSS29000: the correction of axis A1"));
  EXPECT_LT(cell.axis1_deg() - start, 6.0);
  EXPECT_GT(cell.axis1_deg() - start, 5.5);
}

/// A run at the pace realtime that ends with the gateway.
std::string rsi_realtime(Cell& cell, const std::string& mapping, std::vector<std::string> peer_arguments,
                         int expected_code) {
  ChildProcess peer(Cell::peer("rsi_client.py", std::move(peer_arguments)));
  EXPECT_TRUE(peer.wait_for_output("ready")) << peer.text;
  ChildProcess gateway(cell.gateway("rsi", mapping, {"--start"}));
  EXPECT_EQ(gateway.wait(), expected_code) << gateway.text;
  return gateway.text;
}

TEST(RsiOverUdp, MissingAnswersStopTheRobotWithTheReason) {
  Cell cell(kRsiScenario);
  const double start = cell.axis1_deg();
  EXPECT_THAT(rsi_realtime(cell, kRsiController, {"--packets", "1000", "--fault", "silent:50:900"}, 1),
              AllOf(HasSubstr("The sensor PC answers."), HasSubstr("KSS29002: 100 packets had no answer")));
  EXPECT_GT(cell.axis1_deg() - start, 3.0);  // it has moved, and has not gone back
}

TEST(RsiOverUdp, AnswersWithAnotherIpocAreNeverApplied) {
  Cell cell(kRsiScenario);
  const double start = cell.axis1_deg();
  EXPECT_THAT(rsi_realtime(cell, kRsiController + "waits_for_sensor: false\ntimeout_packets: 1000\n",
                           {"--packets", "100000", "--fault", "ipoc"}, 1),
              AllOf(HasSubstr("the IPOC of another packet"), HasSubstr("KSS29002"),
                    Not(HasSubstr("The sensor PC answers."))));
  EXPECT_NEAR(cell.axis1_deg(), start, 1e-9);
}

TEST(RsiOverUdp, MalformedAnswersChangeNothing) {
  Cell cell(kRsiScenario);
  const double start = cell.axis1_deg();
  EXPECT_THAT(rsi_realtime(cell, kRsiController + "waits_for_sensor: false\ntimeout_packets: 1000\n",
                           {"--packets", "100000", "--fault", "malformed"}, 1),
              AllOf(HasSubstr("An answer is invalid: no valid XML"), HasSubstr("KSS29002")));
  EXPECT_NEAR(cell.axis1_deg(), start, 1e-9);
}

/// A gateway that follows a controller of the test; ended by a signal when its peer has ended.
struct Followed {
  nlohmann::json peer;
  std::string gateway;
};
Followed follow(Cell& cell, const std::string& protocol, const std::string& mapping,
                const std::string& program, std::vector<std::string> arguments, const std::string& last_words,
                const std::string& xml = kRsiXml) {
  ChildProcess gateway(cell.gateway(protocol, mapping, {"--start"}, xml));
  EXPECT_TRUE(gateway.wait_for_output("Listens")) << gateway.text;
  ChildProcess peer(Cell::peer(program, std::move(arguments)));
  EXPECT_EQ(peer.wait(), 0) << peer.text;
  EXPECT_TRUE(gateway.wait_for_output(last_words)) << gateway.text;
  gateway.signal(SIGTERM);
  EXPECT_EQ(gateway.wait(), 0) << gateway.text;
  return {result_of(peer), gateway.text};
}

/// Where the robot comes to rest.
double end_of_axis1(Cell& cell, double expected_deg) {
  (void)cell.client().wait_for(
      topics::state,
      [&](const State& s) {
        return std::abs(s.robot("Robot1").position.at(0) * 180.0 / M_PI - expected_deg) < 1e-5;
      },
      Seconds(60.0));
  return cell.axis1_deg();
}

TEST(RsiOverUdp, TheRobotFollowsAControllerAndEachPacketIsAnswered) {
  Cell cell(kRsiScenario);
  const Followed run = follow(
      cell, "rsi",
      kRsiFollower +
          "outputs: {GPIO.01: {gripper: Gripper1}}\ninputs: {GPIO.01: {gripper: Gripper1, is: closed}}\n",
      "rsi_krc.py", {"--start=" + kRsiStart, "--seconds", "1.5", "--gripper", "0.5"}, "is silent",
      with_gpio());
  EXPECT_EQ(run.peer["packets"], 375);
  EXPECT_GT(run.peer["answered"], 50) << run.peer;  // the rest is late on a busy machine
  EXPECT_EQ(run.peer["doubled"], 0);
  EXPECT_GT(run.peer["holding"], 20);
  EXPECT_THAT(run.gateway, AllOf(HasSubstr("The robot follows its controller."),
                                 HasSubstr("375 packets, 0 invalid, 1 starts")));
  const double end = run.peer["end"][0];
  EXPECT_NEAR(end_of_axis1(cell, end), end, 1e-5);
  EXPECT_TRUE(cell.present_state().gripper("Gripper1").closed);
}

TEST(RsiOverUdp, ARestartedControllerIsLedToWithoutAJump) {
  Cell cell(kRsiScenario);
  const Followed run =
      follow(cell, "rsi", kRsiFollower + "first_command: {ramp_speed_rad_per_s: 1}\n", "rsi_krc.py",
             {"--start=20,-104.484584,95.110994,0,99.3738,172.403001", "--seconds", "3", "--amplitude", "0",
              "--fault", "restart"},
             "is silent");
  EXPECT_THAT(run.gateway, HasSubstr("2 starts of the controller"));
  EXPECT_NEAR(end_of_axis1(cell, 20.0), 20.0, 1e-5);
}

TEST(RsiOverUdp, PacketsWithoutAxesOrCutOffAreRefusedAndTheRobotStays) {
  for (const std::string fault : {"missing", "cut"}) {
    Cell cell(kRsiScenario);
    const double start = cell.axis1_deg();
    const Followed run =
        follow(cell, "rsi", kRsiFollower, "rsi_krc.py",
               {"--start=" + kRsiStart, "--seconds", "0.2", "--fault", fault}, "A packet is invalid");
    EXPECT_EQ(run.peer["answered"], 0);
    EXPECT_NEAR(cell.axis1_deg(), start, 1e-9);
  }
}

TEST(EgmOverUdp, TheTrackingErrorIsThatOfTheControlLaw) {
  // Reference 10 sin(w t), w = 2 pi / 2 s, gain 20 1/s: the amplitude of the error is 10 w / sqrt(w^2 + 20^2), and with the
  // speed reference it is one cycle's way.
  const double w = M_PI, lag = 10.0 * w / std::hypot(w, 20.0), cycle = 10.0 * w * 0.004;
  for (const bool feed_forward : {false, true}) {
    Cell cell(kBlockScenario);
    std::vector<std::string> arguments{"--messages", "1001"};
    if (feed_forward) arguments.push_back("--feed-forward");
    ChildProcess peer(Cell::peer("egm_client.py", arguments));
    ASSERT_TRUE(peer.wait_for_output("ready")) << peer.text;
    ChildProcess gateway(cell.gateway("egm", kEgmController, {"--lockstep", "--start", "--until", "4.004"}));
    EXPECT_EQ(gateway.wait(), 0) << gateway.text;
    EXPECT_EQ(peer.wait(), 0) << peer.text;
    const nlohmann::json result = result_of(peer);
    EXPECT_NEAR(result["worst_deg"].get<double>(), feed_forward ? cycle : lag, feed_forward ? 1e-3 : cycle)
        << result;
    EXPECT_EQ(result["first_seqno"], 0);
    EXPECT_EQ(result["last_seqno"], 1000);
    EXPECT_EQ(result["states"].dump(), "[[1,3,2]]");  // motors on, MCI and RAPID running
  }
}

TEST(EgmOverUdp, RunsInLockstepHaveTheSameBits) {
  Cell cell(kBlockScenario);
  std::uint64_t expected = 0;
  const std::string mapping =
      kEgmController +
      "outputs: {digital: {gripper: Gripper1}}\ninputs: {digital: {gripper: Gripper1, is: closed}}\n";
  for (int i = 0; i < 3; ++i) {
    ChildProcess peer(Cell::peer("egm_client.py", {"--messages", "200", "--gripper", "50,150"}));
    ASSERT_TRUE(peer.wait_for_output("ready")) << peer.text;
    ChildProcess gateway(cell.gateway("egm", mapping, {"--lockstep", "--start", "--until", "0.8"}));
    EXPECT_EQ(gateway.wait(), 0) << gateway.text;
    EXPECT_EQ(peer.wait(), 0) << peer.text;
    EXPECT_EQ(result_of(peer)["held"], 100);
    const std::uint64_t hash = cell.present_state().state_hash;
    if (i == 0) expected = hash;
    EXPECT_EQ(hash, expected);
    cell.client().reset();
  }
}

TEST(EgmOverUdp, RadiansAndCutMessagesAreFound) {
  for (const std::string fault : {"radians", "cut"}) {
    Cell cell(kBlockScenario);
    const double start = cell.axis1_deg();
    ChildProcess peer(Cell::peer("egm_client.py", {"--messages", "150", "--fault", fault}));
    ASSERT_TRUE(peer.wait_for_output("ready")) << peer.text;
    ChildProcess gateway(cell.gateway("egm", kEgmController, {"--start", "--until", "0.7"}));
    EXPECT_EQ(gateway.wait(), 0) << gateway.text;
    EXPECT_EQ(gateway.text.find("no valid protocol buffer") != std::string::npos, fault == "cut")
        << gateway.text;
    if (fault == "radians") {
      EXPECT_GT(std::abs(cell.axis1_deg() - start), 5.0);
    } else {
      EXPECT_NEAR(cell.axis1_deg(), start, 1e-9) << fault;
    }
  }
}

TEST(EgmOverUdp, AProgrammedPathIsCorrectedAcrossIt) {
  Cell cell(kBlockScenario);
  const auto info = cell.client().cell();
  const Arm arm(*info, "Robot1");
  const Pose X_RW = pose_of(info->robots.at(0).base).inverse();
  const auto flange = [&] {
    return X_RW * arm.forward_kinematics(cell.present_state().robot("Robot1").position);
  };
  // 40 mm along x of the flange: y of the path is x cross z of the flange, which is -y, and z of the path is -z.
  const Pose start = flange();
  const Vec3 end = start.p + 0.04 * start.R.col(0);
  const Quat q = start.quaternion();
  const std::vector<double> place{end.x(), end.y(), end.z()}, turn{q.x(), q.y(), q.z(), q.w()};
  const std::string mapping =
      kEgmController + "guidance: path\npath: {speed_mm_per_s: 50, points: [{pose: {position_m: [" +
      join(place, ", ", exact_text) + "], quaternion_xyzw: [" + join(turn, ", ", exact_text) + "]}}]}\n";
  ChildProcess peer(Cell::peer("egm_client.py", {"--messages", "500", "--path", "3,-2"}));
  ASSERT_TRUE(peer.wait_for_output("ready")) << peer.text;
  ChildProcess gateway(cell.gateway("egm", mapping, {"--lockstep", "--start", "--until", "2.0"}));
  EXPECT_EQ(gateway.wait(), 0) << gateway.text;
  EXPECT_EQ(peer.wait(), 0) << peer.text;
  EXPECT_EQ(result_of(peer)["converged"], true);
  const Vec3 expected = end - 0.003 * start.R.col(1) + 0.002 * start.R.col(2);
  EXPECT_LT((flange().p - expected).norm(), 1e-6);
  EXPECT_LT((flange().R - start.R).norm(), 1e-6);
}

TEST(EgmOverUdp, ASensorThatFallsSilentEndsTheSession) {
  Cell cell(kBlockScenario);
  ChildProcess peer(Cell::peer("egm_client.py", {"--messages", "200", "--fault", "silent:50"}));
  ASSERT_TRUE(peer.wait_for_output("ready")) << peer.text;
  ChildProcess gateway(cell.gateway("egm", kEgmController + "control: {comm_timeout_s: 0.2}\n",
                                    {"--start", "--until", "1.2"}));
  EXPECT_EQ(gateway.wait(), 0) << gateway.text;
  EXPECT_EQ(peer.wait(), 0) << peer.text;
  EXPECT_THAT(gateway.text, HasSubstr("41822: no data from the UdpUc device for 0.2 s"));
  const std::string states = result_of(peer)["states"].dump();
  EXPECT_THAT(states, HasSubstr("[1,2,1]"));
}

TEST(EgmOverUdp, TheRobotFollowsAControllerAndAnswersWithSignals) {
  Cell cell(kBlockScenario);
  const Followed run = follow(
      cell, "egm",
      kEgmFollower +
          "outputs: {digital: {gripper: Gripper1}}\ninputs: {digital: {gripper: Gripper1, is: closed}}\n",
      "egm_robot.py", {"--start=" + kEgmStart, "--seconds", "1.5", "--gripper", "0.5"}, "is silent");
  EXPECT_GT(run.peer["answers"], 50);
  EXPECT_EQ(run.peer["digital"], 1);
  EXPECT_THAT(run.gateway, HasSubstr("375 messages, 0 invalid, 1 starts"));
  const double end = run.peer["end"][0];
  EXPECT_NEAR(end_of_axis1(cell, end), end, 1e-5);
}

TEST(EgmOverUdp, MotorsThatAreOffHoldTheRobot) {
  Cell cell(kBlockScenario);
  const Followed run = follow(
      cell, "egm", kEgmFollower, "egm_robot.py",
      {"--start=" + kEgmStart, "--seconds", "1", "--fault", "motors_off", "--amplitude", "20"}, "is silent");
  EXPECT_THAT(run.gateway, HasSubstr("The motors are off"));
  EXPECT_GT(std::abs(cell.axis1_deg() - run.peer["end"][0].get<double>()), 0.1);
}

/// The block scenario with a sensor between the flange of Robot1 and its gripper.
std::string scenario_with_sensor(const TemporaryDirectory& directory, const std::string& replaced = {},
                                 const std::string& by = {}) {
  std::ifstream in(kBlockScenario);
  std::stringstream text;
  text << in.rdbuf();
  std::string scenario = with(text.str(), "../", (kConfig / "").string());
  if (!replaced.empty()) scenario = with(scenario, replaced, by);
  directory.write("sensor.yaml", scenario + "\nforce_torque_sensors:\n  FT1: {robot: Robot1}\n");
  return directory / "sensor.yaml";
}

constexpr double kGripper_N = 3.0 * 9.80665;  // mass_kg of the gripper

double size_of_force(const nlohmann::json& values) {
  return std::hypot(values[0].get<double>(), values[1].get<double>(), values[2].get<double>());
}

std::vector<double> sensor_of(Cell& cell) {
  const auto signals = cell.present_state().signals("FT1");
  std::vector<double> values;
  for (const char* name : {"force_x", "force_y", "force_z", "torque_x", "torque_y", "torque_z"})
    values.push_back(signals.at(name));
  return values;
}

TEST(ForceSensorInProtocols, EgmSendsItAsMeasuredForceOfItsRobotWare) {
  const TemporaryDirectory directory;
  Cell cell(scenario_with_sensor(directory), 2);
  for (const std::string robotware : {"6", "7"}) {
    ChildProcess peer(Cell::peer("egm_client.py", {"--messages", "100", "--amplitude", "0"}));
    ASSERT_TRUE(peer.wait_for_output("ready")) << peer.text;
    ChildProcess gateway(cell.gateway("egm",
                                      kEgmController + "force_sensor: FT1\nrobotware: " + robotware + "\n",
                                      {"--lockstep", "--start", "--until", "0.4"}));
    EXPECT_EQ(gateway.wait(), 0) << gateway.text;
    EXPECT_EQ(peer.wait(), 0) << peer.text;
    const nlohmann::json force = result_of(peer)["force"];
    ASSERT_EQ(force.size(), 6U) << robotware << force;
    EXPECT_NEAR(size_of_force(force), kGripper_N, 0.05);
    const std::vector<double> sensor = sensor_of(cell);
    for (std::size_t i = 0; i < sensor.size(); ++i) EXPECT_NEAR(force[i].get<double>(), sensor[i], 0.01) << i;
    cell.client().reset();
  }
}

TEST(ForceSensorInProtocols, RsiSendsItsAxesAsElementsOfTheConfiguration) {
  const TemporaryDirectory directory;
  Cell cell(scenario_with_sensor(directory), 2);
  std::string elements, inputs = "inputs:\n";
  int index = 1;
  for (const auto& [tag, signal] : std::vector<std::pair<std::string, std::string>>{{"FX", "force_x"},
                                                                                    {"FY", "force_y"},
                                                                                    {"FZ", "force_z"},
                                                                                    {"TX", "torque_x"},
                                                                                    {"TY", "torque_y"},
                                                                                    {"TZ", "torque_z"}}) {
    elements += "<ELEMENT TAG=\"FT." + tag + "\" TYPE=\"DOUBLE\" INDX=\"" + std::to_string(index++) + "\"/>";
    inputs += "  FT." + tag + ": {device: FT1, signal: " + signal + "}\n";
  }
  const std::string last = R"(<ELEMENT TAG="DEF_Delay" TYPE="LONG"   INDX="INTERNAL" />)";
  const LockstepRun run =
      rsi_lockstep(cell, kRsiController + inputs, {"--packets", "100", "--amplitude", "0"},
                   with(kRsiXml, last, last + elements));
  EXPECT_EQ(run.code, 0) << run.gateway;
  const nlohmann::json force = run.peer["force"];
  ASSERT_EQ(force.size(), 6U) << run.peer;
  EXPECT_NEAR(size_of_force(force), kGripper_N, 0.05);
  const std::vector<double> sensor = sensor_of(cell);
  for (std::size_t i = 0; i < sensor.size(); ++i) EXPECT_NEAR(force[i].get<double>(), sensor[i], 0.01) << i;
}

TEST(RsiOverUdp, FixedNumbersFillWhatTheCellDoesNotHave) {
  Cell cell(kRsiScenario);
  std::string elements, inputs = "inputs:\n";
  std::vector<double> expected;
  for (const char* axis : {"FX", "FY", "FZ", "TX", "TY", "TZ"}) {
    expected.push_back(12.5 * static_cast<double>(expected.size() + 1));
    elements += "<ELEMENT TAG=\"FT." + std::string(axis) + "\" TYPE=\"DOUBLE\" INDX=\"" +
                std::to_string(expected.size()) + "\"/>";
    inputs += "  FT." + std::string(axis) + ": {value: " + std::to_string(expected.back()) + "}\n";
  }
  const std::string last = R"(<ELEMENT TAG="DEF_Delay" TYPE="LONG"   INDX="INTERNAL" />)";
  const LockstepRun run = rsi_lockstep(cell, kRsiController + inputs, {"--packets", "50", "--amplitude", "0"},
                                       with(kRsiXml, last, last + elements));
  EXPECT_EQ(run.code, 0) << run.gateway;
  EXPECT_EQ(run.peer["force"].get<std::vector<double>>(), expected) << run.peer;
  const LockstepRun both = rsi_lockstep(
      cell, kRsiController + "inputs: {DEF_Delay: {value: 1, gripper: Gripper1}}\n", {"--packets", "1"});
  EXPECT_NE(both.code, 0);
}

TEST(ForceSensorInProtocols, UrReadsItAndForceModePressesWithTheForceThatAProgramWants) {
  // The gripper holds P, which stands on the table; surface contact.
  const TemporaryDirectory directory;
  Cell cell(scenario_with_sensor(directory, "[0.6061, -1.1318, -2.1304, -1.4502, 1.5708, -0.9647]",
                                 "[0.673322, -1.625741, -2.346268, -0.74038, 1.570796, -0.897474]"),
            3);
  const int port = gateway_port();
  const auto free = [port](int i) { return std::to_string(port + 100 + i); };
  // Slower than wall time: on a busy machine the forces that the controller reads are old.
  cell.client().set_pace(Pace::realtime, 0.25);
  cell.client().play();
  std::vector<std::string> command = cell.gateway("ur", "", {});
  directory.write(
      "ur.yaml",
      "takt_ur: 1\nrobot: Robot1\ntool: Gripper1\nforce_sensor: FT1\ntime: simulated\nlisten: {rtde: " +
          free(0) + ", primary: " + free(1) + ", secondary: " + free(2) + ", realtime: " + free(3) +
          ", dashboard: " + free(4) + "}\noutputs: {tool_digital_output_0: {gripper: Gripper1}}\n");
  command.at(1) = directory / "ur.yaml";
  ChildProcess gateway(command);
  ASSERT_TRUE(gateway.wait_for_output("RTDE at")) << gateway.text;
  ChildProcess peer({"/usr/bin/python3", "-B", kPrograms + "ur_press.py", free(0), free(1), "20"});
  EXPECT_EQ(peer.wait(), 0) << peer.text << gateway.text;
  gateway.signal(SIGTERM);
  EXPECT_EQ(gateway.wait(), 0) << gateway.text;
  const nlohmann::json result = result_of(peer);
  ASSERT_TRUE(result.contains("raw")) << peer.text << gateway.text;
  EXPECT_NEAR(size_of_force(result["raw"]), kGripper_N, 1.0);
  EXPECT_NEAR(result["mean_N"].get<double>(), 20.0, 0.5) << result;
  EXPECT_GT(result["lowest_N"].get<double>(), 18.0) << result;
  EXPECT_LT(result["highest_N"].get<double>(), 22.0) << result;
  EXPECT_LT(std::abs(result["way_m"].get<double>()), 0.002) << result;
}

TEST(RsiAndEgmMappings, MistakesAreReportedWithFileAndKey) {
  Cell cell(kRsiScenario);
  const auto error = [&](const std::string& protocol, const std::string& mapping,
                         std::vector<std::string> arguments = {}) {
    ChildProcess gateway(cell.gateway(protocol, mapping, std::move(arguments)));
    EXPECT_EQ(gateway.wait(), 1) << mapping;
    return gateway.text;
  };
  EXPECT_THAT(error("rsi", "role: controller\nrobot: Robot9\nconfiguration: rsi.xml\n"),
              AllOf(HasSubstr("mapping.yaml:5"), HasSubstr("Robot1, Robot2")));
  EXPECT_THAT(error("rsi", kRsiController + "outputs: {GPIO.01: {gripper: Gripper1}}\n"),
              HasSubstr("a tag of the list RECEIVE"));
  EXPECT_THAT(error("rsi", kRsiController + "cycle_ms: 8\n"), HasSubstr("allowed: 4, 12"));
  EXPECT_THAT(error("rsi", kRsiController + "silence: {deadline_s: 1}\n"), HasSubstr("silence"));
  EXPECT_THAT(error("rsi", kRsiFollower, {"--lockstep"}), HasSubstr("does not wait"));
  EXPECT_THAT(error("egm", kEgmController + "outputs: {number41: {gripper: Gripper1}}\n"),
              HasSubstr("number1 to number40"));
  EXPECT_THAT(error("egm", kEgmController + "cycle_ms: 6\n"), HasSubstr("a multiple of 4"));
  EXPECT_THAT(error("egm", kEgmController + "force_sensor: Gripper1\n"),
              HasSubstr("a force-torque sensor on the robot's flange of this scenario: none"));
  EXPECT_THAT(error("rsi", kRsiController + "filter_rad_per_s: -1\n"), HasSubstr("filter_rad_per_s"));
}

}  // namespace
}  // namespace takt::test::rsi_and_egm
