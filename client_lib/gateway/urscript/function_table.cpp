#include <algorithm>
#include <array>
#include <map>

#include "client_lib/gateway/urscript/functions.h"

namespace takt::urscript {
namespace {

using enum Function::Kind;

constexpr std::string_view kTorques =
    "torque, friction_comp=True, viscous_scale=[0,0,0,0,0,0], coulomb_scale=[0,0,0,0,0,0]";
constexpr std::string_view kNoModbus = "modbus_add_signal with two signals is allowed";
constexpr std::string_view kNoRpc = "EtherNet/IP has no counterpart; sockets and XML-RPC are allowed";
constexpr std::string_view kNoConveyor =
    "conveyor tracking is not simulated; speedl and servoj follow a signal";
constexpr std::string_view kNoPower = "power and modes are commanded over the dashboard";
constexpr std::string_view kNoEffect =
    "accepted without an effect, since programs of PolyScope begin with it";
constexpr std::string_view kWithoutEffect = "accepted without an effect";
constexpr std::string_view kNoPath = "tool paths are not supported; movep runs each point";
constexpr std::string_view kNoOffset =
    "offsets of paths are not supported; servoj and speedl move beside a path";
constexpr std::string_view kNoOperator = "the pendant has no operator; a client writes an RTDE register";

constexpr Function kFunctions[] = {
    {"movej", "q, a=1.4, v=1.05, t=0, r=0", moves, "straight in joint space to joint positions or a pose"},
    {"movel", "pose, a=1.2, v=0.25, t=0, r=0", moves, "straight line of the TCP"},
    {"movep", "pose, a=1.2, v=0.25, r=0", moves, "line of the TCP at constant speed"},
    {"movec", "pose_via, pose_to, a=1.2, v=0.25, r=0, mode=0", moves, "arc of the TCP"},
    {"servoj", "q, a=0, v=0, t=0.002, lookahead_time=0.1, gain=300", moves,
     "follows joint positions for t seconds"},
    {"servoc", "pose, a=1.2, v=0.25, r=0", moves,
     "brings the TCP to a pose, or within r of it, without a stop there"},
    {"optimovej", "goal, a=0.3, v=0.3, r=0", moves,
     "movej with fractions of the largest acceleration and speed: 15 rad/s^2, 3 rad/s"},
    {"optimovel", "goal, a=0.3, v=0.3, r=0", moves, "movel; fractions of 1 m/s^2, 1 m/s"},
    {"speedj", "qd, a=1.4, t=0", moves, "joint speeds, for t seconds or until they are reached"},
    {"speedl", "xd, a=1.2, t=0, aRot=0", moves, "speed of the TCP, in the same way"},
    {"direct_torque", kTorques, moves,
     "torques of the joints for one cycle, at level of detail 2 and 3, beside those that carry the robot's "
     "own "
     "weight; friction is not compensated"},
    {"torque_command", kTorques, moves, "the same"},
    {"stopj", "a=4", moves, "brakes in joint space"},
    {"stopl", "a=4, aRot=0", moves, "brakes"},
    {"force_mode", "task_frame, selection_vector, wrench, type, limits", moves,
     "compliance with wanted forces"},
    {"end_force_mode", "", sets, "ends it"},
    {"force_mode_set_damping", "damping", sets, "of the next force_mode"},
    {"force_mode_set_gain_scaling", "scaling", sets, "of the next force_mode"},
    {"freedrive_mode", "freeAxes=[1,1,1,1,1,1], feature=p[0,0,0,0,0,0]", moves,
     "compliance in these axes of a frame, also \"base\" or \"tool\""},
    {"freedrive_mode_no_incorrect_payload_check", "", moves, "as freedrive_mode"},
    {"end_freedrive_mode", "", sets, "ends it"},
    {"get_freedrive_status", "", reads, "0: singularities do not restrict it"},
    {"teach_mode", "", moves, "as freedrive_mode"},
    {"end_teach_mode", "", sets, "ends it"},
    {"screw_driving", "f, v_limit", moves,
     "force mode along z of the TCP: follows a screw with a force, at most with this speed"},
    {"end_screw_driving", "", sets, "ends it"},
    {"interpreter_mode", "clearQueueOnEnter=True, clearOnEnd=True", moves,
     "executes what clients of port 30020 send"},
    {"end_interpreter", "", acts, "leaves interpreter mode"},
    {"clear_interpreter", "", acts, "forgets statements that were interpreted"},

    {"sleep", "t", acts, "waits"},
    {"sync", "", acts, "waits for the next cycle"},
    {"textmsg", "s1, s2=\"\"", reports, "a text for log and primary clients"},
    {"popup", "s, title=\"Popup\", warning=False, error=False, blocking=False", reports,
     "as textmsg; with blocking it waits for the dashboard's close popup"},
    {"protective_stop", "", acts, "stops the robot"},
    {"set_tcp", "pose, tcp_name=\"\"", acts, "the TCP in the flange"},
    {"set_payload", "m, cog=TCP", sets,
     "mass and its center; the present force becomes zero, here and below"},
    {"set_target_payload", "m, cog=[0,0,0], inertia=[0,0,0,0,0,0], transition_time=0", sets,
     "the same with inertia"},
    {"set_payload_mass", "m", sets, "mass alone"},
    {"set_payload_cog", "CoG", sets, "center alone"},
    {"set_gravity", "d", acts, "direction of gravity"},
    {"zero_ftsensor", "", acts, "the present force becomes zero"},
    {"ft_rtde_input_enable", "enable, sensor_mass=0, sensor_measuring_offset=[0,0,0], sensor_cog=[0,0,0]",
     acts,
     "the RTDE input external_force_torque is the force sensor; a program without a watchdog is paused where "
     "it is written less often than at 10 Hz"},
    {"enable_external_ft_sensor",
     "enable, sensor_mass=0, sensor_measuring_offset=[0,0,0], sensor_cog=[0,0,0]", acts,
     "the same with the offset in the other sense, as on the robot"},
    {"rtde_set_watchdog", "variable_name, min_frequency, action=\"pause\"", acts,
     "ignore, pause or stop where a client writes the input less often"},

    {"set_standard_digital_out", "n, b", sets, "output 0 to 7"},
    {"set_configurable_digital_out", "n, b", sets, "output 0 to 7"},
    {"set_tool_digital_out", "n, b", sets, "output 0 or 1"},
    {"set_digital_out", "n, b", sets, "output 0 to 7, of the tool 8 and 9; also digital_out[N] = True"},
    {"set_standard_analog_out", "n, f", sets, "output 0 or 1, fraction of its range"},
    {"set_analog_out", "n, f", sets, "the same"},
    {"set_tool_voltage", "voltage", sets, "0, 12 or 24"},
    {"set_standard_analog_input_domain", "port, domain", ignored, kNoEffect},
    {"set_tool_analog_input_domain", "port, domain", ignored, kNoEffect},
    {"set_analog_outputdomain", "port, domain", ignored, kNoEffect},
    {"set_analog_inputrange", "port, range", ignored, kNoEffect},
    {"set_runstate_outputs", "outputs", ignored, kNoEffect},
    {"set_input_actions_to_default", "", ignored, kNoEffect},
    {"set_tool_output_mode", "mode", ignored, kNoEffect},
    {"set_tool_digital_output_mode", "n, mode", ignored, kNoEffect},
    {"set_tool_communication", "enabled, baud_rate, parity, stop_bits, rx_idle_chars, tx_idle_chars", ignored,
     kNoEffect},
    {"set_safety_mode_transition_hardness", "type", ignored, kNoEffect},
    {"set_standard_digital_input_action", "port, action", ignored, kNoEffect},
    {"set_configurable_digital_input_action", "port, action", ignored, kNoEffect},
    {"set_tool_digital_input_action", "port, action", ignored, kNoEffect},
    {"set_gp_boolean_input_action", "port, action", ignored, kNoEffect},
    {"set_runstate_standard_digital_output_to_value", "outputId, state", ignored, kNoEffect},
    {"set_runstate_configurable_digital_output_to_value", "outputId, state", ignored, kNoEffect},
    {"set_runstate_tool_digital_output_to_value", "outputId, state", ignored, kNoEffect},
    {"set_runstate_gp_boolean_output_to_value", "outputId, state", ignored, kNoEffect},
    {"set_runstate_standard_analog_output_to_value", "outputId, state", ignored, kNoEffect},
    {"modbus_set_runstate_dependent_choice", "signal_name, runstate_choice", ignored, kNoEffect},
    {"modbus_set_digital_input_action", "signal_name, action", ignored, kNoEffect},
    {"position_deviation_warning", "enabled, threshold=0.8", ignored, kWithoutEffect},
    {"high_holding_torque_disable", "", ignored, kWithoutEffect},
    {"high_holding_torque_enable", "", ignored, kWithoutEffect},
    {"reset_revolution_counter", "qNear=[0,0,0,0,0,0]", ignored, kWithoutEffect},
    {"set_baselight_off", "", ignored, kWithoutEffect},
    {"set_baselight_iec", "", ignored, kWithoutEffect},
    {"set_baselight_solid", "r, g, b", ignored, kWithoutEffect},
    {"get_standard_digital_in", "n", reads, "input 0 to 7"},
    {"get_configurable_digital_in", "n", reads, "input 0 to 7"},
    {"get_tool_digital_in", "n", reads, "input 0 or 1"},
    {"get_digital_in", "n", reads, "input 0 to 7, of the tool 8 and 9"},
    {"get_standard_digital_out", "n", reads, "output 0 to 7"},
    {"get_configurable_digital_out", "n", reads, "output 0 to 7"},
    {"get_tool_digital_out", "n", reads, "output 0 or 1"},
    {"get_digital_out", "n", reads, "output 0 to 7, of the tool 8 and 9"},
    {"get_standard_analog_in", "n", reads, "input 0 or 1"},
    {"get_analog_in", "n", reads, "inputs 0 and 1, of the tool 2 and 3"},
    {"get_tool_analog_in", "n", reads, "input 0 or 1"},
    {"get_standard_analog_out", "n", reads, "output 0 or 1"},
    {"get_analog_out", "n", reads, "the same"},
    {"set_flag", "n, b", sets, "flag 0 to 31; it outlasts the program"},
    {"get_flag", "n", reads, "flag 0 to 31"},
    {"read_input_boolean_register", "address", reads, "RTDE register 0 to 127"},
    {"read_input_integer_register", "address", reads, "RTDE register 0 to 47"},
    {"read_input_float_register", "address", reads, "RTDE register 0 to 47"},
    {"read_output_boolean_register", "address", reads, "RTDE register 0 to 127"},
    {"read_output_integer_register", "address", reads, "RTDE register 0 to 47"},
    {"read_output_float_register", "address", reads, "RTDE register 0 to 47"},
    {"get_rtde_value", "key", reads, "RTDE output of this name"},
    {"write_output_boolean_register", "address, value", sets, "RTDE register 0 to 127"},
    {"write_output_integer_register", "address, value", sets, "RTDE register 0 to 47"},
    {"write_output_float_register", "address, value", sets, "RTDE register 0 to 47"},

    {"get_actual_joint_positions", "", reads, "rad"},
    {"get_joint_positions", "", reads, "the same"},
    {"get_target_joint_positions", "", reads, "rad, of the controller"},
    {"get_actual_joint_positions_history", "steps=0", reads, "rad, so many cycles ago: up to 500"},
    {"get_actual_joint_speeds", "", reads, "rad/s"},
    {"get_joint_speeds", "", reads, "the same"},
    {"get_target_joint_speeds", "", reads, "rad/s, of the controller"},
    {"get_target_joint_accelerations", "", reads, "rad/s^2"},
    {"get_actual_tcp_pose", "", reads, "pose of the TCP"},
    {"get_target_tcp_pose", "", reads, "pose of the TCP, of the controller"},
    {"get_actual_tool_flange_pose", "", reads, "pose of the flange"},
    {"get_target_tcp_pose_along_path", "", reads, "pose of the TCP on its path, which force mode leaves"},
    {"get_target_tcp_speed_along_path", "", reads, "m/s, rad/s, on its path"},
    {"get_target_waypoint", "", reads, "pose of the TCP where the present move ends"},
    {"get_actual_tcp_speed", "", reads, "m/s, rad/s"},
    {"get_target_tcp_speed", "", reads, "m/s, rad/s, of the controller"},
    {"get_tcp_force", "", reads, "N, N m about the flange, in the axes of the base"},
    {"force", "", reads, "size of the force at the TCP"},
    {"tool_contact", "direction=[0,0,0,0,0,0]", reads,
     "cycles for which a force has acted against the direction; 0: no contact"},
    {"get_tcp_offset", "", reads, "the TCP in the flange"},
    {"get_joint_torques", "", reads, "N m"},
    {"get_target_payload", "", reads, "kg"},
    {"get_target_payload_cog", "", reads, "m"},
    {"get_target_payload_inertia", "", reads, "kg m^2"},
    {"estimate_payload", "poses, wrenches", reads,
     "struct(mass, cog) on the flange, from 4 or more poses or joint positions and get_tcp_force() there"},
    {"get_gravity", "", reads, "m/s^2, as set_gravity has set it"},
    {"get_joint_temp", "j", reads, "degrees Celsius, of joint 0 to 5"},
    {"get_tool_temp", "", reads, "degrees Celsius"},
    {"get_tool_current", "", reads, "A"},
    {"get_steptime", "", computes, "0.002"},
    {"time", "mode=0", reads, "struct(sec, nanosec) since the controller has started; mode 0 alone"},
    {"is_steady", "", reads, "the robot has been at rest for 0.5 s"},
    {"get_forward_kin", "q=here, tcp=active", solves, "pose of the TCP at joint positions"},
    {"get_inverse_kin", "x, qnear=here, maxPositionError=1e-10, maxOrientationError=1e-10, tcp=active",
     solves, "joint positions of a pose"},
    {"get_inverse_kin_has_solution",
     "x, qnear=here, maxPositionError=1e-10, maxOrientationError=1e-10, tcp=active", solves,
     "there are such positions"},
    {"get_jacobian", "pos=here, tcp=active", solves, "rates of the TCP for rates of the joints, 6 rows"},
    {"get_jacobian_time_derivative", "pos=here, vel=here, tcp=active", reads,
     "its rate at joint speeds, 6 rows"},
    {"get_mass_matrix", "q=here, include_rotors_inertia=False", reads,
     "kg m^2, 6 rows, of the links in the robot's URDF file and the payload; rotors are not described: False "
     "alone"},
    {"get_coriolis_and_centrifugal_torques", "q=here, qd=here", reads, "N m, of the same masses"},
    {"is_within_safety_limits", "pose, qNear=here", solves, "a pose or joint positions can be reached"},

    {"socket_open", "address, port, socket_name=\"socket_0\"", acts, "connects; True where it succeeds"},
    {"socket_close", "socket_name=\"socket_0\"", acts, "closes"},
    {"socket_send_string", "str, socket_name=\"socket_0\"", acts,
     "sends a text; True where the socket is open"},
    {"socket_send_line", "str, socket_name=\"socket_0\"", acts,
     "sends a text and an end of line, in the same way"},
    {"socket_send_int", "value, socket_name=\"socket_0\"", acts, "sends 4 bytes, in the same way"},
    {"socket_send_byte", "value, socket_name=\"socket_0\"", acts, "sends a byte, in the same way"},
    {"socket_set_var", "name, value, socket_name=\"socket_0\"", acts, "sends SET NAME VALUE"},
    {"socket_get_var", "name, socket_name=\"socket_0\"", acts, "sends GET NAME, reads an integer"},
    {"socket_read_string",
     "socket_name=\"socket_0\", prefix=\"\", suffix=\"\", interpret_escape=False, timeout=2", acts,
     "reads a text; empty after the timeout. With interpret_escape \\n, \\r, \\t of prefix and suffix are "
     "such "
     "characters"},
    {"socket_read_line", "socket_name=\"socket_0\", timeout=2", acts, "reads a line"},
    {"socket_read_ascii_float", "number, socket_name=\"socket_0\", timeout=2", acts,
     "reads (1.5, 2); their count comes first, 0 after the timeout"},
    {"socket_read_binary_integer", "number, socket_name=\"socket_0\", timeout=2", acts,
     "reads 4 bytes each, in the same way"},
    {"socket_read_byte_list", "number, socket_name=\"socket_0\", timeout=2", acts,
     "reads bytes, in the same way"},

    {"sin", "f", computes, "sine"},
    {"cos", "f", computes, "cosine"},
    {"tan", "f", computes, "tangent"},
    {"asin", "f", computes, "arc sine"},
    {"acos", "f", computes, "arc cosine"},
    {"atan", "f", computes, "arc tangent"},
    {"atan2", "x, y", computes, "arc tangent of x/y in all quadrants"},
    {"sqrt", "f", computes, "square root"},
    {"pow", "base, exponent", computes, "power"},
    {"log", "b, f", computes, "logarithm of f to base b"},
    {"floor", "f", computes, "integer that is not larger"},
    {"ceil", "f", computes, "integer that is not smaller"},
    {"d2r", "d", computes, "degrees to radians"},
    {"r2d", "r", computes, "radians to degrees"},
    {"norm", "a", computes, "magnitude of a number or list"},
    {"length", "v", computes, "elements of a list, bytes of a text"},
    {"get_list_length", "v", computes, "the same"},
    {"normalize", "v", computes, "list with the norm 1"},
    {"size", "v", computes, "the same; [rows, columns] of a matrix"},
    {"transpose", "m", computes, "of a matrix"},
    {"inv", "m", computes, "inverse of a square matrix or a pose"},
    {"make_list", "length, initial_value, capacity=length", computes, "list of equal elements"},
    {"pose_trans", "p_from, p_from_to", computes, "p_from_to in the frame p_from"},
    {"pose_inv", "p_from", computes, "inverse"},
    {"pose_add", "p_1, p_2", computes, "sum of positions, product of rotations"},
    {"pose_sub", "p_to, p_from", computes, "what pose_add adds to p_from"},
    {"pose_dist", "p_from, p_to", computes, "magnitude of pose_sub"},
    {"point_dist", "p_from, p_to", computes, "distance of positions"},
    {"interpolate_pose", "p_from, p_to, alpha", computes, "pose between two"},
    {"wrench_trans", "T_from_to, w_from", computes, "wrench in another frame"},
    {"rpy2rotvec", "rpy", computes, "roll, pitch, yaw to rotation vector"},
    {"rotvec2rpy", "rotation_vector", computes, "and back"},
    {"str_cat", "op1, op2", computes, "joins two texts"},
    {"str_at", "src, index", computes, "one byte"},
    {"str_sub", "src, index, len=rest", computes, "a part"},
    {"str_find", "src, target, start_from=0", computes, "where it begins; -1: nowhere"},
    {"str_len", "str", computes, "bytes"},
    {"str_empty", "str", computes, "it has none"},
    {"to_str", "val", computes, "text of a value"},
    {"to_num", "str", computes, "number in a text"},
    {"rpc_factory", "type, url", computes, "a handle: \"xmlrpc\", \"http://HOST:PORT/PATH\""},
    {kRemoteCall, "..", acts,
     "calls it, waits at most 60 s; a fault ends the program. URCaps write localhost: the machine of "
     "takt-ur"},
    {"modbus_add_signal",
     "IP, slave_number, signal_address, signal_type, signal_name, sequential_mode=False, register_count=1",
     acts,
     "reads it from IP (HOST:PORT too) at 10 Hz, writes an output from its first value on; 0, 1 or 15: "
     "digital "
     "in- and output, 2, 3 or 16: register in- and output; up to 123 of them"},
    {"modbus_delete_signal", "signal_name", acts, "forgets it"},
    {"modbus_get_signal_status", "signal_name, is_secondary_program=False", acts,
     "its newest value or values"},
    {"modbus_get_error", "signal_name, error_source=0", acts,
     "0, the exception code of the server, -1 without an answer"},
    {"modbus_get_time_since_signal_invalid", "signal_name", acts, "seconds; 0 for a valid one"},
    {"modbus_request_update_signal_value", "signal_name", acts, "reads or writes it at once"},
    {"modbus_set_signal_watchdog", "signal_name, new_timeout_in_sec", ignored, kWithoutEffect},
    {"modbus_set_output_signal", "signal_name, digital_value, is_secondary_program=False", acts,
     "writes a digital output, or several"},
    {"modbus_set_output_register", "signal_name, register_value, is_secondary_program=False", acts,
     "writes a register output, or several"},
    {"modbus_set_signal_update_frequency", "signal_name, update_frequency", acts,
     "at most 125 Hz; 0: on request alone"},
    {"modbus_send_custom_command", "IP, slave_number, function_code, data", acts,
     "sends it; the answer is dropped"},
    {"integer_to_binary_list", "x", computes, "32 values, the lowest bit first"},
    {"binary_list_to_integer", "l", computes, "and back"},

    {"modbus_add_rw_signal", "*", refused, kNoModbus},
    {"eip_writer_factory", "*", refused, kNoRpc},
    {"eip_reader_factory", "*", refused, kNoRpc},
    {"conveyor_pulse_decode", "*", refused, kNoConveyor},
    {"track_conveyor_linear", "*", refused, kNoConveyor},
    {"track_conveyor_circular", "*", refused, kNoConveyor},
    {"stop_conveyor_tracking", "*", refused, kNoConveyor},
    {"set_conveyor_tick_count", "*", refused, kNoConveyor},
    {"get_conveyor_tick_count", "*", refused, kNoConveyor},
    {"encoder_get_tick_count", "*", refused, kNoConveyor},
    {"encoder_set_tick_count", "*", refused, kNoConveyor},
    {"encoder_enable_pulse_decode", "*", refused, kNoConveyor},
    {"encoder_enable_set_tick_count", "*", refused, kNoConveyor},
    {"encoder_unwind_delta_tick_count", "*", refused, kNoConveyor},
    {"powerdown", "*", refused, kNoPower},
    {"path_offset_enable", "*", refused, kNoOffset},
    {"path_offset_set", "*", refused, kNoOffset},
    {"request_boolean_from_primary_client", "*", refused, kNoOperator},
    {"request_float_from_primary_client", "*", refused, kNoOperator},
    {"request_integer_from_primary_client", "*", refused, kNoOperator},
    {"request_string_from_primary_client", "*", refused, kNoOperator},
    {"mc_initialize", "*", refused, kNoPath},
    {"mc_load_path", "*", refused, kNoPath},
    {"mc_run_motion", "*", refused, kNoPath},
    {"random", "*", refused, "a run is repeated bit for bit; a sequence of the program's own is allowed"},
};

Signature parsed(std::string_view parameters) {
  Signature signature;
  int depth = 0;
  bool named = false;
  std::size_t begin = 0;
  for (std::size_t i = 0; i <= parameters.size(); ++i) {
    const char c = i < parameters.size() ? parameters[i] : ',';
    if (c == '[') ++depth;
    if (c == ']') --depth;
    if (depth > 0 || (c != ',' && c != '=')) continue;
    if (!named && i > begin) {
      signature.names.push_back(parameters.substr(begin, i - begin));
      if (c == ',') signature.required = signature.names.size();
    }
    named = c == '=';
    if (c == ',') {
      begin = i + 1;
      while (begin < parameters.size() && parameters[begin] == ' ') ++begin;
    }
  }
  return signature;
}

using Signatures = std::map<std::string_view, std::pair<const Function*, Signature>>;
const Signatures& index() {
  static const Signatures all = [] {
    Signatures made;
    for (const Function& function : kFunctions)
      made[function.name] = {&function, parsed(function.parameters)};
    return made;
  }();
  return all;
}

}  // namespace

std::span<const Function> functions() {
  return kFunctions;
}

const Function* find_function(std::string_view name) {
  const auto found = index().find(name);
  return found == index().end() ? nullptr : found->second.first;
}

const Signature& signature_of(const Function& function) {
  return index().at(function.name).second;
}

std::string functions_page() {
  std::string page =
      "# Functions of URScript in takt-ur\n\n"
      "`takt-ur functions` writes this page. Parameters with `=` may be left out; all may be given by "
      "name.\n\n"
      "| function | what it does |\n|---|---|\n";
  std::string refusals =
      "\nA program that calls one of these is refused before it starts, with line and column:\n\n| function "
      "| reason |\n|---|---|\n";
  for (const Function& function : kFunctions) {
    const bool is_refused = function.kind == refused;
    std::string& table = is_refused ? refusals : page;
    table += "| `" + std::string(function.name);
    if (!is_refused) table += "(" + std::string(function.parameters) + ")";
    table += "` | " + std::string(function.does) + " |\n";
  }
  return page + refusals;
}

}  // namespace takt::urscript
