#pragma once
// The controller that takt-ur shows: power, safety, programs, motion, inputs and outputs of one robot. It knows no
// sockets but those that an external control program opens. Everything runs in the thread of the event loop.
//
// Time passes in cycles of 2 ms: of wall time, or of the cell's simulated time (mapping).
#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "client_lib/gateway/event_loop.h"
#include "client_lib/gateway/force_sensor.h"
#include "client_lib/gateway/robot_cell.h"
#include "client_lib/gateway/rtde/dashboard.h"
#include "client_lib/gateway/rtde/primary.h"
#include "client_lib/gateway/rtde/server_session.h"
#include "client_lib/gateway/ur/force_mode.h"
#include "client_lib/gateway/ur/motion.h"
#include "client_lib/gateway/ur/robot_dynamics.h"
#include "client_lib/gateway/ur/robotiq.h"
#include "client_lib/gateway/urscript/script.h"
#include "client_lib/tools/takt_ur/modbus_signals.h"
#include "client_lib/tools/takt_ur/ur_mapping.h"

namespace takt::ur {

enum class RobotMode : std::int32_t { power_off = 3, power_on = 4, idle = 5, running = 7 };
enum class SafetyMode : std::uint8_t { normal = 1, protective_stop = 3 };

class UrController;

/// What runs on the controller.
class RunningProgram {
 public:
  explicit RunningProgram(std::string name) : name_(std::move(name)) {}
  virtual ~RunningProgram() = default;
  RunningProgram(const RunningProgram&) = delete;
  RunningProgram& operator=(const RunningProgram&) = delete;
  const std::string& name() const { return name_; }
  /// One cycle. False when the program has ended. Throws urscript::ScriptError, which ends it with a message.
  virtual bool advance() = 0;
  /// Answers a line of the interpreter interface, without an end of line.
  virtual std::string interpret(std::string_view line);
  /// A driver commands it, and has sent nothing since the last cycle.
  virtual bool awaits_driver() const { return false; }

 private:
  std::string name_;
};

struct Payload {
  double mass_kg = 0.0;
  std::array<double, 3> center_of_gravity_m{};
  Vector6 inertia_kg_m2{};
};

class UrController final : public rtde::DashboardRobot {
 public:
  static constexpr double kCycle_s = 0.002;

  /// All outlive it. Throws ScenarioError where the robot has not six revolute joints.
  UrController(gateway::EventLoop& loop, gateway::RobotCell& link, const UrMapping& mapping);
  ~UrController() override;
  UrController(const UrController&) = delete;
  UrController& operator=(const UrController&) = delete;

  /// One cycle.
  void advance();
  std::uint64_t cycle() const { return cycle_; }
  /// The program needs a message of its driver for the next cycle.
  bool awaits_driver() const {
    return program_ != nullptr && !paused_ && robot_mode_ == RobotMode::running && program_->awaits_driver();
  }
  /// Seconds since the controller started; drivers wait for 40 s, which have passed at the start.
  double time_s() const { return 100.0 + kCycle_s * static_cast<double>(cycle_); }
  std::uint64_t timestamp_us() const { return static_cast<std::uint64_t>(1e6 * time_s()); }

  // --- for servers ---
  const rtde::Table& outputs() const { return outputs_; }
  const rtde::Table& inputs() const { return inputs_; }
  void take_inputs(const std::vector<rtde::ServerSession::Written>& written);
  /// A program or line from the primary interface.
  void take_script(const std::string& script);
  /// Answers a line from the interpreter interface.
  std::string interpret(std::string_view line);
  std::string primary_version() const;
  std::string primary_state() const;
  /// Receives each message for all primary clients.
  std::function<void(const std::string&)> on_primary_message = [](const std::string&) {};

  // --- for programs ---
  gateway::EventLoop& loop() { return loop_; }
  ModbusSignals& modbus() { return modbus_; }
  Motion& motion() { return motion_; }
  const RobotDynamics& dynamics() const { return dynamics_; }
  const UrMapping& mapping() const { return mapping_; }
  /// Pose in the protocol's base <-> in the robot's.
  Pose from_base(const Pose& X_BT) const { return mapping_.base_frame * X_BT; }
  Pose to_base(const Pose& X_RT) const { return mapping_.base_frame.inverse() * X_RT; }
  /// Turns a twist or wrench between the axes of the two bases.
  Vector6 turned(const Vector6& values, bool to_protocol) const;
  void text(const std::string& message);
  /// Popups that a client of the dashboard has closed.
  std::uint64_t closed_popups() const { return closed_popups_; }
  void error_code(int code, rtde::ReportLevel level, const std::string& message);
  void protective_stop(const std::string& why);
  /// A protective stop where its end is out of reach.
  void begin(const Move& move);
  /// The successor of a move that has a blend radius. False where the blend is skipped, which is reported.
  bool blend_into(const Move& next);
  void set_digital_output(int number, bool value);  ///< 0..7 standard, 8..15 configurable, 16..17 tool
  void set_analog_output(int number, double fraction);
  void set_tool_voltage(int volts) { tool_voltage_ = volts; }
  /// The present force becomes zero, as on the robot.
  void set_payload(const Payload& payload);
  void set_tcp(const Vector6& offset);
  void set_gravity(const std::array<double, 3>& gravity) { gravity_ = gravity; }
  void zero_force_sensor();
  /// A force at the TCP is known: there is a sensor, a tool with contact forces, or a sensor of the driver.
  bool measures_force() const;
  /// That force is without the weight of payload().
  bool senses_without_payload() const { return force_sensor_ || driver_sensor_.enabled; }
  /// The force of a sensor that the driver reads (RTDE input external_force_torque), in the flange's axes about `origin_F`.
  struct DriverSensor {
    bool enabled = false;
    Vec3 origin_F = Vec3::Zero(), center_of_gravity_F = Vec3::Zero();
    double mass_kg = 0.0;
  };
  /// A program that has no watchdog gets one that pauses it where the input is written less often than at 10 Hz.
  void set_driver_sensor(const DriverSensor& sensor);
  /// Force mode, until end_force_mode() or the program's end. Throws urscript::ScriptError for invalid options, and where
  /// nothing measures a force.
  void start_force_mode(const ForceModeOptions& options);
  /// Compliant in axes of a frame in the robot's base, without a force of its own; where nothing measures a force, the robot
  /// stands.
  static constexpr std::array<bool, 6> kAllAxes{true, true, true, true, true, true};
  void start_freedrive(const std::array<bool, 6>& axes = kAllAxes, const Pose& X_RK = {});
  void end_force_mode();
  /// Torques of the joints for this cycle, besides those that carry the robot's own weight. Without others in the next cycle
  /// the robot brakes. Returns why the robot cannot, or nothing.
  [[nodiscard]] std::string command_torques(const Vector6& torques);
  /// Of the next force_mode() in a URScript program.
  ForceModeOptions& next_force_mode() { return next_force_mode_; }
  void write_output_double(int number, double value);
  void write_output_int(int number, std::int64_t value);
  void write_output_bit(int number, bool value);
  const Payload& payload() const { return payload_; }
  const std::array<double, 3>& gravity() const { return gravity_; }
  /// Internal bits 0..31 of programs, which outlast them.
  bool flag(int number) const { return (flags_ >> static_cast<unsigned>(number) & 1U) != 0; }
  void set_flag(int number, bool value);
  /// No target velocity for half a second.
  bool is_steady() const { return cycle_ >= moved_cycle_ + kSteadyCycles; }
  const Vector6& tcp_offset() const { return tcp_offset_; }
  /// Pauses or ends programs while clients write an RTDE input less often; 0 s: ends the watch.
  void set_watchdog(const std::string& input, double longest_s, bool ends);
  /// So many cycles ago, or as many as are known.
  const Vector6& position_before(std::size_t cycles) const;
  /// Cycles for which at least the mapping's force has acted against a direction in the protocol's base, or in any where it
  /// is 0.
  int contact_cycles(const Vec3& direction) const;
  const Motion& motion() const { return motion_; }
  const Vector6& actual_position() const { return actual_q_; }
  const Vector6& actual_velocity() const { return actual_qd_; }
  const Vector6& actual_effort() const { return actual_effort_; }
  const Vector6& target_position() const { return target_q_; }
  const Vector6& target_velocity() const { return target_qd_; }
  /// Bits: 0..7 standard, 8..15 configurable, 16..17 tool.
  std::uint64_t digital_inputs() const { return digital_inputs_; }
  std::uint64_t digital_outputs() const { return digital_outputs_; }
  /// 0..1 standard, 2..3 tool.
  double analog_input(int number) const {
    const auto n = static_cast<std::size_t>(number);
    return n < 2 ? analog_inputs_.at(n) : tool_analog_inputs_.at(n - 2);
  }
  double analog_output(int number) const { return analog_outputs_.at(static_cast<std::size_t>(number)); }
  /// Contact force at the TCP in the protocol's base: N, N m; zero without a tool.
  const Vector6& contact_force() const { return contact_force_; }
  /// A robot that is not paused, with power, in a cell that plays.
  bool can_move() const;

  // --- dashboard ---
  std::string software_version() const override { return mapping_.version; }
  std::string model() const override { return mapping_.model; }
  std::string serial_number() const override { return mapping_.serial_number; }
  std::string robot_mode() const override;
  std::string safety_mode() const override;
  std::string program_state() const override;
  std::string loaded_program() const override { return loaded_; }
  bool in_remote_control() const override { return mapping_.remote_control; }
  bool power_on(std::string& reason) override;
  bool power_off(std::string& reason) override;
  bool release_brakes(std::string& reason) override;
  bool unlock_protective_stop(std::string& reason) override;
  bool load_program(const std::string& name) override;
  bool play(const std::string& dashboard_client) override;
  bool pause() override;
  bool stop() override;
  void close_popup() override { ++closed_popups_; }
  void log(const std::string& text) override;
  std::optional<std::string> write_report(std::string& reason) override;

  // --- Robotiq's URCap ---
  /// Answers a line of its server; the command goes to the gripper of the mapping.
  std::string robotiq_answer(std::string_view line);

 private:
  bool read_cell();
  void measure_force();
  Vector6 summed_contact_force(const Pose& X_RT) const;
  Wrench sensor_wrench_F() const;
  Wrench weight_F(const Pose& X_RF, double mass_kg, const Vec3& center_F) const;
  bool follow_force();
  /// False without torques for this cycle.
  bool apply_torques();
  void restart_force_mode(const Vector6& q);
  void change_power();
  void advance_program();
  bool advance_secondary(RunningProgram& program);
  /// False where a client has been silent for too long.
  bool check_watchdogs();
  void drive();
  void fill_outputs();
  void write_element(const std::string& name, double value);
  void start(std::unique_ptr<RunningProgram> program);
  void run(const std::string& text);
  void run_secondary(urscript::Program program);
  void end_program(const char* why);
  void fail(const std::string& name, const urscript::ScriptError& error);
  const takt_msgs::msg::RobotDescription& description() const;
  ArmModel protocol_arm() const;
  Vector6 vector(const std::vector<double>& values) const;

  gateway::EventLoop& loop_;
  gateway::RobotCell& link_;
  const UrMapping& mapping_;
  const ArmModel arm_;  ///< with the protocol's joints
  const RobotDynamics dynamics_;
  const rtde::DhParameters dh_;
  Motion motion_;
  rtde::Table outputs_, inputs_;
  std::vector<std::uint64_t> written_cycles_;  ///< one for each input
  std::uint64_t cycle_ = 0;

  RobotMode robot_mode_ = RobotMode::running, wanted_mode_ = RobotMode::running;
  std::uint64_t mode_since_ = 0;
  SafetyMode safety_mode_ = SafetyMode::normal;
  std::unique_ptr<RunningProgram> program_;
  std::vector<std::unique_ptr<RunningProgram>> secondary_;
  bool paused_ = false;
  std::string loaded_;
  bool drives_ = false;  ///< set-points are sent
  std::uint64_t at_rest_since_ = 0;
  static constexpr std::uint64_t kSteadyCycles = 250;
  std::uint64_t moved_cycle_ = 0;  ///< the newest one with a target velocity
  std::uint32_t flags_ = 0;
  std::uint64_t closed_popups_ = 0;

  std::shared_ptr<const State> state_;
  Vector6 actual_q_{}, actual_qd_{}, actual_effort_{};
  Vector6 target_q_{}, target_qd_{};  ///< of the robot: the motion's, or in force mode beside it
  Vector6 tcp_offset_{}, contact_force_{}, force_bias_{}, measured_force_{}, raw_wrench_{};
  std::optional<gateway::ForceSensor> force_sensor_;
  DriverSensor driver_sensor_;
  Wrench sensed_F_, sensor_zero_F_;  ///< without the payload; the zero of the sensor
  std::optional<ForceMode> force_mode_;
  ForceModeOptions next_force_mode_;
  struct Torques {
    Vector6 values{};
    std::uint64_t cycle = 0;
  };
  std::optional<Torques> torques_;
  std::uint64_t digital_outputs_ = 0, digital_inputs_ = 0;
  std::array<double, 2> analog_outputs_{}, analog_inputs_{}, tool_analog_inputs_{};
  struct Past {
    Vector6 position;
    Vec3 force;
  };
  static constexpr std::size_t kHistory = 501;
  std::vector<Past> history_;  ///< a ring: of cycle c at c % kHistory
  struct Watchdog {
    std::string input;
    std::uint64_t longest_cycles = 0, begun_cycle = 0;
    bool ends = false, of_sensor = false;  ///< of_sensor: it came with the sensor
  };
  std::vector<Watchdog> watchdogs_;
  std::deque<std::string> log_;  ///< the newest lines
  int reports_ = 0;              ///< written
  RobotiqGripper robotiq_;
  ModbusSignals modbus_{loop_, kCycle_s};
  double speed_slider_ = 1.0;
  int tool_voltage_ = 0;
  Payload payload_;
  std::array<double, 3> gravity_{0.0, 0.0, 9.82};
};

}  // namespace takt::ur
