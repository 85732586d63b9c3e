#pragma once
// Reads a RunLoop's output in the test's own thread. Waiting is for a condition; the limit exists only so
// that a broken loop fails a test instead of hanging it.
#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/runtime/loop/run_loop.h"
#include "server/runtime/monotonic_clock.h"
#include "tests/support/text_requests.h"

namespace takt::test {

class LoopReader {
 public:
  explicit LoopReader(RunLoop& loop) : loop_(loop) {}

  bool wait_until(const std::function<bool()>& condition) {
    const std::int64_t limit = monotonic_now_ns() + 60'000'000'000;
    for (;;) {
      read();
      if (condition()) return true;
      if (monotonic_now_ns() > limit) return false;
      loop_.output().news.wait_until_ns(monotonic_now_ns() + 10'000'000);
    }
  }

  std::uint64_t submit(const std::string& name, const TextArguments& arguments = {}) {
    auto parsed = parse(text_request(++newest_id_, name, arguments), &loop_.cell());
    if (auto* refusal = std::get_if<Refusal>(&parsed))
      replies.push_back({newest_id_, refusal->result, std::move(refusal->message)});
    else
      loop_.submit(newest_id_, std::get<requests::Any>(std::move(parsed)));
    return newest_id_;
  }
  std::optional<ControlReply> reply_to(std::uint64_t id) {
    std::optional<ControlReply> found;
    wait_until([&] {
      for (const auto& reply : replies) {
        if (reply.id == id) found = reply;
      }
      return found.has_value();
    });
    return found;
  }
  ControlReply request(const std::string& name, const TextArguments& arguments = {}) {
    ControlReply reply =
        reply_to(submit(name, arguments)).value_or(ControlReply{0, ControlResult::failed, "no reply"});
    expect_declared_result(name, reply);
    return reply;
  }

  std::optional<EventRecord> wait_for_event(std::string_view code) {
    std::optional<EventRecord> found;
    wait_until([&] {
      for (const auto& event : events) {
        if (info_of(event).code == code) found = event;
      }
      return found.has_value();
    });
    return found;
  }
  std::size_t count(std::string_view code) {
    std::size_t number = 0;
    for (const auto& event : events) number += info_of(event).code == code ? 1U : 0U;
    return number;
  }

  void read() {
    EventRecord event;
    while (loop_.output().events.pop(event)) events.push_back(event);
    if (const auto* taken = loop_.output().snapshots.take()) snapshot = *taken;
    if (const auto* taken = loop_.output().status.take()) status = *taken;
    for (auto& reply : loop_.output().outbound->take_replies()) replies.push_back(std::move(reply));
  }

  std::vector<EventRecord> events;
  std::vector<ControlReply> replies;
  std::optional<Snapshot> snapshot;
  std::optional<LoopStatus> status;

 private:
  RunLoop& loop_;
  std::uint64_t newest_id_ = 0;
};

/// A motion for a robot, as a function of time only, from the start pose of service_cell.h and inside all
/// limits.
inline JointCommand swing(int robot, double time_s) {
  JointCommand command;
  command.robot = robot;
  command.stamp = SimTime::from_seconds(time_s);
  command.position = {0.0, -1.5707963267948966, 1.5707963267948966, -1.5707963267948966, -1.5707963267948966,
                      0.0};
  command.position[0] += 0.2 * (1.0 - std::cos(3.0 * time_s));
  command.position[5] -= 0.1 * (1.0 - std::cos(5.0 * time_s + robot));
  command.has_velocity = true;
  command.velocity[0] = 0.6 * std::sin(3.0 * time_s);
  return command;
}

}  // namespace takt::test
