// libFuzzer over the coders of gateways, which read what any client sends: TAKT_FUZZ_FORMAT rtde or urscript
// (./dev soak files). The input is cut into two parts, as TCP cuts it.
#include <cstdint>
#include <cstdlib>
#include <string>

#include "client_lib/gateway/rtde/client_session.h"
#include "client_lib/gateway/rtde/external_control.h"
#include "client_lib/gateway/rtde/server_session.h"
#include "client_lib/gateway/urscript/interpreter.h"
#include "client_lib/gateway/urscript/script.h"

namespace {

using namespace takt;

void fuzz_rtde(std::string_view first, std::string_view second) {
  const rtde::Table outputs = rtde::output_table(), inputs = rtde::input_table();
  rtde::InputOwners owners(inputs.variables().size());
  rtde::ServerSession server(outputs, inputs, owners, 1, {}, 0.002, [](const auto&) {});
  rtde::ClientSession client({"timestamp", "actual_q"}, {"input_double_register_24"}, 125.0);
  for (const std::string_view part : {first, second}) {
    server.receive(part);
    client.receive(part, [] {});
    for (std::uint64_t cycle = 0; cycle < 4; ++cycle) server.data(cycle);
  }
  rtde::Chopper reverse(rtde::ReverseMessage::kBytes), points(rtde::TrajectoryPoint::kBytes),
      commands(rtde::ScriptCommand::kBytes);
  for (rtde::Chopper* chopper : {&reverse, &points, &commands})
    for (const std::string_view part : {first, second}) chopper->add(part);
  while (const auto message = reverse.next()) (void)rtde::reverse_message(*message);
  while (const auto message = points.next()) (void)rtde::trajectory_point(*message);
  while (const auto message = commands.next()) (void)rtde::script_command(*message);
}

/// Everything succeeds at once; a value that comes from outside is a number.
class NoController final : public urscript::Host {
 public:
  urscript::Outcome call(const urscript::HostCall& call) override {
    if (call.function.kind == urscript::Function::Kind::moves && interpreter != nullptr)
      (void)interpreter->next_move(call.thread);
    return {call.begins && call.function.name == "sleep", 1.0};
  }
  std::optional<urscript::Value> foresee(const urscript::Function&,
                                         std::span<const urscript::Value>) override {
    return urscript::Value(1.0);
  }
  urscript::RoutinePointer statement_ahead(std::size_t) override { return nullptr; }
  void ended(std::uint64_t) override {}
  const urscript::Interpreter* interpreter = nullptr;
};

void run(const std::string& text) {
  constexpr int kCycles = 3;
  NoController host;
  urscript::Interpreter interpreter(urscript::parse_program(text).code, host);
  host.interpreter = &interpreter;
  for (int cycle = 0; cycle < kCycles && interpreter.advance(); ++cycle) {
  }
}

void fuzz_urscript(std::string_view first, std::string_view second) {
  urscript::ScriptStream stream;
  for (const std::string_view part : {first, second}) {
    stream.add(part);
    while (const auto text = stream.next()) {
      try {
        run(*text);
      } catch (const urscript::ScriptError&) {  // the refusal of a program, or its error
      }
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const char* format = std::getenv("TAKT_FUZZ_FORMAT");
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  const std::size_t cut = size == 0 ? 0 : data[0] % size;
  if (format != nullptr && std::string_view(format) == "urscript")
    fuzz_urscript(bytes.substr(0, cut), bytes.substr(cut));
  else
    fuzz_rtde(bytes.substr(0, cut), bytes.substr(cut));
  return 0;
}
