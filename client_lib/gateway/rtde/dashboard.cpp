#include "client_lib/gateway/rtde/dashboard.h"

#include <algorithm>
#include <functional>
#include <initializer_list>
#include <map>
#include <optional>

#include "idl/common/text.h"

namespace takt::rtde {
namespace {

constexpr std::string_view kInstallation = "default.installation";

/// What follows the command `word` and a blank; empty if the line is another command.
std::optional<std::string> argument(std::string_view line, std::string_view word) {
  if (line == word) return std::string();
  if (line.size() <= word.size() || line.substr(0, word.size()) != word || line[word.size()] != ' ')
    return std::nullopt;
  return std::string(line.substr(word.size() + 1));
}

std::string flag(bool value) {
  return value ? "true" : "false";
}

/// With the number of the build, which clients expect.
std::string full_version(const DashboardRobot& robot) {
  const std::string version = robot.software_version();
  return std::count(version.begin(), version.end(), '.') == 2 ? version + ".0" : version;
}

/// The allowed word that this is, in either case; empty if it is another.
std::string one_of(std::initializer_list<const char*> allowed, std::string_view word) {
  for (const char* one : allowed)
    if (lower_text(one) == lower_text(word)) return one;
  return "";
}

}  // namespace

DashboardReply dashboard_reply(std::string_view line, const std::string& client, DashboardRobot& robot,
                               DashboardState& state) {
  while (!line.empty() && (line.back() == '\r' || line.back() == '\n' || line.back() == ' '))
    line.remove_suffix(1);
  std::string reason;
  const auto done = [&reason](bool ok, const char* said) { return DashboardReply{ok ? said : reason}; };
  const std::string program = robot.loaded_program().empty() ? "<unnamed>" : robot.loaded_program();

  if (line == "quit") return {"Disconnected", true};
  if (line == "PolyscopeVersion") return {"URSoftware " + full_version(robot) + " (Jan 01 2024)"};
  if (line == "version") return {full_version(robot)};
  if (line == "shutdown") {
    robot.power_off(reason);
    return {"Shutting down", true};
  }
  if (line == "get robot model") return {robot.model()};
  if (line == "get serial number") return {robot.serial_number()};
  if (line == "robotmode") return {"Robotmode: " + robot.robot_mode()};
  if (line == "safetymode") return {"Safetymode: " + robot.safety_mode()};
  if (line == "safetystatus") return {"Safetystatus: " + robot.safety_mode()};
  if (line == "programState") return {robot.program_state() + " " + program};
  if (line == "running") return {"Program running: " + flag(robot.program_state() == "PLAYING")};
  if (line == "is in remote control") return {flag(robot.in_remote_control())};
  if (line == "power on") return done(robot.power_on(reason), "Powering on");
  if (line == "power off") return done(robot.power_off(reason), "Powering off");
  if (line == "brake release") return done(robot.release_brakes(reason), "Brake releasing");
  if (line == "unlock protective stop")
    return done(robot.unlock_protective_stop(reason), "Protective stop releasing");
  if (line == "restart safety") return done(robot.power_off(reason), "Restarting safety");
  if (line == "close safety popup") return {"closing safety popup"};
  if (line == "close popup") {
    robot.close_popup();
    return {"closing popup"};
  }
  if (const auto text = argument(line, "popup")) {
    robot.log("popup: " + *text);
    return {"showing popup"};
  }
  if (const auto text = argument(line, "addToLog")) {
    robot.log("dashboard: " + *text);
    return {"Added log message"};
  }
  if (argument(line, "generate flight report")) {
    const auto file = robot.write_report(reason);
    return {file ? "Flight Report generated with id: " + *file : "Error: " + reason};
  }
  if (argument(line, "generate support file")) {  // the client does not choose where it is written
    const auto file = robot.write_report(reason);
    return {file ? "Completed successfully: " + *file : "Error: " + reason};
  }
  if (line == "saveLog") return {"Log saved to disk"};
  if (const auto name = argument(line, "load installation"))  // the mapping file is the one installation
    return {*name == kInstallation ? "Loading installation: " + *name : "File not found: " + *name};
  if (const auto name = argument(line, "load")) {
    if (!robot.load_program(*name)) return {"File not found: " + *name};
    return {"Loading program: " + *name};
  }
  if (line == "get loaded program")
    return {robot.loaded_program().empty() ? "No program loaded"
                                           : "Loaded program: " + robot.loaded_program()};
  if (line == "isProgramSaved") return {"true " + program};
  if (line == "play") return {robot.play(client) ? "Starting program" : "Failed to execute: play"};
  if (line == "pause") return {robot.pause() ? "Pausing program" : "Failed to execute: pause"};
  if (argument(line, "stop")) return {robot.stop() ? "Stopped" : "Failed to execute: stop"};
  if (line == "get operational mode") return {state.operational_mode};
  if (const auto mode = argument(line, "set operational mode")) {
    const std::string name = one_of({"AUTOMATIC", "MANUAL"}, *mode);
    if (name.empty()) return {"Failed setting operational mode: " + *mode};
    state.operational_mode = name;
    return {"Operational mode " + *mode + " is set"};
  }
  if (line == "clear operational mode") {
    state.operational_mode = "NONE";
    return {"No longer controlling the operational mode. Current operational mode: 'NONE'."};
  }
  if (line == "getUserRole") return {state.user_role};
  if (const auto role = argument(line, "setUserRole")) {
    const std::string name = one_of({"NONE", "PROGRAMMER", "OPERATOR", "LOCKED", "RESTRICTED"}, *role);
    if (name.empty()) return {"Failed setting user role: " + *role};
    state.user_role = name;
    return {"Setting user role: " + *role};
  }
  return {"could not understand: '" + std::string(line) + "'"};
}

}  // namespace takt::rtde
