// Received commands, good and bad, through the functions of the server's command path: message ->
// from_message -> validate -> CommandBuffer -> step. An independent oracle determines the faults of each, and
// every rejection must be for one of them. A twin simulation gets only the good ones, made by the oracle: the
// same state hash after every step.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <set>

#include "server/dds/convert_commands.h"
#include "server/runtime/loop/command_buffer.h"
#include "tests/support/effort.h"
#include "tests/support/loop_reader.h"
#include "tests/support/service_cell.h"
#include "tests/support/test_device.h"

namespace takt {
namespace {

using Codes = std::set<std::string>;  ///< everything that is wrong with a sample; empty: it is good

constexpr std::size_t kSamplesPerStep = 200;
constexpr std::size_t kLongestMessage = 2000;  ///< of the report on a sample, however long its names are
constexpr std::size_t kMaxSignals = 32;

/// Which are odd in one way or another, and mostly out of range.
constexpr double kOdd[] = {std::numeric_limits<double>::quiet_NaN(),
                           std::numeric_limits<double>::infinity(),
                           -std::numeric_limits<double>::infinity(),
                           std::numeric_limits<double>::denorm_min(),
                           -std::numeric_limits<double>::denorm_min(),
                           std::numeric_limits<double>::min(),
                           std::numeric_limits<double>::max(),
                           std::numeric_limits<double>::lowest(),
                           -0.0,
                           1e300,
                           -1e12,
                           4.0,
                           -0.5};

struct Limits {
  double lower = 0.0, upper = 0.0, velocity = 0.0, effort = 0.0;
};

/// Of one value, by comparison alone: no number is within invalid limits.
void judge(Codes& codes, double value, double lower, double upper, const char* code) {
  if (value >= lower && value <= upper) return;
  codes.insert(value - value == 0.0 ? code : "not_finite");
}

class Generator {
 public:
  explicit Generator(const CellDescription& cell) : cell_(cell) {
    for (const JointModel& joint : cell.robots[0].arm.joints) {
      joints_.push_back(joint.name);
      limits_[joint.name] = {joint.lower, joint.upper, joint.max_velocity, joint.max_effort};
    }
  }

  bool chance(unsigned one_in) { return dice_() % one_in == 0; }
  unsigned below(unsigned n) { return static_cast<unsigned>(dice_() % n); }
  double within(double lower, double upper) {
    return lower + (upper - lower) * std::uniform_real_distribution<double>(0.0, 1.0)(dice_);
  }
  double odd() { return kOdd[below(std::size(kOdd))]; }
  std::string odd_name() {
    switch (below(7)) {
      case 0:
        return "";
      case 1:
        return std::string(1U << (8U + below(10U)), 'x');
      case 2:
        return std::string("wrist\0_1_joint", 14);
      case 3:
        return "\xff\xfe\x80%n%s";
      case 4:
        return "Elbow_Joint";
      case 5:
        return joints_[0] + " ";
      default:
        return "../../../etc/passwd";
    }
  }
  builtin_interfaces::msg::Time stamp(double time_s, Codes& codes) {
    builtin_interfaces::msg::Time stamp;
    if (chance(3)) return stamp;  // none
    const std::int64_t ns = std::llround(time_s * 1e9);
    stamp.sec = static_cast<std::int32_t>(ns / 1'000'000'000);
    stamp.nanosec = static_cast<std::uint32_t>(ns % 1'000'000'000);
    if (!chance(40)) return stamp;
    if (chance(2)) {
      stamp.sec = chance(2) ? -1 : std::numeric_limits<std::int32_t>::min();
    } else {
      stamp.nanosec = chance(2) ? 1'000'000'000U : std::numeric_limits<std::uint32_t>::max();
    }
    codes.insert("malformed");
    return stamp;
  }

  sensor_msgs::msg::JointState joints(double time_s, Codes& codes) {
    sensor_msgs::msg::JointState message;
    message.header.stamp = stamp(time_s, codes);
    message.name = joints_;
    std::shuffle(message.name.begin(), message.name.end(), dice_);
    const bool with_velocity = chance(2), with_effort = chance(3);
    for (const std::string& name : message.name) {
      const Limits& of = limits_[name];
      message.position.push_back(chance(20) ? of.upper : within(of.lower, of.upper));
      if (with_velocity) message.velocity.push_back(within(-of.velocity, of.velocity));
      if (with_effort) message.effort.push_back(within(-of.effort, of.effort));
    }
    const unsigned faults = below(3);
    for (unsigned f = 0; f < faults; ++f) {
      switch (below(6)) {
        case 0:
          message.name[below(static_cast<unsigned>(message.name.size()))] = odd_name();
          break;
        case 1:
          message.name[below(static_cast<unsigned>(message.name.size()))] = joints_[below(6)];
          break;
        case 2:
          resize(message.position);
          break;
        case 3:
          resize(chance(2) ? message.velocity : message.effort);
          break;
        case 4:
          if (chance(4)) message.name.resize(1 + below(40), joints_[0]);
          break;
        default:
          spoil(chance(2) ? message.position : chance(2) ? message.velocity : message.effort);
      }
    }
    const auto wrong_length = [&](std::size_t size, bool may_be_empty) {
      return size != joints_.size() && !(may_be_empty && size == 0);
    };
    const bool torques = message.velocity.empty() && !message.effort.empty();
    if (wrong_length(message.name.size(), false) || wrong_length(message.position.size(), torques) ||
        wrong_length(message.velocity.size(), true) || wrong_length(message.effort.size(), true)) {
      codes.insert("wrong_count");
      return message;  // other faults are not visible by joint
    }
    judge_names(message.name, codes);
    for (std::size_t i = 0; i < message.name.size(); ++i) {
      const auto of = limits_.find(message.name[i]);
      if (of == limits_.end()) continue;
      const auto [lower, upper, velocity, effort] = of->second;
      if (!message.position.empty()) judge(codes, message.position[i], lower, upper, "out_of_range");
      if (!message.velocity.empty())
        judge(codes, message.velocity[i], -velocity, velocity, "velocity_out_of_range");
      if (!message.effort.empty()) judge(codes, message.effort[i], -effort, effort, "effort_out_of_range");
    }
    return message;
  }

  /// Linear through its points: a position is extreme at a point, a velocity is that of a piece.
  trajectory_msgs::msg::JointTrajectory trajectory(double time_s, Codes& codes) {
    trajectory_msgs::msg::JointTrajectory message;
    message.header.stamp = stamp(time_s, codes);
    if (chance(30)) return message;  // stop
    message.joint_names = joints_;
    std::shuffle(message.joint_names.begin(), message.joint_names.end(), dice_);
    if (chance(5000)) {
      message.points.resize(kMaxTrajectoryPoints + 1 + below(3));
      codes.insert("malformed");
      return message;
    }
    const unsigned points = 1 + below(4);
    for (unsigned p = 0; p < points; ++p) {
      trajectory_msgs::msg::JointTrajectoryPoint point;
      for (const std::string& name : message.joint_names) {
        const Limits& of = limits_[name];
        // A piece of 10 s: slower than every joint's limit, unless its time is spoilt.
        point.positions.push_back(within(0.5 * of.lower, 0.5 * of.upper));
      }
      point.time_from_start.sec = static_cast<std::int32_t>(10 * (p + 1));
      message.points.push_back(point);
    }
    auto& one = message.points[below(points)];
    switch (below(12)) {
      case 0:
        message.joint_names[below(6)] = odd_name();
        break;
      case 1:
        message.joint_names[below(6)] = joints_[below(6)];
        break;
      case 2:
        resize(one.positions);
        break;
      case 3:
        spoil(one.positions);
        break;
      case 4:
        one.time_from_start.sec = chance(2) ? -7 : 3;
        break;
      case 5:
        one.time_from_start.nanosec = chance(2) ? 1'000'000'000U : 5U;
        break;
      case 6:
        one.velocities.resize(1 + below(5));
        break;
      case 7:
        one.effort.resize(1 + below(5));
        break;
      default:
        break;
    }
    const std::size_t n = joints_.size();
    if (message.joint_names.size() != n) codes.insert("wrong_count");
    judge_names(message.joint_names, codes);
    double before_s = -1.0;
    for (std::size_t p = 0; p < message.points.size(); ++p) {
      auto& point = message.points[p];
      if (point.time_from_start.nanosec > 999'999'999U) codes.insert("malformed");
      const double t = point.time_from_start.sec + 1e-9 * point.time_from_start.nanosec;
      if (t < 0.0 || (p > 0 && t <= before_s)) codes.insert("times_not_ascending");
      if (point.positions.size() != n || (!point.effort.empty() && point.effort.size() != n) ||
          !point.velocities.empty())  // too few
        codes.insert("wrong_count");
      for (std::size_t j = 0; j < std::min(n, point.positions.size()); ++j) {
        const auto of = limits_.find(message.joint_names[j]);
        if (of == limits_.end()) continue;
        const double q = point.positions[j];
        judge(codes, q, of->second.lower, of->second.upper, "out_of_range");
        if (p == 0 || message.points[p - 1].positions.size() <= j || !(t > before_s)) continue;
        const double speed = std::abs(q - message.points[p - 1].positions[j]) / (t - before_s);
        if (speed > of->second.velocity) codes.insert("velocity_out_of_range");
      }
      before_s = t;
    }
    return message;
  }

  takt_msgs::msg::GripperCommand gripper(double time_s, Codes& codes) {
    const GripperDescription& of = cell_.grippers[0];
    takt_msgs::msg::GripperCommand message;
    message.stamp = stamp(time_s, codes);
    message.action = static_cast<GripperAction>(chance(8) ? below(256) : below(3));
    message.width = chance(4) ? odd() : within(0.0, of.max_width_m);
    message.max_force = chance(4) ? odd() : within(0.0, of.max_force_N);
    if (static_cast<int>(message.action) > 2) codes.insert("malformed");
    judge(codes, message.width, 0.0, of.max_width_m, "out_of_range");
    judge(codes, message.max_force, 0.0, of.max_force_N, "out_of_range");
    return message;
  }

  takt_msgs::msg::DeviceCommand device(double time_s, Codes& codes) {
    takt_msgs::msg::DeviceCommand message;
    message.stamp = stamp(time_s, codes);
    std::set<std::string> given;
    const unsigned count = chance(20) ? 200 : 1 + below(2);
    for (unsigned i = 0; i < count; ++i) {
      const unsigned kind = below(12);
      const std::string name = kind == 0   ? "temperature"
                               : kind == 1 ? "no_such_lamp"
                               : kind < 7  ? "lamp"
                                           : "set_point";
      const double value = chance(5) ? odd() : name == "lamp" ? within(0.0, 1.0) : within(20.0, 300.0);
      message.signals.push_back(name);
      message.values.push_back(value);
      if (!given.insert(name).second) codes.insert("malformed");
      if (kind == 0) codes.insert("read_only_signal");
      if (kind == 1) codes.insert("unknown_signal");
      if (name == "lamp") judge(codes, value, 0.0, 1.0, "out_of_range");
      if (name == "set_point") judge(codes, value, 20.0, 300.0, "out_of_range");
    }
    if (chance(20)) resize(message.values);
    if (message.values.size() != message.signals.size() || message.signals.size() > kMaxSignals)
      codes.insert("wrong_count");
    return message;
  }

  std::size_t place(const std::string& joint) const {
    return static_cast<std::size_t>(std::find(joints_.begin(), joints_.end(), joint) - joints_.begin());
  }

 private:
  void judge_names(const std::vector<std::string>& names, Codes& codes) const {
    std::set<std::string> given;
    for (const std::string& name : names) {
      if (!limits_.contains(name)) codes.insert("unknown_joint");
      if (!given.insert(name).second) codes.insert("duplicate_joint");
    }
  }
  void resize(std::vector<double>& values) {
    values.resize(chance(30) ? 5000 : below(9), chance(2) ? 0.0 : odd());
  }
  void spoil(std::vector<double>& values) {
    if (!values.empty()) values[below(static_cast<unsigned>(values.size()))] = odd();
  }

  const CellDescription& cell_;
  std::vector<std::string> joints_;
  std::map<std::string, Limits> limits_;
  std::mt19937_64 dice_{20261122};
};

SimTime time_of(const builtin_interfaces::msg::Time& stamp) {
  const std::int64_t ns = std::int64_t{1'000'000'000} * stamp.sec + stamp.nanosec;
  return {ns > 0 ? ns : -1};
}

/// The command that a good sample describes.
JointCommand meaning(const Generator& generator, int robot, const sensor_msgs::msg::JointState& message) {
  JointCommand command;
  command.robot = robot;
  command.stamp = time_of(message.header.stamp);
  command.has_velocity = !message.velocity.empty();
  command.has_effort = !message.effort.empty();
  command.torque_mode = message.position.empty();
  for (std::size_t i = 0; i < message.name.size(); ++i) {
    const std::size_t place = generator.place(message.name[i]);
    if (!command.torque_mode) command.position[place] = message.position[i];
    if (command.has_velocity) command.velocity[place] = message.velocity[i];
    if (command.has_effort) command.effort[place] = message.effort[i];
  }
  return command;
}
TrajectoryCommand meaning(const Generator& generator, int robot,
                          const trajectory_msgs::msg::JointTrajectory& message) {
  auto path = std::make_shared<JointPath>();
  for (const auto& from : message.points) {
    JointPathPoint& point = path->points.emplace_back();
    point.t = from.time_from_start.sec + 1e-9 * from.time_from_start.nanosec;
    for (std::size_t i = 0; i < message.joint_names.size(); ++i)
      point.q[generator.place(message.joint_names[i])] = from.positions[i];
  }
  return {robot, time_of(message.header.stamp), path};
}
GripperCommand meaning(const Generator&, int gripper, const takt_msgs::msg::GripperCommand& message) {
  return {gripper, time_of(message.stamp), message.action, message.width, message.max_force};
}
DeviceCommand meaning(const Generator&, int device, const takt_msgs::msg::DeviceCommand& message) {
  DeviceCommand command;
  command.device = device;
  command.stamp = time_of(message.stamp);
  for (std::size_t i = 0; i < message.signals.size(); ++i) {
    const auto place = static_cast<std::size_t>(command.count++);
    command.signals[place] = message.signals[i] == std::string("lamp") ? 1 : 0;
    command.values[place] = message.values[i];
  }
  return command;
}

class BadCommands : public testing::Test {
 protected:
  BadCommands() { loop_.start(); }
  ~BadCommands() override { loop_.stop(); }

  static std::shared_ptr<CellModel> cell_with_device() {
    auto model = test::service_model();
    test::add_chamber(*model);
    return model;
  }
  static RunLoopOptions paused() {
    RunLoopOptions options;
    options.pace = Pace::free;
    options.state = SimulationState::paused;
    return options;
  }

  /// One sample through the server's path, and its command to the twin.
  template <typename Message>
  void send(int target, int index, const Message& message, Codes codes) {
    const Rejection verdict = sent(target, Message(message));
    const std::string code = verdict.message.empty() ? "" : std::string(to_string(verdict.code));
    SimTime stamp;
    if constexpr (requires { message.header; }) {
      stamp = time_of(message.header.stamp);
    } else {
      stamp = time_of(message.stamp);
    }
    SimTime& newest = newest_[target];
    if (codes.empty() && stamp.given() && stamp < newest) codes.insert("stale");
    if (codes.empty()) {
      ASSERT_EQ(code, "") << verdict.message;
      ++good_;
      newest = std::max(newest, stamp);
      const Command command = meaning(generator_, index, message);
      if (const auto* signals = std::get_if<DeviceCommand>(&command))
        for (int i = 0; i < signals->count; ++i)
          twin_signals_[signals->signals[static_cast<std::size_t>(i)]] =
              signals->values[static_cast<std::size_t>(i)];
      twin_commands_[target] = command;
    } else {
      ASSERT_TRUE(codes.contains(code)) << '\'' << code << "' " << verdict.message.substr(0, 200)
                                        << "; what is wrong: " << testing::PrintToString(codes);
      ASSERT_LE(verdict.message.size(), kLongestMessage) << verdict.message.substr(0, 200);
      ++rejected_[code];
    }
  }

  void send_one(double time_s) {
    const int side = static_cast<int>(generator_.below(2));
    // Occasionally one that was overtaken.
    const double stamped_s = time_s > 0.1 && generator_.chance(20) ? time_s - 0.05 : time_s;
    Codes codes;
    switch (generator_.below(8)) {
      case 0: {
        const auto message = generator_.device(stamped_s, codes);
        return send(4, 0, message, codes);
      }
      case 1: {
        const auto message = generator_.gripper(stamped_s, codes);
        return send(2 + side, side, message, codes);
      }
      case 2:
      case 3: {
        const auto message = generator_.trajectory(stamped_s, codes);
        return send(side, side, message, codes);
      }
      default: {
        const auto message = generator_.joints(stamped_s, codes);
        return send(side, side, message, codes);
      }
    }
  }

  void step_both() {
    const std::uint64_t step = twin_.step_index() + 1;
    std::vector<Command> batch;
    for (auto& [target, command] : twin_commands_) {
      if (auto* signals = std::get_if<DeviceCommand>(&command)) {
        signals->count = 0;
        for (const auto& [signal, value] : twin_signals_) {
          const auto place = static_cast<std::size_t>(signals->count++);
          signals->signals[place] = signal, signals->values[place] = value;
        }
        twin_signals_.clear();
      }
      batch.push_back(std::move(command));
    }
    twin_commands_.clear();
    ASSERT_TRUE(twin_.step(batch)) << twin_.fault();
    reader_.submit("step", {{"steps", "1"}});
    ASSERT_TRUE(reader_.wait_until([&] { return reader_.snapshot && reader_.snapshot->step >= step; }));
    ASSERT_EQ(reader_.snapshot->state_hash, twin_.state_hash()) << "step " << step;
    reader_.replies.clear();
    reader_.events.clear();
  }

  Simulation simulation_{cell_with_device()}, twin_{cell_with_device()};
  RunLoop loop_{simulation_, paused()};
  test::LoopReader reader_{loop_};
  Generator generator_{loop_.cell()};
  std::map<int, Command> twin_commands_;         ///< the newest by target
  std::map<std::uint8_t, double> twin_signals_;  ///< of the device: the newest by signal
  std::map<int, SimTime> newest_;                ///< stamp by target
  std::size_t good_ = 0;
  std::map<std::string, std::size_t> rejected_;

 private:
  template <typename Message>
  Rejection sent(int target, Message message) {
    const auto raw = from_message(loop_.cell(), target, std::move(message));
    if (const auto* malformed = std::get_if<Rejection>(&raw)) return *malformed;
    const auto validated = validate(loop_.cell(), target, std::get<0>(raw));
    if (const auto* rejection = std::get_if<Rejection>(&validated)) return *rejection;
    return loop_.append(Command(std::get<0>(validated)), 1, monotonic_now_ns()).value_or(Rejection{});
  }
};

TEST_F(BadCommands, InvalidSamplesAreRejectedForTheirFaultAndChangeNothing) {
  const std::size_t samples = 100'000 * test::effort();
  for (std::size_t i = 0; i < samples; ++i) {
    ASSERT_NO_FATAL_FAILURE(send_one(twin_.time_s())) << "sample " << i;
    if ((i + 1) % kSamplesPerStep == 0) {
      ASSERT_NO_FATAL_FAILURE(step_both()) << "sample " << i;
    }
  }
  EXPECT_EQ(twin_.step_index(), samples / kSamplesPerStep);
  // Both kinds, and every reason there is.
  EXPECT_GT(good_, samples / 4);
  EXPECT_LT(good_, 3 * samples / 4);
  for (const char* code : {"unknown_joint", "duplicate_joint", "wrong_count", "not_finite", "out_of_range",
                           "velocity_out_of_range", "effort_out_of_range", "stale", "malformed",
                           "times_not_ascending", "unknown_signal", "read_only_signal"})
    EXPECT_GT(rejected_[code], 10 * test::effort()) << code;
  RecordProperty("good", std::to_string(good_));
}

}  // namespace
}  // namespace takt
