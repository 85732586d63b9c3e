// Primary interface, external control and dashboard: bytes and lines as the drivers read and write them.
#include <gtest/gtest.h>

#include <map>

#include "client_lib/gateway/rtde/big_endian.h"
#include "client_lib/gateway/rtde/dashboard.h"
#include "client_lib/gateway/rtde/external_control.h"
#include "client_lib/gateway/rtde/primary.h"
#include "client_lib/gateway/rtde/realtime.h"

namespace {

using namespace takt::rtde;

TEST(Primary, TheVersionMessageHasItsLayout) {
  const std::string message = version_message(7, 5, 21, 3);
  Reader reader(message);
  EXPECT_EQ(reader.i32(), static_cast<std::int32_t>(message.size()));
  EXPECT_EQ(reader.u8(), 20);
  EXPECT_EQ(reader.u64(), 7U);
  reader.u8();
  EXPECT_EQ(reader.u8(), 3);
  EXPECT_EQ(reader.text(reader.u8()), "URControl");
  EXPECT_EQ(reader.u8(), 5);
  EXPECT_EQ(reader.u8(), 21);
  EXPECT_EQ(reader.i32(), 3);
  reader.i32();
  EXPECT_FALSE(reader.failed());
}

TEST(Primary, SizesOfSubPackagesAreThoseOfTheInterface) {
  // Sums of the fields that Universal_Robots_Client_Library reads, with heads of five bytes: RobotModeData 47, MasterboardData 75, KinematicsInfo 225, ConfigurationData 445.
  EXPECT_EQ(robot_mode_data({}).size(), 47U);
  EXPECT_EQ(masterboard_data({}).size(), 75U);
  EXPECT_EQ(kinematics_info({}).size(), 225U);
  EXPECT_EQ(configuration_data({}).size(), 445U);
  const std::string state = robot_state(robot_mode_data({}) + kinematics_info({}));
  Reader reader(state);
  EXPECT_EQ(reader.i32(), 5 + 47 + 225);
  EXPECT_EQ(reader.u8(), 16);
  EXPECT_EQ(reader.i32(), 47);
  EXPECT_EQ(reader.u8(), 0);
}

double number_at(const std::string& bytes, std::size_t at) {
  return Reader(std::string_view(bytes).substr(at)).f64();
}

TEST(Primary, SubPackagesOfTheOutputsHaveTheLayoutThatReadersExpect) {
  // Sizes and places of the formats of SintefManufacturing/python-urx, ursecmon.py, and of the Client Interface guide.
  Table outputs = output_table();
  const std::array<double, 6> q{1.0, 2.0, 3.0, 4.0, 5.0, 6.0};
  outputs.set_vector("target_q", q);
  outputs["joint_mode"].whole = {250, 251, 252, 253, 254, 255};
  const std::string joints = joint_data(outputs);
  ASSERT_EQ(joints.size(), 251U);
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(number_at(joints, 5 + 41 * i + 8), q.at(i));
    EXPECT_EQ(static_cast<unsigned char>(joints[5 + 41 * i + 40]), 250 + i);
  }
  outputs.set("tool_analog_input1", 2.5);
  outputs.set_whole("tool_output_voltage", 24);
  outputs.set_whole("tool_mode", 253);
  const std::string tool = tool_data(outputs);
  ASSERT_EQ(tool.size(), 37U);
  EXPECT_EQ(number_at(tool, 15), 2.5);
  EXPECT_EQ(tool[27], 24);
  EXPECT_EQ(static_cast<unsigned char>(tool[36]), 253);
  outputs.set_vector("actual_TCP_pose", q);
  outputs.set_vector("tcp_offset", std::array{7.0});
  outputs.set_vector("actual_TCP_force", q);
  const std::string cartesian = cartesian_info(outputs), force = force_mode_data(outputs);
  ASSERT_EQ(cartesian.size(), 101U);
  EXPECT_EQ(number_at(cartesian, 45), 6.0);
  EXPECT_EQ(number_at(cartesian, 53), 7.0);
  ASSERT_EQ(force.size(), 61U);
  EXPECT_EQ(number_at(force, 45), 6.0);
  EXPECT_EQ(additional_info(true).size(), 9U);
  EXPECT_EQ(tool_mode_info(outputs).size(), 8U);
}

TEST(RealTime, PackagesHaveTheSizesAndPlacesOfTheirVersions) {
  // Sizes: jhu-saw/sawUniversalRobot and roboticslibrary/rl. Places: the guide's table, as many programs have them built in.
  Table outputs = output_table();
  const std::map<std::size_t, const char*> places{{4, "timestamp"},
                                                  {12, "target_q"},
                                                  {252, "actual_q"},
                                                  {300, "actual_qd"},
                                                  {444, "actual_TCP_pose"},
                                                  {492, "actual_TCP_speed"},
                                                  {540, "actual_TCP_force"},
                                                  {588, "target_TCP_pose"},
                                                  {684, "actual_digital_input_bits"},
                                                  {756, "robot_mode"},
                                                  {764, "joint_mode"},
                                                  {812, "safety_mode"},
                                                  {940, "speed_scaling"},
                                                  {1044, "actual_digital_output_bits"},
                                                  {1052, "runtime_state"},
                                                  {1108, "safety_status"},
                                                  {1140, "payload"}};
  double next = 1.0;
  for (const auto& [at, name] : places) {
    outputs[name].real[0] = next;
    outputs[name].whole[0] = static_cast<std::int64_t>(next++);
  }
  for (const auto& [minor, size] : {std::pair{0, 1108U}, {4, 1116U}, {9, 1140U}, {10, 1220U}, {21, 1220U}}) {
    const std::string package = realtime_package(outputs, minor);
    ASSERT_EQ(package.size(), size) << minor;
    EXPECT_EQ(Reader(package).i32(), static_cast<std::int32_t>(size));
    double expected = 1.0;
    for (const auto& [at, name] : places) {
      if (at < size) {
        EXPECT_EQ(number_at(package, at), expected) << name;
      }
      ++expected;
    }
  }
}

TEST(Primary, KinematicsAndConfigurationHaveTheirOwnOrders) {
  DhParameters dh;
  dh.theta[0] = 1.0;
  dh.a[0] = 2.0;
  dh.d[0] = 3.0;
  dh.alpha[0] = 4.0;
  const std::string kinematics = kinematics_info(dh);
  for (std::size_t i = 0; i < 4; ++i)
    EXPECT_EQ(number_at(kinematics, 5 + 24 + 48 * i), 1.0 + static_cast<double>(i)) << i;
  ConfigurationData configuration;
  configuration.dh = dh;
  const std::string bytes = configuration_data(configuration);
  for (std::size_t i = 0; i < 4; ++i)
    EXPECT_EQ(number_at(bytes, 5 + 96 + 96 + 40 + 48 * i), i < 3 ? 2.0 + static_cast<double>(i) : 1.0) << i;
}

std::string numbers(std::initializer_list<std::int32_t> values, std::size_t count) {
  std::string bytes;
  for (const std::int32_t value : values) append(bytes, value);
  bytes.resize(4 * count, '\0');
  return bytes;
}

TEST(ExternalControl, MessagesAreScaled) {
  const ReverseMessage reverse = reverse_message(numbers({20, 1000000, -1570000, 0, 0, 0, 250000, 1}, 8));
  EXPECT_EQ(reverse.timeout_ms, 20);
  EXPECT_EQ(reverse.values[0], 1.0);
  EXPECT_DOUBLE_EQ(reverse.values[1], -1.57);
  EXPECT_EQ(reverse.values[5], 0.25);
  EXPECT_EQ(reverse.mode, ControlMode::servoj);
  const TrajectoryPoint point = trajectory_point(
      numbers({1000000, 0, 0, 0, 0, 0, 2000000, 0, 0, 0, 0, 0, 3000000, 0, 0, 0, 0, 0, 500000, 2, 51}, 21));
  EXPECT_EQ(point.target[0], 1.0);
  EXPECT_EQ(point.second[0], 2.0);
  EXPECT_EQ(point.third[0], 3.0);
  EXPECT_EQ(point.time_s, 0.5);
  EXPECT_EQ(point.spline_type, 2);
  EXPECT_EQ(point.type, PointType::spline);
  const ScriptCommand command = script_command(numbers({1, 1500000, 100000}, 28));
  EXPECT_EQ(command.type, ScriptCommandType::set_payload);
  EXPECT_EQ(command.values[0], 1.5);
  EXPECT_DOUBLE_EQ(command.values[1], 0.1);
}

TEST(ExternalControl, StreamsAreChoppedAtAnyByte) {
  const std::string first = numbers({1}, 8), second = numbers({2}, 8);
  for (std::size_t cut = 0; cut <= 64; ++cut) {
    Chopper chopper(ReverseMessage::kBytes);
    std::vector<std::int32_t> found;
    for (const std::string& part : {(first + second).substr(0, cut), (first + second).substr(cut)}) {
      chopper.add(part);
      while (const auto message = chopper.next()) found.push_back(reverse_message(*message).timeout_ms);
    }
    ASSERT_EQ(found, (std::vector<std::int32_t>{1, 2})) << "cut at byte " << cut;
  }
}

class DashboardPeer final : public DashboardRobot {
 public:
  std::string mode = "POWER_OFF", program, logged;
  std::string software_version() const override { return "5.21.0"; }
  std::string model() const override { return "UR10e"; }
  std::string serial_number() const override { return "20000000001"; }
  std::string robot_mode() const override { return mode; }
  std::string safety_mode() const override { return "NORMAL"; }
  std::string program_state() const override { return "STOPPED"; }
  std::string loaded_program() const override { return program; }
  bool in_remote_control() const override { return true; }
  bool power_on(std::string&) override { return !(mode = "IDLE").empty(); }
  bool power_off(std::string&) override { return !(mode = "POWER_OFF").empty(); }
  bool release_brakes(std::string&) override { return !(mode = "RUNNING").empty(); }
  bool unlock_protective_stop(std::string& reason) override {
    reason = "Cannot unlock";
    return false;
  }
  bool load_program(const std::string& name) override {
    if (name != "known.urp") return false;
    program = name;
    return true;
  }
  bool play(const std::string&) override { return !program.empty(); }
  bool pause() override { return false; }
  bool stop() override { return true; }
  void close_popup() override { ++closed_popups; }
  void log(const std::string& text) override { logged = text; }
  std::optional<std::string> write_report(std::string& reason) override {
    reason = "no directory";
    return report;
  }
  std::optional<std::string> report{};
  int closed_popups = 0;
};

TEST(Dashboard, RepliesAreThoseOfTheServer) {
  DashboardPeer robot;
  DashboardState state;
  const auto ask = [&](const char* line) { return dashboard_reply(line, "127.0.0.1", robot, state).line; };
  // Four numbers, as clients look for them: \d+.\d+.\d+.\d+ in ur_rtde.
  EXPECT_EQ(ask("PolyscopeVersion\r"), "URSoftware 5.21.0.0 (Jan 01 2024)");
  EXPECT_EQ(ask("version"), "5.21.0.0");
  EXPECT_EQ(ask("setUserRole operator"), "Setting user role: operator");
  EXPECT_EQ(ask("getUserRole"), "OPERATOR");
  EXPECT_EQ(ask("robotmode"), "Robotmode: POWER_OFF");
  EXPECT_EQ(ask("power on"), "Powering on");
  EXPECT_EQ(ask("robotmode"), "Robotmode: IDLE");
  EXPECT_EQ(ask("brake release"), "Brake releasing");
  EXPECT_EQ(ask("play"), "Failed to execute: play");
  EXPECT_EQ(ask("generate flight report controller"), "Error: no directory");
  robot.report = "reports/Robot1_1.txt";
  EXPECT_EQ(ask("generate flight report"), "Flight Report generated with id: reports/Robot1_1.txt");
  EXPECT_EQ(ask("generate support file /etc"), "Completed successfully: reports/Robot1_1.txt");
  EXPECT_EQ(ask("load unknown.urp"), "File not found: unknown.urp");
  EXPECT_EQ(ask("load known.urp"), "Loading program: known.urp");
  EXPECT_EQ(ask("get loaded program"), "Loaded program: known.urp");
  EXPECT_EQ(ask("programState"), "STOPPED known.urp");
  EXPECT_EQ(ask("play"), "Starting program");
  EXPECT_EQ(ask("unlock protective stop"), "Cannot unlock");
  EXPECT_EQ(ask("set operational mode AUTOMATIC"), "Operational mode AUTOMATIC is set");
  EXPECT_EQ(ask("get operational mode"), "AUTOMATIC");
  EXPECT_EQ(ask("addToLog a text"), "Added log message");
  EXPECT_EQ(robot.logged, "dashboard: a text");
  EXPECT_EQ(ask("close popup"), "closing popup");
  EXPECT_EQ(robot.closed_popups, 1);
  EXPECT_EQ(ask("load installation other.installation"), "File not found: other.installation");
  EXPECT_EQ(ask("nonsense"), "could not understand: 'nonsense'");
  EXPECT_TRUE(dashboard_reply("quit", "", robot, state).quit);
  EXPECT_TRUE(dashboard_reply("shutdown", "", robot, state).quit);
}

}  // namespace
