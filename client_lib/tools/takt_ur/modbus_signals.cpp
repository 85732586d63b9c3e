#include "client_lib/tools/takt_ur/modbus_signals.h"

#include <algorithm>
#include <charconv>

#include "client_lib/gateway/event_loop.h"

namespace takt::ur {
namespace {

using gateway::modbus::Function;
using urscript::Value;
using urscript::ValueError;

constexpr std::uint16_t kPort = 502;
constexpr double kFrequency_Hz = 10.0, kFastest_Hz = 125.0, kAnswer_s = 2.0, kRetry_s = 1.0;
constexpr int kLargestRegister = 65535, kMostCount = 123;

/// HOST:PORT; a port that is no number is that of Modbus.
std::pair<std::string, std::uint16_t> place_of(const std::string& server) {
  std::uint16_t port = kPort;
  const std::size_t colon = server.find(':');
  if (colon != std::string::npos)
    std::from_chars(server.data() + colon + 1, server.data() + server.size(), port);
  return {server.substr(0, colon), port};
}

}  // namespace

ModbusSignals::~ModbusSignals() {
  for (auto& [name, server] : servers_)
    if (server->connection) server->connection->close();
}

ModbusSignals::Signal& ModbusSignals::signal(const CallArguments& a) {
  const auto found = signals_.find(a.text(0));
  if (found == signals_.end())
    throw ValueError(std::string(a.function()) + ": no signal has the name '" + a.text(0).substr(0, 100) +
                     "'; modbus_add_signal adds one");
  return found->second;
}

Value ModbusSignals::call(const CallArguments& a) {
  const std::string_view f = a.function();
  if (f == "modbus_add_signal") {
    add(a);
  } else if (f == "modbus_delete_signal") {
    (void)signal(a);
    signals_.erase(a.text(0));
  } else if (f == "modbus_get_error") {
    return signal(a).error;
  } else if (f == "modbus_get_time_since_signal_invalid") {
    const Signal& one = signal(a);
    return one.error == 0 ? 0.0 : cycle_s_ * static_cast<double>(cycle_ - one.valid_cycle);
  } else if (f == "modbus_get_signal_status") {
    return value_of(signal(a));
  } else if (f == "modbus_set_signal_update_frequency") {
    set_period(a);
  } else if (f == "modbus_request_update_signal_value") {
    signal(a).wanted = true;
  } else if (f == "modbus_send_custom_command") {
    const std::vector<double> data =
        a[3].list() != nullptr ? urscript::numbers_of(a[3]) : std::vector<double>();
    if (!(a.number(2) >= 1.0 && a.number(2) <= 127.0) || data.size() >= gateway::modbus::kMostPdu_bytes)
      a.fail("(IP, slave_number, function_code from 1 to 127, a list of at most 252 bytes)");
    std::string pdu(1, static_cast<char>(a.number(2)));
    for (const double one : data)
      pdu += static_cast<char>(static_cast<unsigned>(std::clamp(one, 0.0, 255.0)));
    ask(a.text(0), {"", static_cast<std::uint8_t>(std::clamp(a.number(1), 0.0, 255.0)), std::move(pdu)});
  } else {
    write(a, f == "modbus_set_output_register");
  }
  return {};
}

Value ModbusSignals::value_of(const Signal& signal) {
  std::vector<Value> values;
  for (const int one : signal.values) values.push_back(signal.is_digital() ? Value(one != 0) : Value(one));
  return values.size() == 1 ? values.front() : Value::list(std::move(values));
}

void ModbusSignals::set_period(const CallArguments& a) {
  Signal& one = signal(a);
  const double frequency_Hz = a.number(1);
  one.cyclic = frequency_Hz != 0.0 && frequency_Hz != -1.0;
  if (!one.cyclic) return;
  if (!(frequency_Hz > 0.0)) a.fail("a frequency > 0 Hz; 0 or -1: on request alone");
  one.period_cycles = static_cast<std::uint64_t>(
      std::max(1.0, std::ceil(1.0 / (std::clamp(frequency_Hz, 0.01, kFastest_Hz) * cycle_s_) - 1e-9)));
}

void ModbusSignals::add(const CallArguments& a) {
  constexpr int kMultipleCoils = 15, kMultipleRegisters = 16;
  const std::string& name = a.text(4);
  const auto whole = [&](std::size_t i, double least, double most) {
    const double number = a.number(i);
    if (number != std::floor(number) || number < least || number > most)
      a.fail(
          "(IP, slave_number 0 to 255, signal_address 0 to 65535, signal_type 0 to 3, 15 or 16, a name, "
          "False or True, register_count 1 to 123)");
    return static_cast<int>(number);
  };
  if (name.empty()) a.fail("(.., a name)");
  if (signals_.size() >= kMostSignals && signals_.count(name) == 0)
    a.fail("at most " + std::to_string(kMostSignals) + " signals; modbus_delete_signal frees one");
  Signal added{a.text(0), static_cast<std::uint8_t>(whole(1, 0, 255)),
               static_cast<std::uint16_t>(whole(2, 0, 65535))};
  const double type = a.number(3);
  added.multiple = type == kMultipleCoils || type == kMultipleRegisters;
  added.kind = type == kMultipleCoils       ? Kind::digital_output
               : type == kMultipleRegisters ? Kind::register_output
                                            : static_cast<Kind>(whole(3, 0, 3));
  if (a.given(6)) added.values.assign(static_cast<std::size_t>(whole(6, 1, kMostCount)), 0);
  added.period_cycles = static_cast<std::uint64_t>(std::ceil(1.0 / (kFrequency_Hz * cycle_s_) - 1e-9));
  added.next_cycle = added.valid_cycle = cycle_;
  (void)server(added.server);
  signals_.insert_or_assign(name, std::move(added));
}

void ModbusSignals::write(const CallArguments& a, bool is_register) {
  Signal& one = signal(a);
  if (one.kind != (is_register ? Kind::register_output : Kind::digital_output))
    throw ValueError(std::string(a.function()) + ": '" + a.text(0) + "' is no " +
                     (is_register ? "register output (type 3 or 16)" : "digital output (type 1 or 15)"));
  const std::vector<Value> values = a[1].list() != nullptr ? a[1].list()->values : std::vector<Value>{a[1]};
  const std::string allowed = "at most " + std::to_string(one.values.size()) +
                              (is_register ? " whole numbers from -32768 to 65535" : " of True and False");
  if (values.empty() || values.size() > one.values.size()) a.fail(allowed);
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!is_register) {
      if (values[i].flag() == nullptr) a.fail(allowed);
      one.values[i] = *values[i].flag() ? 1 : 0;
      continue;
    }
    const double value = values[i].is_number() ? values[i].number() : -1e9;
    if (value != std::floor(value) || value < -32768.0 || value > kLargestRegister) a.fail(allowed);
    one.values[i] = static_cast<int>(value) & kLargestRegister;
  }
  one.written = true;
  ask(one.server, {a.text(0), one.unit, request_of(one)});
}

/// Reads it, or writes what the program has set.
std::string ModbusSignals::request_of(const Signal& signal) {
  constexpr std::array<Function, 4> kReads{Function::read_discrete_inputs, Function::read_coils,
                                           Function::read_input_registers, Function::read_holding_registers};
  if (!signal.written)
    return gateway::modbus::read_request(kReads.at(static_cast<std::size_t>(signal.kind)), signal.address,
                                         signal.values.size());
  if (signal.is_digital())
    return gateway::modbus::write_coils_request(signal.address, {signal.values.begin(), signal.values.end()});
  if (signal.values.size() == 1 && !signal.multiple)  // the value has the place of the count
    return gateway::modbus::read_request(Function::write_register, signal.address,
                                         static_cast<std::size_t>(signal.values.front()));
  return gateway::modbus::write_registers_request(signal.address,
                                                  {signal.values.begin(), signal.values.end()});
}

void ModbusSignals::drop_unused() {
  for (auto at = servers_.begin(); at != servers_.end();) {
    const std::string& name = at->first;
    const auto& server = at->second;
    const bool used = !server->requests.empty() || std::ranges::any_of(signals_, [&name](const auto& signal) {
      return signal.second.server == name;
    });
    if (!used && server->connection) server->connection->close();
    at = used ? std::next(at) : servers_.erase(at);
  }
}

ModbusSignals::Server& ModbusSignals::server(const std::string& name) {
  const auto full = [&] { return servers_.size() >= kMostServers && servers_.count(name) == 0; };
  if (full()) drop_unused();
  if (full())
    throw ValueError("modbus: at most " + std::to_string(kMostServers) +
                     " servers; modbus_delete_signal frees one");
  ServerPointer& held = servers_[name];
  if (!held) held = std::make_shared<Server>();
  return *held;
}

void ModbusSignals::ask(const std::string& name, Request request) {
  Server& asked = server(name);
  if (asked.requests.size() >= kMostRequests)
    throw ValueError("modbus: more than " + std::to_string(kMostRequests) + " requests wait for " + name);
  asked.requests.push_back(std::move(request));
}

void ModbusSignals::advance() {
  ++cycle_;
  for (auto& [name, one] : signals_) {
    std::deque<Request>& requests = servers_.at(one.server)->requests;
    const bool due = one.wanted || (one.cyclic && cycle_ >= one.next_cycle);
    if (one.asked || !due || requests.size() >= kMostRequests) continue;
    one.asked = true;
    one.wanted = false;
    one.next_cycle = cycle_ + one.period_cycles;
    requests.push_back({name, one.unit, request_of(one)});
  }
  for (const auto& [name, server] : servers_) serve(name, server);
}

void ModbusSignals::serve(const std::string& name, const ServerPointer& server) {
  const auto cycles = [this](double seconds) { return static_cast<std::uint64_t>(seconds / cycle_s_); };
  if (server->connecting || server->requests.empty()) return;
  if (!server->connection || !server->connection->is_open()) {
    if (server->sent) fail(*server);
    if (cycle_ < server->retry_cycle) return;
    server->retry_cycle = cycle_ + cycles(kRetry_s);
    connect(name, server);
    return;
  }
  if (server->sent) {
    if (cycle_ < server->sent_cycle + cycles(kAnswer_s)) return;
    server->connection->close();  // a late answer would be that of another request
    fail(*server);
    return;
  }
  const Request& next = server->requests.front();
  server->connection->send(gateway::modbus::encode({++server->transaction, next.unit, next.pdu}));
  server->sent = true;
  server->sent_cycle = cycle_;
}

void ModbusSignals::connect(const std::string& name, const ServerPointer& server) {
  const auto [host, port] = place_of(name);
  server->connecting = true;
  loop_.connect(host, port, 1, std::chrono::seconds(0),
                [this, weak = std::weak_ptr(server)](std::shared_ptr<gateway::Connection> connection) {
                  const auto me = weak.lock();
                  if (!me) return;
                  me->connecting = false;
                  me->connection = std::move(connection);
                  me->stream = {};
                  if (!me->connection) {
                    fail(*me);
                    return;
                  }
                  me->connection->start({[this, weak](std::string_view bytes) {
                                           const auto mine = weak.lock();
                                           if (!mine) return;
                                           mine->stream.add(bytes);
                                           take(*mine);
                                         },
                                         {}});
                });
}

void ModbusSignals::take(Server& server) {
  while (const auto frame = server.stream.next()) {
    if (!server.sent || frame->transaction != server.transaction) continue;
    const Request request = std::move(server.requests.front());
    server.requests.pop_front();
    server.sent = false;
    const auto reply = gateway::modbus::parse_reply(request.pdu, frame->pdu);
    const auto found = signals_.find(request.signal);
    if (found == signals_.end()) continue;
    Signal& one = found->second;
    one.asked = false;
    one.error = !reply.fault.empty() ? kNoAnswer : reply.exception;
    if (one.error != 0) continue;
    one.valid_cycle = cycle_;
    if (one.written) continue;  // what the program has set counts
    if (!reply.bits.empty())
      one.values.assign(reply.bits.begin(), reply.bits.end());
    else if (!reply.registers.empty())
      one.values.assign(reply.registers.begin(), reply.registers.end());
  }
  if (!server.stream.fault().empty() && server.connection) server.connection->close();
}

void ModbusSignals::fail(Server& server) {
  server.sent = false;
  if (server.requests.empty()) return;
  if (const auto found = signals_.find(server.requests.front().signal); found != signals_.end()) {
    found->second.asked = false;
    found->second.error = kNoAnswer;
  }
  server.requests.pop_front();
}

}  // namespace takt::ur
