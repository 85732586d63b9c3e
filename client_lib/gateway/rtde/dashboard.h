#pragma once
// Lines of the dashboard server (TCP 29999): the reply to one line. Commands act on a DashboardRobot.
#include <optional>
#include <string>
#include <string_view>

namespace takt::rtde {

/// What the dashboard shows and commands.
class DashboardRobot {
 public:
  virtual ~DashboardRobot() = default;
  virtual std::string software_version() const = 0;  ///< e.g. 5.16.0
  virtual std::string model() const = 0;
  virtual std::string serial_number() const = 0;
  virtual std::string robot_mode() const = 0;     ///< e.g. RUNNING
  virtual std::string safety_mode() const = 0;    ///< e.g. NORMAL
  virtual std::string program_state() const = 0;  ///< STOPPED, PLAYING, PAUSED
  virtual std::string loaded_program() const = 0;
  virtual bool in_remote_control() const = 0;
  /// False where the robot does not do it at present; then `reason` is the reply.
  virtual bool power_on(std::string& reason) = 0;
  virtual bool power_off(std::string& reason) = 0;
  virtual bool release_brakes(std::string& reason) = 0;
  virtual bool unlock_protective_stop(std::string& reason) = 0;
  virtual bool load_program(const std::string& name) = 0;
  virtual bool play(const std::string& dashboard_client) = 0;
  virtual bool pause() = 0;
  virtual bool stop() = 0;
  virtual void close_popup() = 0;
  virtual void log(const std::string& text) = 0;
  /// Writes the newest log lines and all values to a file and returns its path; nothing where it may not, with the reason.
  virtual std::optional<std::string> write_report(std::string& reason) = 0;
};

struct DashboardReply {
  std::string line;  ///< without its end
  bool quit = false;
};

/// State of one robot's dashboard that outlives connections.
struct DashboardState {
  std::string operational_mode = "NONE", user_role = "PROGRAMMER";
};

inline constexpr std::string_view kDashboardGreeting = "Connected: Universal Robots Dashboard Server\n";

/// `client`: address of the peer, which may serve the program that `play` starts.
DashboardReply dashboard_reply(std::string_view line, const std::string& client, DashboardRobot& robot,
                               DashboardState& state);

}  // namespace takt::rtde
