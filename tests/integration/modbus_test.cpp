// takt-modbus with independent peers over TCP and DDS: a master with the standard library of Python, and where the packages
// are there pymodbus and mbpoll (Debian), modbus-serial and jsmodbus (npm), and ClassicLadder (LinuxCNC).
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "tests/support/program_cell.h"
#include "tests/support/temporary_directory.h"

namespace takt::test::modbus {
namespace {

using testing::Each;
using testing::ElementsAre;
using testing::HasSubstr;

const std::string kPrograms = std::string(TAKT_SOURCE_DIR) + "/tests/support/programs/";

/// A TCP port for each domain, so that tests may run side by side; beyond those that Linux gives to any socket.
int test_port() {
  return 61'050 + static_cast<int>(test_domain() % 50);
}

bool exists(const std::string& file) {
  return std::filesystem::exists(file);
}

class Cell : public ProgramCell {
 public:
  explicit Cell(const std::string& scenario = kBlockScenario) : ProgramCell("modbus", scenario) {}

  std::vector<std::string> gateway(const std::string& mapping, std::vector<std::string> arguments) {
    directory_.write("mapping.yaml", "takt_modbus: 1\nport: " + std::to_string(test_port()) + "\n" + mapping);
    arguments.insert(arguments.begin(), directory_ / "mapping.yaml");
    return command("takt-modbus", arguments);
  }
  /// True when the last command of the gripper closes it (or opens it).
  bool becomes(const std::string& gripper, bool closed) {
    return client()
        .wait_for(
            topics::state, [&](const State& state) { return state.gripper(gripper).closed == closed; },
            Seconds{60.0})
        .has_value();
  }

 private:
  TemporaryDirectory directory_;
};

std::vector<std::string> python(const std::string& program, std::vector<std::string> arguments) {
  std::vector<std::string> command{"/usr/bin/python3", "-B", kPrograms + program,
                                   std::to_string(test_port())};
  command.insert(command.end(), arguments.begin(), arguments.end());
  return command;
}

nlohmann::json result_of(const ChildProcess& peer) {
  const std::size_t at = peer.text.find('{');
  return at == std::string::npos ? nlohmann::json()
                                 : nlohmann::json::parse(peer.text.substr(at), nullptr, false);
}

const std::string kServer = R"(role: server
unit: 1
coils:
  0: {gripper: Gripper1, substitute: 0}
  1: {gripper: Gripper2}
discrete_inputs:
  0: {gripper: Gripper1, is: closed}
  1: {gripper: Gripper1, is: moving}
holding_registers:
  0: {gripper: Gripper2, as: width, type: uint16, scale: 0.001}
input_registers:
  0: {cell: step, type: uint32}
  2: {gripper: Gripper1, is: width, type: float32}
  4: {robot: Robot1, joint: joint_1, type: float32, word_order: low_first}
)";

/// The mapping with the name of a joint of the cell.
std::string server_mapping(const Cell&, const State& state) {
  std::string mapping = kServer;
  const std::string joint = state.cell->robots[0].joints[0].name;
  return mapping.replace(mapping.find("joint_1"), 7, joint);
}

TEST(ModbusServer, AnswersHostileMastersAndStays) {
  Cell cell;
  ChildProcess gateway(cell.gateway(server_mapping(cell, cell.client().state()), {"--start"}));
  ASSERT_TRUE(gateway.wait_for_output("Listens")) << gateway.text;
  ChildProcess peer(python("modbus_raw.py", {"hostile"}));
  EXPECT_EQ(peer.wait(), 0) << peer.text;
  const nlohmann::json result = result_of(peer);
  for (const char* closed : {"protocol", "length_0", "length_65535", "http"})
    EXPECT_EQ(result[closed], true) << closed;
  EXPECT_EQ(result["function_99"], "e301");
  EXPECT_EQ(result["address"], "8302");
  EXPECT_EQ(result["count"], "8103");
  EXPECT_EQ(result["coil_value"], "8503");
  EXPECT_EQ(result["pipelined"], nlohmann::json({100, 101, 102, 103, 104, 105, 106, 107, 108, 109}));
  EXPECT_EQ(result["many"], 30);
  EXPECT_EQ(result["unit"], 9);
  gateway.signal(SIGTERM);
  EXPECT_EQ(gateway.wait(), 0) << gateway.text;
  EXPECT_THAT(gateway.text, HasSubstr("protocol"));
}

TEST(ModbusServer, APlcThatFallsSilentLeavesTheSubstituteValues) {
  Cell cell;
  ChildProcess gateway(cell.gateway(
      server_mapping(cell, cell.client().state()) + "silence: {deadline_s: 0.5}\n", {"--start"}));
  ASSERT_TRUE(gateway.wait_for_output("Listens")) << gateway.text;
  {
    ChildProcess peer(python("modbus_raw.py", {"write", "0", "1"}));
    ASSERT_TRUE(peer.wait_for_output("ff00")) << peer.text;
    ChildProcess second(python("modbus_raw.py", {"write", "1", "1"}));
    ASSERT_TRUE(second.wait_for_output("ff00")) << second.text;
  }
  EXPECT_TRUE(gateway.wait_for_output("is silent; the substitute values apply")) << gateway.text;
  EXPECT_TRUE(cell.becomes("Gripper1", false));
  EXPECT_TRUE(cell.becomes("Gripper2", true));  // it has no substitute
  gateway.signal(SIGTERM);
  EXPECT_EQ(gateway.wait(), 0) << gateway.text;
}

TEST(ModbusServer, AMasterStepsTheCellWithTheSameBits) {
  Cell cell;
  std::string hash;
  for (int run = 0; run < 3; ++run) {
    std::string mapping = server_mapping(cell, cell.client().state());
    mapping.replace(mapping.find("discrete_inputs"), 0, "  7: {cell: allow_step}\n");
    ChildProcess gateway(cell.gateway(mapping + "period_s: 0.01\n", {"--lockstep", "--start"}));
    ASSERT_TRUE(gateway.wait_for_output("Waits for the coil allow_step")) << gateway.text;
    ChildProcess peer(python("modbus_raw.py", {"lockstep", "60", "7"}));
    EXPECT_EQ(peer.wait(), 0) << peer.text;
    gateway.signal(SIGTERM);
    EXPECT_EQ(gateway.wait(), 0) << gateway.text;
    const nlohmann::json result = result_of(peer);
    const std::vector<std::uint64_t> steps = result["steps"];
    ASSERT_EQ(steps.size(), 60U);
    const auto per_period = static_cast<std::uint64_t>(std::llround(0.01 / cell.client().cell()->step_size));
    for (std::size_t i = 0; i < steps.size(); ++i) EXPECT_EQ(steps[i], (i + 1) * per_period);
    const std::vector<double> widths = result["values"];
    EXPECT_LT(widths[19], widths[9]);  // closing in periods 10 to 19
    const std::string now = gateway.text.substr(gateway.text.find("state hash"));
    if (run == 0) hash = now;
    EXPECT_EQ(now, hash);
    cell.client().reset();
  }
}

TEST(ModbusServer, AMistakeInTheMappingNamesFileLineAndKey) {
  Cell cell;
  const auto error_of = [&](const std::string& mapping) {
    ChildProcess gateway(cell.gateway(mapping, {}));
    EXPECT_EQ(gateway.wait(), 1) << gateway.text;
    return gateway.text;
  };
  EXPECT_THAT(error_of("role: server\ncoils:\n  0: {gripper: Gripper9}\n"), HasSubstr("mapping.yaml:5"));
  EXPECT_THAT(error_of("role: server\ncoils:\n  70000: {gripper: Gripper1}\n"), HasSubstr("0 to 65535"));
  EXPECT_THAT(error_of("role: server\nholding_registers:\n  0: {gripper: Gripper1, as: width}\n"),
              HasSubstr("type"));
  EXPECT_THAT(error_of("role: server\ninput_registers:\n  0: {cell: step, type: uint32}\n  1: {cell: step, "
                       "type: uint32}\n"),
              HasSubstr("addresses 0 and 1 with a common register"));
  EXPECT_THAT(error_of("role: server\ncoils:\n  0: {gripper: Gripper1, device: X}\n"), HasSubstr("device"));
  EXPECT_THAT(error_of("role: server\n"), HasSubstr("no element"));
}

TEST(ModbusPeers, PymodbusReadsAndWrites) {
  if (!exists("/usr/lib/python3/dist-packages/pymodbus") ||
      !exists("/usr/lib/python3/dist-packages/serial_asyncio"))
    GTEST_SKIP() << "needs Debian's python3-pymodbus and python3-serial-asyncio";
  Cell cell;
  ChildProcess gateway(cell.gateway(server_mapping(cell, cell.client().state()), {"--start"}));
  ASSERT_TRUE(gateway.wait_for_output("Listens")) << gateway.text;
  ChildProcess peer(python("modbus_pymodbus.py", {"client"}));
  EXPECT_EQ(peer.wait(), 0) << peer.text;
  const nlohmann::json result = result_of(peer);
  EXPECT_EQ(result["coil"], true) << peer.text;
  EXPECT_EQ(result["holding"], nlohmann::json({20}));
  EXPECT_EQ(result["combined"], nlohmann::json({25}));
  EXPECT_EQ(result["too_wide"], 3);
  EXPECT_EQ(result["inputs"], true);
  EXPECT_EQ(result["beyond"], 2);
  EXPECT_THAT(result["device_identification"], ElementsAre("takt", "takt-modbus", testing::Ne("")));
  EXPECT_TRUE(cell.becomes("Gripper1", true));
  gateway.signal(SIGTERM);
  EXPECT_EQ(gateway.wait(), 0) << gateway.text;
}

TEST(ModbusPeers, TaktPollsAServerOfPymodbus) {
  if (!exists("/usr/lib/python3/dist-packages/pymodbus") ||
      !exists("/usr/lib/python3/dist-packages/serial_asyncio"))
    GTEST_SKIP() << "needs Debian's python3-pymodbus and python3-serial-asyncio";
  Cell cell;
  const std::string mapping = R"(role: client
poll_ms: 10
discrete_inputs:
  0: {gripper: Gripper1, substitute: 1}
coils:
  1: {gripper: Gripper1, is: closed}
holding_registers:
  4: {cell: time_ms, type: uint32}
silence: {deadline_s: 2}
)";
  // The PLC comes later than takt.
  ChildProcess gateway(cell.gateway(mapping, {"--start"}));
  ASSERT_TRUE(gateway.wait_for_output("does not answer")) << gateway.text;
  {
    ChildProcess plc(python("modbus_pymodbus.py", {"server"}));
    ASSERT_TRUE(plc.wait_for_output("ready")) << plc.text;
    ASSERT_TRUE(gateway.wait_for_output("is connected")) << gateway.text;
    EXPECT_TRUE(plc.wait_for_output("opens")) << plc.text;  // takt has closed it, and the PLC has read that
    EXPECT_TRUE(cell.becomes("Gripper1", false));
  }
  EXPECT_TRUE(gateway.wait_for_output("is lost")) << gateway.text;
  EXPECT_TRUE(gateway.wait_for_output("The PLC is silent; the substitute values apply")) << gateway.text;
  EXPECT_TRUE(cell.becomes("Gripper1", true));
  gateway.signal(SIGTERM);
  EXPECT_EQ(gateway.wait(), 0) << gateway.text;
}

TEST(ModbusPeers, MbpollReadsAndWrites) {
  if (!exists("/usr/bin/mbpoll")) GTEST_SKIP() << "needs Debian's mbpoll";
  Cell cell;
  ChildProcess gateway(cell.gateway(server_mapping(cell, cell.client().state()), {"--start"}));
  ASSERT_TRUE(gateway.wait_for_output("Listens")) << gateway.text;
  const auto mbpoll = [&](std::vector<std::string> arguments) {
    std::vector<std::string> command{"/usr/bin/mbpoll",          "-1", "-q", "-0", "-a", "1", "-p",
                                     std::to_string(test_port())};
    command.insert(command.end(), arguments.begin(), arguments.end());
    ChildProcess peer(command);
    peer.wait();
    return peer.text;
  };
  EXPECT_THAT(mbpoll({"-t", "0", "-r", "0", "127.0.0.1", "1"}), HasSubstr("Written 1 references"));
  EXPECT_TRUE(cell.becomes("Gripper1", true));
  EXPECT_THAT(mbpoll({"-t", "1", "-r", "0", "127.0.0.1"}), HasSubstr("[0]: \t1"));
  EXPECT_THAT(mbpoll({"-t", "4", "-r", "0", "127.0.0.1", "17"}), HasSubstr("Written 1 references"));
  EXPECT_THAT(mbpoll({"-t", "4", "-r", "0", "127.0.0.1"}), HasSubstr("[0]: \t17"));
  // mbpoll reads the high word first with -B.
  const State state = cell.client().state();
  EXPECT_THAT(mbpoll({"-t", "3:float", "-r", "4", "127.0.0.1"}), HasSubstr("[4]: \t" + [&] {
                char text[32];
                std::snprintf(text, sizeof text, "%g",
                              static_cast<double>(static_cast<float>(state.robot("Robot1").position[0])));
                return std::string(text);
              }()));
  EXPECT_THAT(mbpoll({"-t", "3", "-r", "500", "127.0.0.1"}), HasSubstr("Illegal data address"));
  gateway.signal(SIGTERM);
  EXPECT_EQ(gateway.wait(), 0) << gateway.text;
}

void node_peer(const std::string& package) {
  const std::string modules = std::string(TAKT_BIN_DIR) + "/../tests/web/node_modules";
  if (!exists(modules + "/" + package))
    GTEST_SKIP() << "needs npm's " << package << ", which the target takt_web_tests installs";
  Cell cell;
  ChildProcess gateway(cell.gateway(server_mapping(cell, cell.client().state()), {"--start"}));
  ASSERT_TRUE(gateway.wait_for_output("Listens")) << gateway.text;
  ChildProcess peer({"/usr/bin/env", "NODE_PATH=" + modules, "node", kPrograms + "modbus_node.js",
                     std::to_string(test_port()), package});
  EXPECT_EQ(peer.wait(), 0) << peer.text;
  const nlohmann::json result = result_of(peer);
  EXPECT_EQ(result["coil"], true) << peer.text;
  EXPECT_EQ(result["holding"], nlohmann::json({20}));
  EXPECT_EQ(result["inputs"], true);
  EXPECT_EQ(result["input"], 4);
  EXPECT_EQ(result["tooWide"], 3);
  EXPECT_EQ(result["beyond"], 2);
  EXPECT_TRUE(cell.becomes("Gripper1", true));
  gateway.signal(SIGTERM);
  EXPECT_EQ(gateway.wait(), 0) << gateway.text;
}

TEST(ModbusPeers, ModbusSerialOfNpmReadsAndWrites) {
  node_peer("modbus-serial");
}

TEST(ModbusPeers, JsmodbusOfNpmReadsAndWrites) {
  node_peer("jsmodbus");
}

// The soft PLC of LinuxCNC uses shared memory of the whole machine: one at a time (tests/schedule.cmake).
/// A ladder program at a cell: server, robot program, takt-modbus and ClassicLadder.
class PlcRun {
 public:
  static bool available() { return exists("/usr/bin/halrun") && exists("/usr/bin/mb2hal"); }
  /// `program`: of config/plc, with its mapping PROGRAM_modbus.yaml; `places`: parameters of the robot's program.
  PlcRun(const std::filesystem::path& scenario, const std::string& program,
         const std::vector<std::string>& places)
      : cell(scenario), program_(program), places_(places) {}
  ~PlcRun() {
    if (ladder == nullptr || !exists(folder / "stop.pipe")) return;
    ChildProcess stop({folder / "stop.sh"});
    stop.wait();
    ladder->wait();
  }
  void start() {
    const std::filesystem::path plc = kConfig / "plc";
    ChildProcess make({"/usr/bin/python3", "-B", plc / "ladder.py", plc / (program_ + ".ladder"),
                       folder.path(), "--port", std::to_string(test_port())});
    ASSERT_EQ(make.wait(), 0) << make.text;
    std::ifstream in(plc / (program_ + "_modbus.yaml"));
    std::string mapping((std::istreambuf_iterator<char>(in)), {});
    for (const char* key : {"takt_modbus: 1\n", "port: 5020\n"})
      mapping.erase(mapping.find(key), std::string(key).size());
    std::vector<std::string> arguments{plc / "carry.lua", "--pace", "realtime"};
    for (const std::string& place : places_) arguments.insert(arguments.end(), {"--set", place});
    robot = std::make_unique<ChildProcess>(cell.command("takt-controller", arguments));
    gateway = std::make_unique<ChildProcess>(cell.gateway(mapping, {"--start"}));
    ASSERT_TRUE(gateway->wait_for_output("Listens")) << gateway->text;
    ladder = std::make_unique<ChildProcess>(std::vector<std::string>{folder / "run.sh"});
    ASSERT_TRUE(ladder->wait_for_output("The PLC runs")) << ladder->text;
  }
  std::string texts() const { return ladder->text + gateway->text + robot->text; }

  Cell cell;
  TemporaryDirectory folder;
  std::unique_ptr<ChildProcess> robot, gateway, ladder;

 private:
  std::string program_;
  std::vector<std::string> places_;
};

TEST(ModbusPlc, ALadderProgramRunsALine) {
  if (!PlcRun::available()) GTEST_SKIP() << "needs Debian's linuxcnc-uspace";
  PlcRun run(kConfig / "scenarios" / "line.yaml", "line",
             {"a_x_m=0.1", "a_y_m=0", "b_x_m=0.55", "b_y_m=0", "height_m=0.255", "lift_m=0.12"});
  ASSERT_NO_FATAL_FAILURE(run.start());
  for (int i = 1; i <= 3; ++i)
    ASSERT_TRUE(run.cell.client()
                    .wait_for(
                        topics::state, [&](const State& s) { return s.signals("Outlet").at("removed") >= i; },
                        Seconds{120.0})
                    .has_value())
        << i << "\n"
        << run.texts();
  // What has entered is on its way.
  const auto state = run.cell.client().wait_for(
      topics::state, [](const State&) { return true; }, Seconds{60.0});
  ASSERT_TRUE(state.has_value());
  EXPECT_LE(state->signals("Feeder").at("released") - state->signals("Outlet").at("removed"), 8.0);
}

TEST(ModbusPlc, ALadderProgramIsTheOnlySequencerOfARobotAndItsGripper) {
  if (!PlcRun::available()) GTEST_SKIP() << "needs Debian's linuxcnc-uspace";
  PlcRun run(kConfig / "plc" / "carry.yaml", "carry", {});
  ASSERT_NO_FATAL_FAILURE(run.start());
  Cell& cell = run.cell;
  ChildProcess &ladder = *run.ladder, &gateway = *run.gateway;
  const TemporaryDirectory& folder = run.folder;
  constexpr int kCarries = 4;
  std::vector<double> places;
  for (int i = 1; i <= kCarries; ++i) {
    const auto state = cell.client().wait_for(
        topics::state, [&](const State& s) { return s.signals("FromPlc").at("carries") >= i; },
        Seconds{120.0});
    ASSERT_TRUE(state.has_value()) << i << "\n" << run.texts();
    const auto& block = state->component("Block").position;
    EXPECT_NEAR(block.x, -0.22, 0.001) << i;
    EXPECT_NEAR(block.z, 0.7, 0.001) << i;
    places.push_back(block.y);
  }
  for (int i = 0; i < kCarries; ++i)
    EXPECT_NEAR(places[static_cast<std::size_t>(i)], i % 2 == 0 ? 0.15 : -0.05, 0.001) << i;
  // The PLC stops with a Part in the gripper: the robot gets no more orders, and the gripper stays closed.
  ASSERT_TRUE(cell.client().wait_for(
      topics::state, [](const State& s) { return !s.part_present("Gripper").empty(); }, Seconds{120.0}));
  ChildProcess stop({folder / "stop.sh"});
  EXPECT_EQ(stop.wait(), 0) << stop.text;
  ladder.wait();
  EXPECT_TRUE(gateway.wait_for_output("is silent; the substitute values apply")) << gateway.text;
  const auto stopped = cell.client().wait_for(
      topics::state,
      [](const State& s) {
        return s.signals("FromPlc").at("to_a") == 0.0 && s.signals("FromPlc").at("to_b") == 0.0;
      },
      Seconds{60.0});
  ASSERT_TRUE(stopped.has_value());
  EXPECT_TRUE(stopped->gripper("Gripper").closed);
  EXPECT_EQ(stopped->part_present("Gripper"), "Block");
  gateway.signal(SIGTERM);
  EXPECT_EQ(gateway.wait(), 0) << gateway.text;
}

}  // namespace
}  // namespace takt::test::modbus
