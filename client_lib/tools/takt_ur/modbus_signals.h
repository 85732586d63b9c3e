#pragma once
// Signals on Modbus TCP servers that programs of URScript have added (modbus_add_signal): each is read in its period, outputs are
// written in it from the first time on that a program sets them. Programs read the newest value and never wait. Signals outlive
// their program, as on the real controller.
#include <deque>
#include <map>

#include "client_lib/gateway/modbus/messages.h"
#include "client_lib/tools/takt_ur/call_arguments.h"

namespace takt::gateway {
class Connection;
class EventLoop;
}  // namespace takt::gateway

namespace takt::ur {

class ModbusSignals {
 public:
  static constexpr std::size_t kMostSignals = 200, kMostServers = 32, kMostRequests = 1000;

  ModbusSignals(gateway::EventLoop& loop, double cycle_s) : loop_(loop), cycle_s_(cycle_s) {}
  ~ModbusSignals();
  ModbusSignals(const ModbusSignals&) = delete;
  ModbusSignals& operator=(const ModbusSignals&) = delete;

  /// A function modbus_..; throws urscript::ValueError. modbus_get_error: 0, the code of the server's exception, or kNoAnswer.
  urscript::Value call(const CallArguments& arguments);
  static constexpr int kNoAnswer = -1;
  /// One cycle of the controller.
  void advance();

 private:
  enum class Kind : std::uint8_t { digital_input, digital_output, register_input, register_output };
  struct Signal {
    std::string server{};  ///< HOST or HOST:PORT
    std::uint8_t unit = 0;
    std::uint16_t address = 0;
    Kind kind = Kind::digital_input;
    bool multiple = false;       ///< a register is written by function 16, not 6
    std::vector<int> values{0};  ///< of the coils or registers from the address on
    int error = kNoAnswer;
    std::uint64_t period_cycles = 1, next_cycle = 0, valid_cycle = 0;
    bool cyclic = true, wanted = false;  ///< wanted: once, beside the period
    bool asked = false;                  ///< a request of it waits for an answer
    bool written = false;                ///< a program has set it
    bool is_digital() const { return kind == Kind::digital_input || kind == Kind::digital_output; }
  };
  struct Request {
    std::string signal{};  ///< that the answer fills; empty: none
    std::uint8_t unit = 0;
    std::string pdu{};
  };
  /// One request at a time, since many devices take no more.
  struct Server {
    std::shared_ptr<gateway::Connection> connection{};
    gateway::modbus::FrameStream stream{};
    std::deque<Request> requests{};
    std::uint16_t transaction = 0;
    bool connecting = false, sent = false;
    std::uint64_t sent_cycle = 0, retry_cycle = 0;
  };
  using ServerPointer = std::shared_ptr<Server>;

  void add(const CallArguments& arguments);
  void write(const CallArguments& arguments, bool is_register);
  void set_period(const CallArguments& arguments);
  static urscript::Value value_of(const Signal& signal);
  static std::string request_of(const Signal& signal);
  Signal& signal(const CallArguments& arguments);
  /// Makes it for its first signal or request. Throws where too many are in use.
  Server& server(const std::string& name);
  void drop_unused();
  void ask(const std::string& name, Request request);
  void serve(const std::string& name, const ServerPointer& server);
  void connect(const std::string& name, const ServerPointer& server);
  void take(Server& server);
  void fail(Server& server);

  gateway::EventLoop& loop_;
  const double cycle_s_;
  std::uint64_t cycle_ = 0;
  std::map<std::string, Signal, std::less<>> signals_;
  std::map<std::string, ServerPointer, std::less<>> servers_;
};

}  // namespace takt::ur
