#pragma once
// A controller for programs of URScript: it keeps what they say, waits as long as they sleep, and answers with the values of a test.
#include <algorithm>
#include <cmath>
#include <map>

#include "client_lib/gateway/urscript/interpreter.h"
#include "client_lib/gateway/urscript/script.h"

namespace takt::urscript {

class RecordingHost final : public Host {
 public:
  Outcome call(const HostCall& call) override {
    const std::string name(call.function.name);
    if (name == "textmsg") {
      messages.push_back(text_of(call.arguments[0]) +
                         (call.arguments[1].is_none() ? "" : text_of(call.arguments[1])));
      return {};
    }
    if (name == "sleep" || name == "sync") {
      if (name == "sleep" && !call.arguments[0].is_number()) throw ValueError("sleep: allowed: a number");
      if (call.begins)
        wake_[call.thread] =
            cycle + (name == "sync"
                         ? 1
                         : static_cast<int>(std::ceil(std::min(call.arguments[0].number(), 1e3) / 0.002)));
      return {cycle < wake_.at(call.thread)};
    }
    std::string text = name;
    for (const Value& argument : call.arguments) text += " " + text_of(argument);
    calls.push_back(text);
    const auto answer = answers.find(name);
    return {false, answer == answers.end() ? Value() : answer->second};
  }
  std::optional<Value> foresee(const Function&, std::span<const Value>) override { return std::nullopt; }
  RoutinePointer statement_ahead(std::size_t) override { return nullptr; }
  void ended(std::uint64_t) override { ++threads_ended; }

  std::vector<std::string> messages, calls;
  std::map<std::string, Value> answers;
  int cycle = 0, threads_ended = 0;

 private:
  std::map<std::uint64_t, int> wake_;
};

/// Runs a program to its end; what it said with textmsg. Throws ScriptError, also where it has not ended after `cycles`.
inline std::vector<std::string> run_script(const std::string& text, RecordingHost& host,
                                           int cycles = 10'000) {
  Interpreter interpreter(parse_program(text).code, host);
  while (interpreter.advance())
    if (++host.cycle >= cycles) throw ScriptError(0, 0, "the program does not end");
  return host.messages;
}
inline std::vector<std::string> run_script(const std::string& text) {
  RecordingHost host;
  return run_script(text, host);
}

}  // namespace takt::urscript
