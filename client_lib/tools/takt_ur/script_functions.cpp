#include "client_lib/tools/takt_ur/script_functions.h"

#include <algorithm>
#include <functional>
#include <map>
#include <stdexcept>

#include "client_lib/gateway/ur/payload_estimate.h"

namespace takt::ur {
namespace {

using urscript::Value;

constexpr double kFullScale_V = 10.0;

struct Reading {
  const UrController& controller;
  const CallArguments& arguments;
  const Vector6& near;
};

bool bit(std::uint64_t bits, int number) {
  return (bits >> static_cast<unsigned>(number) & 1U) != 0;
}

Value digital(const Reading& r, std::uint64_t bits, int first, int most) {
  return bit(bits, first + r.arguments.whole(0, most));
}

/// The bit of a number that stands for outputs 0 to 7, and of the tool 8 and 9.
int digital_place(int number) {
  return number < 8 ? number : 8 + number;
}

/// As the manual has it: about the flange. RTDE's is about the TCP.
Value force_about_flange(const UrController& c) {
  const Pose X_RT = c.motion().tool_pose(c.actual_position());
  const Vec3 way = X_RT.p - (X_RT * c.motion().tool().inverse()).p;
  const Vector6 lever = c.turned({way.x(), way.y(), way.z(), 0.0, 0.0, 0.0}, true);
  Vector6 wrench = c.contact_force();
  const Vec3 turned = Vec3(lever[0], lever[1], lever[2]).cross(Vec3(wrench[0], wrench[1], wrench[2]));
  for (std::size_t i = 0; i < 3; ++i) wrench.at(3 + i) += turned[static_cast<Eigen::Index>(i)];
  return list_value(wrench);
}

Value time_of(const Reading& r) {
  static const auto names =
      std::make_shared<const std::vector<std::string>>(std::vector<std::string>{"sec", "nanosec"});
  if (r.arguments.number(0, 0.0) != 0.0)
    r.arguments.fail("mode 0; the time of day would differ from run to run");
  const double seconds = std::floor(r.controller.time_s());
  return Value::record(
      {Value::whole(seconds), Value::whole(std::round(1e9 * (r.controller.time_s() - seconds)))}, names);
}

Value tcp_pose(const UrController& c, const Vector6& q) {
  return pose_value(vector_of(c.to_base(c.motion().tool_pose(q))));
}

Value tcp_speed(const UrController& c, const Vector6& q, const Vector6& qd) {
  return list_value(c.turned(c.motion().tool_speed(q, qd), true));
}

Value boolean_register(const rtde::Table& table, const std::string& side, int number) {
  if (number >= 64) return table[side + "_bit_register_" + std::to_string(number)].whole[0] != 0;
  const auto bits = static_cast<std::uint64_t>(
      table[side + (number < 32 ? "_bit_registers0_to_31" : "_bit_registers32_to_63")].whole[0]);
  return bit(bits, number % 32);
}

Value register_of(const Reading& r, bool is_input, std::string_view type) {
  const std::string side = is_input ? "input" : "output";
  const rtde::Table& table = is_input ? r.controller.inputs() : r.controller.outputs();
  if (type == "bit") return boolean_register(table, side, r.arguments.whole(0, 127));
  const rtde::Value& value =
      table[side + "_" + std::string(type) + "_register_" + std::to_string(r.arguments.whole(0, 47))];
  if (type == "int") return Value::whole(static_cast<double>(value.whole[0]));
  if (!std::isfinite(value.real[0])) throw urscript::ValueError("the register holds no finite number");
  return value.real[0];
}

/// An RTDE output by its name: a number, a bool or a list of numbers.
Value rtde_value(const Reading& r) {
  const rtde::Table& table = r.controller.outputs();
  const auto index = table.find(r.arguments.text(0));
  if (!index) r.arguments.fail("the name of an RTDE output");
  const rtde::Type type = table.variables()[*index].type;
  const rtde::Value& value = table.value(*index);
  if (type == rtde::Type::boolean) return value.whole[0] != 0;
  const bool real = rtde::is_real(type);
  const auto number = [&](std::size_t i) {
    if (!real) return Value::whole(static_cast<double>(value.whole.at(i)));
    if (!std::isfinite(value.real.at(i))) throw urscript::ValueError("the output holds no finite number");
    return Value(value.real.at(i));
  };
  const std::size_t count =
      type == rtde::Type::vector3 ? 3
      : type == rtde::Type::vector6 || type == rtde::Type::vector6_int32 || type == rtde::Type::vector6_uint32
          ? 6
          : 1;
  if (count == 1) return number(0);
  std::vector<Value> values;
  for (std::size_t i = 0; i < count; ++i) values.push_back(number(i));
  return Value::list(std::move(values));
}

/// The pose of the active TCP at joint positions where the given one is at `X_RT`.
Pose for_active_tcp(const Reading& r, const Pose& X_RT, std::size_t tcp) {
  if (!r.arguments.given(tcp)) return X_RT;
  return X_RT * pose_of(r.arguments.pose(tcp)).inverse() * r.controller.motion().tool();
}

std::optional<Vector6> inverse(const Reading& r) {
  const Pose X_RT = for_active_tcp(r, r.controller.from_base(pose_of(r.arguments.pose(0))), 4);
  return r.controller.motion().inverse_kinematics(X_RT,
                                                  r.arguments.given(1) ? r.arguments.joints(1) : r.near);
}

Value forward(const Reading& r) {
  const UrController& c = r.controller;
  const Vector6 q = r.arguments.given(0) ? r.arguments.joints(0) : c.actual_position();
  Pose X_RT = c.motion().tool_pose(q);
  if (r.arguments.given(1)) X_RT = X_RT * c.motion().tool().inverse() * pose_of(r.arguments.pose(1));
  return pose_value(vector_of(c.to_base(X_RT)));
}

Vector6 joints_or(const Reading& r, std::size_t i, const Vector6& otherwise) {
  return r.arguments.given(i) ? r.arguments.joints(i) : otherwise;
}

/// Column by column: the twist of the TCP in the protocol's base at one joint's rate of 1 rad/s. `tcp`: the argument with
/// another TCP than the active one.
Matrix6 jacobian_of(const Reading& r, const Vector6& q, std::size_t tcp) {
  const UrController& c = r.controller;
  Vec3 lever = Vec3::Zero();  // from the active TCP to the given one
  if (r.arguments.given(tcp)) {
    const Pose X_RT = c.motion().tool_pose(q);
    lever = (X_RT * c.motion().tool().inverse() * pose_of(r.arguments.pose(tcp))).p - X_RT.p;
  }
  Matrix6 J;
  for (std::size_t joint = 0; joint < 6; ++joint) {
    Vector6 rate{};
    rate.at(joint) = 1.0;
    Vector6 twist = c.motion().tool_speed(q, rate);
    const Vec3 moved = Vec3(twist[3], twist[4], twist[5]).cross(lever);
    for (std::size_t i = 0; i < 3; ++i) twist.at(i) += moved[static_cast<Eigen::Index>(i)];
    twist = c.turned(twist, true);
    J.col(static_cast<Eigen::Index>(joint)) = Eigen::Map<const Eigen::Matrix<double, 6, 1>>(twist.data());
  }
  return J;
}

Value matrix_value(const Matrix6& M) {
  std::vector<Value> rows;
  for (Eigen::Index i = 0; i < 6; ++i) {
    std::vector<double> row;
    for (Eigen::Index j = 0; j < 6; ++j) row.push_back(M(i, j));
    rows.emplace_back(row);
  }
  return Value::list(std::move(rows));
}

Value jacobian(const Reading& r) {
  return matrix_value(jacobian_of(r, joints_or(r, 0, r.controller.actual_position()), 1));
}

Value jacobian_time_derivative(const Reading& r) {
  const Vector6 q = joints_or(r, 0, r.controller.actual_position());
  const Vector6 qd = joints_or(r, 1, r.controller.actual_velocity());
  return matrix_value(jacobian_rate(jacobian_of(r, q, 2), qd));
}

BodyInertia inertia_of(const Payload& payload) {
  const auto& c = payload.center_of_gravity_m;
  const Vector6& I = payload.inertia_kg_m2;  // xx, yy, zz, xy, xz, yz
  BodyInertia body{payload.mass_kg, {c[0], c[1], c[2]}};
  body.I_BBcm_B << I[0], I[3], I[4], I[3], I[1], I[5], I[4], I[5], I[2];
  return body;
}

Value mass_matrix(const Reading& r) {
  if (r.arguments.given(1) && r.arguments.flag(1))
    r.arguments.fail("include_rotors_inertia=False; a cell does not describe the rotors of its drives");
  return matrix_value(r.controller.dynamics().mass_matrix(joints_or(r, 0, r.controller.actual_position()),
                                                          inertia_of(r.controller.payload())));
}

Value coriolis_torques(const Reading& r) {
  return list_value(r.controller.dynamics().coriolis_torques(joints_or(r, 0, r.controller.actual_position()),
                                                             joints_or(r, 1, r.controller.actual_velocity()),
                                                             inertia_of(r.controller.payload())));
}

/// Joint positions, or a pose of the active TCP.
Mat3 flange_rotation(const Reading& r, const Value& place) {
  const UrController& c = r.controller;
  if (place.items() == nullptr || place.items()->values.size() != 6)
    r.arguments.fail("poses: a list of p[x, y, z, rx, ry, rz] or [q0, .., q5]");
  const std::vector<double> numbers = urscript::numbers_of(place);
  Vector6 six;
  std::copy(numbers.begin(), numbers.end(), six.begin());
  const Pose X_BT = place.pose() != nullptr ? pose_of(six) : c.to_base(c.motion().tool_pose(six));
  return X_BT.R * c.motion().tool().R.transpose();
}

Value payload_estimate(const Reading& r) {
  static const auto names =
      std::make_shared<const std::vector<std::string>>(std::vector<std::string>{"mass", "cog"});
  const UrController& c = r.controller;
  const urscript::Items *poses = r.arguments[0].list(), *wrenches = r.arguments[1].list();
  if (poses == nullptr || wrenches == nullptr || poses->values.size() != wrenches->values.size())
    r.arguments.fail("two lists of one length");
  std::vector<WeighedPose> weighed;
  for (std::size_t i = 0; i < poses->values.size(); ++i) {
    const Value& wrench = wrenches->values[i];
    if (wrench.items() == nullptr || wrench.items()->values.size() != 6)
      r.arguments.fail("wrenches: a list of [fx, fy, fz, tx, ty, tz]");
    const std::vector<double> F = urscript::numbers_of(wrench);
    weighed.push_back({flange_rotation(r, poses->values[i]), {{F[0], F[1], F[2]}, {F[3], F[4], F[5]}}});
  }
  const auto& g = c.gravity();
  const auto [mass_kg, moment_F] = estimate_payload(weighed, {g[0], g[1], g[2]});
  // A sensor's wrenches are without the weight of the payload that is set.
  const Payload known = c.senses_without_payload() ? c.payload() : Payload{};
  const auto& cog = known.center_of_gravity_m;
  const double total_kg = known.mass_kg + mass_kg;
  const Vec3 center_F = (known.mass_kg * Vec3(cog[0], cog[1], cog[2]) + moment_F) / total_kg;
  if (!(total_kg > 0.0) || !center_F.allFinite()) throw std::invalid_argument("the wrenches show no mass");
  return Value::record({total_kg, std::vector<double>{center_F.x(), center_F.y(), center_F.z()}}, names);
}

/// Its reason becomes that of the call.
Value with_reason(Value (*function)(const Reading&), const Reading& r) {
  try {
    return function(r);
  } catch (const std::invalid_argument& error) {
    throw urscript::ValueError(std::string(r.arguments.function()) + ": " + error.what());
  }
}

Value within_limits(const Reading& r) {
  const Motion& motion = r.controller.motion();
  if (r.arguments[0].list() != nullptr) return motion.within_limits(r.arguments.joints(0));
  const auto q = motion.inverse_kinematics(r.controller.from_base(pose_of(r.arguments.pose(0))),
                                           r.arguments.given(1) ? r.arguments.joints(1) : r.near);
  return q.has_value() && motion.within_limits(*q);
}

using Reader = std::function<Value(const Reading&)>;
const std::map<std::string_view, Reader>& readers() {
  using R = const Reading&;
  static const std::map<std::string_view, Reader> all{
      {"get_standard_digital_in", [](R r) { return digital(r, r.controller.digital_inputs(), 0, 7); }},
      {"get_configurable_digital_in", [](R r) { return digital(r, r.controller.digital_inputs(), 8, 7); }},
      {"get_tool_digital_in", [](R r) { return digital(r, r.controller.digital_inputs(), 16, 1); }},
      {"get_digital_in",
       [](R r) { return Value(bit(r.controller.digital_inputs(), digital_place(r.arguments.whole(0, 9)))); }},
      {"get_standard_digital_out", [](R r) { return digital(r, r.controller.digital_outputs(), 0, 7); }},
      {"get_configurable_digital_out", [](R r) { return digital(r, r.controller.digital_outputs(), 8, 7); }},
      {"get_tool_digital_out", [](R r) { return digital(r, r.controller.digital_outputs(), 16, 1); }},
      {"get_digital_out",
       [](R r) {
         return Value(bit(r.controller.digital_outputs(), digital_place(r.arguments.whole(0, 9))));
       }},
      {"get_standard_analog_in", [](R r) { return r.controller.analog_input(r.arguments.whole(0, 1)); }},
      {"get_analog_in", [](R r) { return r.controller.analog_input(r.arguments.whole(0, 3)); }},
      {"get_tool_analog_in", [](R r) { return r.controller.analog_input(2 + r.arguments.whole(0, 1)); }},
      {"get_standard_analog_out",
       [](R r) { return r.controller.analog_output(r.arguments.whole(0, 1)) / kFullScale_V; }},
      {"get_analog_out",
       [](R r) { return r.controller.analog_output(r.arguments.whole(0, 1)) / kFullScale_V; }},
      {"get_flag", [](R r) { return Value(r.controller.flag(r.arguments.whole(0, 31))); }},
      {"read_input_boolean_register", [](R r) { return register_of(r, true, "bit"); }},
      {"read_input_integer_register", [](R r) { return register_of(r, true, "int"); }},
      {"read_input_float_register", [](R r) { return register_of(r, true, "double"); }},
      {"read_output_boolean_register", [](R r) { return register_of(r, false, "bit"); }},
      {"read_output_integer_register", [](R r) { return register_of(r, false, "int"); }},
      {"read_output_float_register", [](R r) { return register_of(r, false, "double"); }},
      {"get_rtde_value", rtde_value},
      {"get_actual_joint_positions", [](R r) { return list_value(r.controller.actual_position()); }},
      {"get_joint_positions", [](R r) { return list_value(r.controller.actual_position()); }},
      {"get_target_joint_positions", [](R r) { return list_value(r.controller.target_position()); }},
      {"get_actual_joint_positions_history",
       [](R r) {
         const double steps = r.arguments.given(0) ? r.arguments.number(0) : 0.0;
         if (steps < 0.0) r.arguments.fail("0 to 500 steps");
         return list_value(r.controller.position_before(static_cast<std::size_t>(steps)));
       }},
      {"get_actual_joint_speeds", [](R r) { return list_value(r.controller.actual_velocity()); }},
      {"get_joint_speeds", [](R r) { return list_value(r.controller.actual_velocity()); }},
      {"get_target_joint_speeds", [](R r) { return list_value(r.controller.target_velocity()); }},
      {"get_target_joint_accelerations",
       [](R r) { return list_value(r.controller.motion().acceleration()); }},
      {"get_actual_tcp_pose", [](R r) { return tcp_pose(r.controller, r.controller.actual_position()); }},
      {"get_target_tcp_pose", [](R r) { return tcp_pose(r.controller, r.controller.target_position()); }},
      {"get_actual_tool_flange_pose",
       [](R r) {
         const UrController& c = r.controller;
         return pose_value(
             vector_of(c.to_base(c.motion().tool_pose(c.actual_position()) * c.motion().tool().inverse())));
       }},
      {"get_target_waypoint", [](R r) { return tcp_pose(r.controller, r.controller.motion().end()); }},
      {"get_actual_tcp_speed",
       [](R r) {
         return tcp_speed(r.controller, r.controller.actual_position(), r.controller.actual_velocity());
       }},
      {"get_target_tcp_speed",
       [](R r) {
         return tcp_speed(r.controller, r.controller.target_position(), r.controller.target_velocity());
       }},
      {"get_target_tcp_pose_along_path",
       [](R r) { return tcp_pose(r.controller, r.controller.motion().position()); }},
      {"get_target_tcp_speed_along_path",
       [](R r) {
         const Motion& motion = r.controller.motion();
         return tcp_speed(r.controller, motion.position(), motion.velocity());
       }},
      {"get_tcp_force", [](R r) { return force_about_flange(r.controller); }},
      {"get_gravity",
       [](R r) {
         const auto& g = r.controller.gravity();
         return Value(std::vector<double>(g.begin(), g.end()));
       }},
      {"get_joint_temp",
       [](R r) {
         const auto joint = static_cast<std::size_t>(r.arguments.whole(0, 5));
         return Value(r.controller.outputs()["joint_temperatures"].real.at(joint));
       }},
      {"get_tool_temp", [](R r) { return Value(r.controller.outputs()["tool_temperature"].real[0]); }},
      {"get_tool_current", [](R r) { return Value(r.controller.outputs()["tool_output_current"].real[0]); }},
      {"time", time_of},
      {"force",
       [](R r) {
         const Vector6& f = r.controller.contact_force();
         return Value(std::hypot(f[0], f[1], f[2]));
       }},
      {"tool_contact",
       [](R r) {
         const Vector6 direction = r.arguments.given(0) ? r.arguments.six(0) : Vector6{};
         return Value(r.controller.contact_cycles({direction[0], direction[1], direction[2]}));
       }},
      {"get_freedrive_status", [](R) { return Value(0); }},
      {"get_tcp_offset", [](R r) { return pose_value(r.controller.tcp_offset()); }},
      {"get_joint_torques", [](R r) { return list_value(r.controller.actual_effort()); }},
      {"get_target_payload", [](R r) { return Value(r.controller.payload().mass_kg); }},
      {"get_target_payload_cog",
       [](R r) {
         const auto& cog = r.controller.payload().center_of_gravity_m;
         return Value(std::vector<double>(cog.begin(), cog.end()));
       }},
      {"get_target_payload_inertia", [](R r) { return list_value(r.controller.payload().inertia_kg_m2); }},
      {"is_steady", [](R r) { return Value(r.controller.is_steady()); }},
      {"get_forward_kin", forward},
      {"get_inverse_kin",
       [](R r) {
         const auto q = inverse(r);
         if (!q) throw urscript::ValueError("getInverseKin: unable to find solution!");
         return list_value(*q);
       }},
      {"get_inverse_kin_has_solution", [](R r) { return Value(inverse(r).has_value()); }},
      {"get_jacobian", jacobian},
      {"get_jacobian_time_derivative", jacobian_time_derivative},
      {"get_mass_matrix", [](R r) { return with_reason(mass_matrix, r); }},
      {"estimate_payload", [](R r) { return with_reason(payload_estimate, r); }},
      {"get_coriolis_and_centrifugal_torques", [](R r) { return with_reason(coriolis_torques, r); }},
      {"is_within_safety_limits", within_limits},
  };
  return all;
}

// --- what functions set ---

using Setter = std::function<void(UrController&, const CallArguments&)>;
using A = const CallArguments&;

Setter digital_output(int first, int most) {
  return [first, most](UrController& c, A a) {
    const int number = a.whole(0, most);
    c.set_digital_output(first + number, a.flag(1));
  };
}

void set_payload(UrController& c, A a) {
  Payload payload{a.number(0)};
  const std::vector<double> cog =
      a.given(1) ? a.numbers(1, 3) : std::vector<double>(c.tcp_offset().begin(), c.tcp_offset().begin() + 3);
  std::copy(cog.begin(), cog.end(), payload.center_of_gravity_m.begin());
  if (a.function() == "set_target_payload" && a.given(2)) payload.inertia_kg_m2 = a.six(2);
  c.set_payload(payload);
}

void set_part_of_payload(UrController& c, A a) {
  Payload payload = c.payload();
  if (a.function() == "set_payload_mass") {
    payload.mass_kg = a.number(0);
  } else {
    const auto cog = a.numbers(0, 3);
    std::copy(cog.begin(), cog.end(), payload.center_of_gravity_m.begin());
  }
  c.set_payload(payload);
}

void set_force_mode_option(UrController& c, A a) {
  ForceModeOptions next = c.next_force_mode();
  (a.function() == "force_mode_set_damping" ? next.damping : next.gain) = a.number(0);
  if (const std::string problem = problem_of(next); !problem.empty()) throw urscript::ValueError(problem);
  c.next_force_mode() = next;
}

void begin_force_mode(UrController& c, A a) {
  ForceModeOptions options = c.next_force_mode();
  options.X_RK = c.from_base(pose_of(a.pose(0)));
  const Vector6 selection = a.six(1);
  options.wrench = a.six(2);
  options.type = force_mode_type(a.number(3));
  options.speed_limit = a.six(4);
  for (std::size_t i = 0; i < selection.size(); ++i) options.compliant.at(i) = selection.at(i) != 0.0;
  c.start_force_mode(options);
}

void begin_freedrive(UrController& c, A a) {
  std::array<bool, 6> axes{};
  axes.fill(true);
  Pose X_RK = c.from_base({});
  if (a.function() == "freedrive_mode") {
    if (a.given(0)) {
      const Vector6 free = a.six(0);
      std::transform(free.begin(), free.end(), axes.begin(), [](double one) { return one != 0.0; });
    }
    if (const std::string* frame = a[1].text()) {
      static const std::map<std::string_view, bool> of_tool{
          {"base", false},
          {"tool", true},
      };
      const auto found = of_tool.find(*frame);
      if (found == of_tool.end()) a.fail("p[x, y, z, rx, ry, rz], \"base\", \"tool\"");
      if (found->second) X_RK = c.motion().tool_pose(c.target_position());
    } else if (a.given(1)) {
      X_RK = c.from_base(pose_of(a.pose(1)));
    }
  }
  c.start_freedrive(axes, X_RK);
}

void begin_screw_driving(UrController& c, A a) {
  ForceModeOptions options = c.next_force_mode();
  options.X_RK = c.motion().tool_pose(c.target_position());
  options.compliant[2] = true;
  options.wrench[2] = a.number(0);
  options.speed_limit.fill(1.0);
  options.speed_limit[2] = a.number(1);
  c.start_force_mode(options);
}

void set_sensor_of_client(UrController& c, A a) {
  const auto three = [&](std::size_t i) {
    const std::vector<double> v = a.given(i) ? a.numbers(i, 3) : std::vector<double>(3, 0.0);
    return Vec3(v[0], v[1], v[2]);
  };
  const Vec3 offset = three(2);
  c.set_driver_sensor(
      {a.flag(0), a.function() == "ft_rtde_input_enable" ? offset : -offset, three(3), a.number(1, 0.0)});
}

void set_watchdog(UrController& c, A a) {
  enum class Action : std::uint8_t { none, pauses, ends };
  static const std::map<std::string_view, Action> actions{
      {"ignore", Action::none}, {"pause", Action::pauses}, {"stop", Action::ends}};
  const auto action = actions.find(a.text(2, "pause"));
  if (!c.inputs().find(a.text(0)) || a.number(1) <= 0.0 || action == actions.end())
    a.fail("(the name of an RTDE input, a frequency > 0 Hz, \"ignore\", \"pause\" or \"stop\")");
  c.set_watchdog(a.text(0), action->second == Action::none ? 0.0 : 1.0 / a.number(1),
                 action->second == Action::ends);
}

const std::map<std::string_view, Setter>& setters() {
  static const Setter end_force = [](UrController& c, A) { c.end_force_mode(); };
  static const Setter analog = [](UrController& c, A a) { c.set_analog_output(a.whole(0, 1), a.number(1)); };
  static const std::map<std::string_view, Setter> all{
      {"textmsg", [](UrController& c, A a) { c.text(text_of(a[0]) + (a.given(1) ? text_of(a[1]) : "")); }},
      {"popup", [](UrController& c, A a) { c.text(text_of(a[0])); }},
      {"protective_stop", [](UrController& c, A) { c.protective_stop("a program has asked for it"); }},
      {"set_tcp", [](UrController& c, A a) { c.set_tcp(a.pose(0)); }},
      {"set_payload", set_payload},
      {"set_target_payload", set_payload},
      {"set_payload_mass", set_part_of_payload},
      {"set_payload_cog", set_part_of_payload},
      {"set_gravity",
       [](UrController& c, A a) {
         const auto g = a.numbers(0, 3);
         c.set_gravity({g[0], g[1], g[2]});
       }},
      {"zero_ftsensor", [](UrController& c, A) { c.zero_force_sensor(); }},
      {"set_standard_digital_out", digital_output(0, 7)},
      {"set_configurable_digital_out", digital_output(8, 7)},
      {"set_tool_digital_out", digital_output(16, 1)},
      {"set_digital_out",
       [](UrController& c, A a) {
         const int number = digital_place(a.whole(0, 9));
         c.set_digital_output(number, a.flag(1));
       }},
      {"set_flag",
       [](UrController& c, A a) {
         const int number = a.whole(0, 31);
         c.set_flag(number, a.flag(1));
       }},
      {"set_standard_analog_out", analog},
      {"set_analog_out", analog},
      {"set_tool_voltage",
       [](UrController& c, A a) {
         const double volts = a.number(0);
         if (volts != 0.0 && volts != 12.0 && volts != 24.0) a.fail("0, 12, 24");
         c.set_tool_voltage(static_cast<int>(volts));
       }},
      {"write_output_boolean_register",
       [](UrController& c, A a) {
         const int number = a.whole(0, 127);
         c.write_output_bit(number, a.flag(1));
       }},
      {"write_output_integer_register",
       [](UrController& c, A a) {
         const int number = a.whole(0, 47);
         c.write_output_int(number, std::llround(a.number(1)));
       }},
      {"write_output_float_register",
       [](UrController& c, A a) {
         const int number = a.whole(0, 47);
         c.write_output_double(number, a.number(1));
       }},
      {"ft_rtde_input_enable", set_sensor_of_client},
      {"enable_external_ft_sensor", set_sensor_of_client},
      {"rtde_set_watchdog", set_watchdog},
      {"force_mode", begin_force_mode},
      {"force_mode_set_damping", set_force_mode_option},
      {"force_mode_set_gain_scaling", set_force_mode_option},
      {"freedrive_mode", begin_freedrive},
      {"freedrive_mode_no_incorrect_payload_check", begin_freedrive},
      {"teach_mode", begin_freedrive},
      {"screw_driving", begin_screw_driving},
      {"end_force_mode", end_force},
      {"end_freedrive_mode", end_force},
      {"end_teach_mode", end_force},
      {"end_screw_driving", end_force},
  };
  return all;
}

}  // namespace

Value read_function(const UrController& controller, const CallArguments& arguments, const Vector6& near) {
  return readers().at(arguments.function())({controller, arguments, near});
}

bool set_function(UrController& controller, const CallArguments& arguments) {
  const auto found = setters().find(arguments.function());
  if (found == setters().end()) return false;
  found->second(controller, arguments);
  return true;
}

bool is_read(std::string_view function) {
  return readers().count(function) > 0;
}

bool is_set(std::string_view function) {
  return setters().count(function) > 0;
}

}  // namespace takt::ur
