#pragma once
// The external control program that drivers upload: connects to the driver's three sockets and does what the program's
// text does with their messages (Universal_Robots_Client_Library, resources/external_control.urscript).
#include <memory>

#include "client_lib/gateway/rtde/external_control.h"
#include "client_lib/tools/takt_ur/script_run.h"
#include "client_lib/tools/takt_ur/ur_controller.h"

namespace takt::ur {

class ExternalProgram final : public RunningProgram {
 public:
  ExternalProgram(UrController& controller, const urscript::Program& program);
  ~ExternalProgram() override;
  bool advance() override;
  bool awaits_driver() const override {
    return phase_ == Phase::controlled && !cleaning_ && !reverse_closed_ && reverse_.whole_messages() == 0;
  }

 private:
  using Socket = std::shared_ptr<gateway::Connection>;
  enum class Phase : std::uint8_t { connecting, controlled, stopping, following, ended };
  /// What happens when the points of an old trajectory are discarded and the robot is at rest.
  enum class AfterCleanup : std::uint8_t { nothing, answer_cancel, start };

  void connect();
  void connected(Socket& socket, Socket connection, const char* name);
  void listen();
  void close_sockets();
  void handle(const rtde::ReverseMessage& message);
  void change_mode(rtde::ControlMode mode);
  void trajectory_action(const rtde::ReverseMessage& message);
  void begin_cleanup(AfterCleanup then);
  bool clean_up();
  void start_trajectory();
  void advance_trajectory();
  void take_point(const rtde::TrajectoryPoint& point, bool last);
  void offer_successor();
  /// Of a point that is no spline, from the joint positions where it begins; nothing for an unknown type.
  std::optional<Move> move_of(const rtde::TrajectoryPoint& point, bool last, const Vector6& near) const;
  void take_spline(const rtde::TrajectoryPoint& point, bool last);
  void finish_trajectory(rtde::TrajectoryResult result);
  void answer_trajectory(rtde::TrajectoryResult result);
  void script_command(const rtde::ScriptCommand& command);
  void watch_tool_contact();
  void freedrive_action(std::int32_t action);
  bool servo_set_point(const Vector6& q);
  void exit_by(const std::string& why);

  UrController& controller_;
  const urscript::ExternalControl external_;
  ScriptRun rest_;  ///< the statements behind the control loop
  Socket trajectory_socket_, command_socket_, reverse_socket_;
  std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
  Phase phase_ = Phase::connecting;

  rtde::Chopper reverse_{rtde::ReverseMessage::kBytes}, points_{rtde::TrajectoryPoint::kBytes},
      commands_{rtde::ScriptCommand::kBytes};
  rtde::ControlMode mode_ = rtde::ControlMode::uninitialized;
  bool reverse_closed_ = false;
  std::uint64_t deadline_cycle_ = 0;  ///< of the next message; 0: none
  bool ignores_commands_ = false;     ///< after a set-point that is too far
  bool torque_mode_ = false;          ///< the controller's version has it
  Vector6 torques_{};

  // The trajectory.
  bool runs_ = false, streaming_ = false, was_streaming_ = false, first_point_ = true, moving_ = false;
  bool finishing_ = false;
  rtde::TrajectoryResult result_ = rtde::TrajectoryResult::success;
  std::int64_t points_left_ = 0;
  std::optional<rtde::TrajectoryPoint> next_point_;  ///< read, but not begun
  std::uint64_t waiting_since_ = 0;
  Vector6 spline_qd_{}, spline_qdd_{};
  std::int32_t announced_ = 0;  ///< points of the trajectory that starts after the cleanup
  bool stream_announced_ = false;

  bool cleaning_ = false;
  std::uint64_t cleaning_since_ = 0;
  AfterCleanup after_cleanup_ = AfterCleanup::nothing;

  bool watches_contact_ = false, in_freedrive_ = false;
};

/// A program that a driver serves (URCap External Control): asks for its text, and runs it.
class RequestedProgram final : public RunningProgram {
 public:
  RequestedProgram(UrController& controller, std::string name, const std::string& host, std::uint16_t port);
  ~RequestedProgram() override;
  bool advance() override;
  bool awaits_driver() const override { return program_ != nullptr && program_->awaits_driver(); }

 private:
  UrController& controller_;
  std::shared_ptr<gateway::Connection> connection_;
  std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
  std::string text_;
  bool complete_ = false, failed_ = false;
  std::uint64_t deadline_cycle_, newest_cycle_ = 0;
  std::unique_ptr<RunningProgram> program_;
};

}  // namespace takt::ur
