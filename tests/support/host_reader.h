#pragma once
// A CellHost without any transport, its replies and events read in the test's own thread, and a small
// scenario for it. Waiting is for a condition; the limit exists only so that a broken host fails a test
// instead of hanging it.
#include <gtest/gtest.h>

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/runtime/host/cell_host.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/text_requests.h"

namespace takt::test {

/// Parts A and B, cubes far from each other in a world without gravity.
inline std::filesystem::path write_two_cubes(const TemporaryDirectory& directory) {
  directory.write("cube.obj",
                  "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"
                  "f 1 4 3\nf 1 3 2\nf 5 6 7\nf 5 7 8\nf 1 2 6\nf 1 6 5\nf 2 3 7\nf 2 7 6\nf 3 4 8\nf 3 8 7\n"
                  "f 4 1 5\nf 4 5 8\n");
  directory.write("cubes.yaml",
                  "takt_scenario: 1\nname: cubes\nduration_s: 0.05\nworld: {gravity_m_per_s2: [0, 0, 0]}\n"
                  "solver: {method: rk2, step_s: 0.001}\nparts:\n"
                  "  A: {mesh: cube.obj, mass_kg: 1, hierarchy: 2, twist: {velocity_m_per_s: [0.1, 0, 0]}}\n"
                  "  B: {mesh: cube.obj, mass_kg: 2, hierarchy: 3, pose: {position_m: [0, 100, 0]}}\n");
  return directory / "cubes.yaml";
}

inline HostOptions free_running(bool paused = true) {
  HostOptions options;
  options.loop.pace = Pace::free;
  if (paused) options.loop.state = SimulationState::paused;
  return options;
}

class HostReader {
 public:
  explicit HostReader(CellHost& host) : host_(host) {}

  bool wait_until(const std::function<bool()>& condition) {
    const std::int64_t limit = monotonic_now_ns() + 60'000'000'000;
    for (;;) {
      for (ControlReply& reply : host_.outbound().take_replies()) replies.push_back(std::move(reply));
      for (DiagnosticEvent& event : host_.outbound().events.take().events) events.push_back(std::move(event));
      if (condition()) return true;
      if (monotonic_now_ns() > limit) return false;
      host_.outbound().news.wait_until_ns(monotonic_now_ns() + 10'000'000);
    }
  }
  ControlReply request(const std::string& name, const TextArguments& arguments = {}) {
    const std::uint64_t id = ++newest_id_;
    host_.submit(text_request(id, name, arguments));
    ControlReply found{0, ControlResult::failed, "no reply"};
    wait_until([&] {
      for (const ControlReply& reply : replies)
        if (reply.id == id) found = reply;
      return found.id == id;
    });
    expect_declared_result(name, found);
    return found;
  }
  /// The first event of that code, waited for.
  DiagnosticEvent event(const std::string& code) {
    DiagnosticEvent found;
    wait_until([&] {
      for (auto event = events.rbegin(); event != events.rend(); ++event)
        if (event->code == code) found = *event;
      return !found.code.empty();
    });
    return found;
  }
  bool has(const std::string& code) const {
    for (const DiagnosticEvent& event : events)
      if (event.code == code) return true;
    return false;
  }

  std::vector<ControlReply> replies;
  std::vector<DiagnosticEvent> events;

 private:
  CellHost& host_;
  std::uint64_t newest_id_ = 0;
};

inline void expect_reply(const ControlReply& reply, ControlResult result, const std::string& words) {
  EXPECT_EQ(reply.result, result) << reply.message;
  EXPECT_NE(reply.message.find(words), std::string::npos) << words << " is not in: " << reply.message;
}

}  // namespace takt::test
