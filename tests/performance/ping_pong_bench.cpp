// A state and its answer between two processes over plain Fast DDS, without takt: samples of the same types, sizes and QoS
// as in lockstep. Prints the median and the mean of a round in microseconds. The answer is written by a thread that the
// listener wakes, as any controller is.
#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <string>
#include <vector>

#include "idl/common/cdr.h"
#include "ros2_msgs.h"
#include "takt_msgs.h"
#include "takt_topics.h"
#include "tests/performance/raw_dds.h"

namespace takt {
namespace {

using Clock = std::chrono::steady_clock;

struct Options {
  unsigned domain = 77;
  int rounds = 5000, components = 12, joints = 6, answers = 1;
  bool udp = false;
};

using bench::Newest;
constexpr std::chrono::milliseconds kSilence{1000};

takt_msgs::msg::CellState state_of(const Options& options) {
  takt_msgs::msg::CellState state;
  state.components.resize(static_cast<std::size_t>(options.components));
  state.robots.resize(2);
  for (auto& robot : state.robots)
    robot.position.resize(static_cast<std::size_t>(options.joints)),
        robot.velocity = robot.effort = robot.position;
  state.grippers.resize(2);
  state.applied.resize(4);
  for (auto& applied : state.applied) applied.target = "Gripper1";
  return state;
}

/// The other side: answers every state until none comes any more.
int answer(const Options& options) {
  bench::RawNode node(options.domain, options.udp);
  Newest<takt_msgs::msg::CellState> states;
  node.reader<takt_msgs::msg::CellState>("states", qos_of(TopicQos::instant), states);
  auto* writer = node.writer<sensor_msgs::msg::JointState>("answers", qos_of(TopicQos::command));
  sensor_msgs::msg::JointState command;
  command.name.assign(static_cast<std::size_t>(options.joints), "shoulder_lift_joint");
  command.position.assign(static_cast<std::size_t>(options.joints), 0.5);
  command.velocity = command.position;
  for (std::uint64_t count = 0, silent = 0; silent < 3;) {
    if (!states.wait_beyond(count, kSilence)) {
      silent += count > 0 ? 1U : 0U;
      continue;
    }
    count = states.count();
    for (int i = 0; i < options.answers; ++i) writer->write(&command, dds::HANDLE_NIL);
  }
  return 0;
}

int ask(const Options& options) {
  bench::RawNode node(options.domain, options.udp);
  Newest<sensor_msgs::msg::JointState> answers;
  QosPolicy policy = qos_of(TopicQos::command);
  policy.depth = 100;
  node.reader<sensor_msgs::msg::JointState>("answers", policy, answers);
  auto* writer = node.writer<takt_msgs::msg::CellState>("states", qos_of(TopicQos::instant));
  takt_msgs::msg::CellState state = state_of(options);
  const auto expected = static_cast<std::uint64_t>(options.answers);
  do {  // until both sides have found each other
    writer->write(&state, dds::HANDLE_NIL);
  } while (!answers.wait_beyond(expected - 1, std::chrono::milliseconds(100)));
  std::vector<double> rounds_us;
  for (int i = 0; i < options.rounds; ++i) {
    const std::uint64_t before = answers.count();
    const auto began = Clock::now();
    writer->write(&state, dds::HANDLE_NIL);
    if (!answers.wait_beyond(before + expected - 1, kSilence)) continue;  // a lost sample
    rounds_us.push_back(std::chrono::duration<double, std::micro>(Clock::now() - began).count());
  }
  if (rounds_us.empty()) return 1;
  double sum = 0.0;
  for (const double round : rounds_us) sum += round;
  std::sort(rounds_us.begin(), rounds_us.end());
  std::printf("%s: state of %zu bytes, %d answers: median %.1f us, mean %.1f us, %zu rounds\n",
              options.udp ? "UDP" : "shared memory and UDP", cdr::size(state), options.answers,
              rounds_us[rounds_us.size() / 2], sum / static_cast<double>(rounds_us.size()), rounds_us.size());
  return 0;
}

}  // namespace
}  // namespace takt

int main(int argc, char** argv) {
  takt::Options options;
  CLI::App app("Plain Fast DDS: a state there, an answer back");
  app.add_option("--domain", options.domain, "DDS domain");
  app.add_option("--rounds", options.rounds, "rounds");
  app.add_option("--components", options.components, "components of the state");
  app.add_option("--joints", options.joints, "joints of the answer");
  app.add_option("--answers", options.answers, "answers to each state");
  app.add_flag("--udp", options.udp, "UDP alone; without it the transports that Fast DDS has by default");
  CLI11_PARSE(app, argc, argv);
  const pid_t child = fork();
  if (child == 0) _exit(takt::answer(options));
  const int result = takt::ask(options);
  int status = 0;
  waitpid(child, &status, 0);
  return result;
}
