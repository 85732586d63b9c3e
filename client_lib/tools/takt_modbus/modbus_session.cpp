#include "client_lib/tools/takt_modbus/modbus_session.h"

#include <algorithm>
#include <functional>
#include <map>
#include <optional>

#include "client_lib/gateway/cell_link.h"
#include "client_lib/gateway/event_loop.h"
#include "client_lib/gateway/modbus/client_watch.h"
#include "client_lib/gateway/modbus/poller.h"
#include "client_lib/gateway/robot_follower.h"
#include "client_lib/gateway/throttle.h"
#include "client_lib/lockstep_controller.h"
#include "client_lib/tools/takt_modbus/modbus_mapping.h"
#include "idl/common/text.h"

namespace takt::tool {
namespace {

using namespace gateway;
using namespace std::chrono_literals;

constexpr const char* kProtocol = "Modbus TCP";
constexpr double kTimeTolerance_s = 1e-9;
/// How often deadlines and --until are looked at.
constexpr auto kWatch = 10ms;
constexpr auto kReconnect = 500ms;
constexpr auto kReplyTimeout = 1s;
/// How often a server in lockstep that waits for allow_step looks at its connections.
constexpr auto kAgain = 100ms;

CellLinkOptions link_options(const GatewayOptions& options, const ModbusMapping& m) {
  return {.name = options.name,
          .protocol = kProtocol,
          .period_s = m.period_s,
          .most_interval_s = 1.0,
          .needs_wall_time = false};
}

bool due(const GatewayOptions& options, const State& state) {
  return options.until_s && state.time >= *options.until_s - kTimeTolerance_s;
}

/// The values of the PLC that the cell has, and the sending of those that differ.
class CellOutputs {
 public:
  explicit CellOutputs(const ModbusMapping& m) : m_(m), sent_(m.elements.size()) {}
  void forget() { std::fill(sent_.begin(), sent_.end(), std::nullopt); }
  template <class Commands>
  void send(std::size_t element, double number, Commands& commands) {
    if (sent_[element] == number) return;
    sent_[element] = number;
    ModbusMapping::write(m_.elements[element], number, commands);
    ++changes_;
  }
  /// The safe values. `set` also gets them.
  template <class Commands>
  void substitute(Commands& commands, const std::function<void(std::size_t, double)>& set) {
    for (std::size_t i = 0; i < m_.elements.size(); ++i) {
      if (!m_.elements[i].substitute) continue;
      set(i, *m_.elements[i].substitute);
      send(i, *m_.elements[i].substitute, commands);
    }
  }
  std::uint64_t changes() const { return changes_; }

 private:
  const ModbusMapping& m_;
  std::vector<std::optional<double>> sent_;
  std::uint64_t changes_ = 0;
};

/// The server's side: connections, replies, and the memory. The owner gives instants and takes what was written.
class Server {
 public:
  Server(const GatewayOptions& options, const ModbusMapping& m, EventLoop& loop)
      : options_(options),
        m_(m),
        report_(options.name),
        table_(m.places()),
        watch_(m.deadline_s),
        port_(loop.listen(
            m.address, static_cast<std::uint16_t>(m.port),
            [this](std::shared_ptr<Connection> connection) { accept(std::move(connection)); },
            static_cast<std::size_t>(m.most_clients))) {
    report(options.name,
           "Listens at " + m.address + " port " + std::to_string(port_) + " for Modbus clients.");
  }

  /// Called before the requests of a client are served.
  std::function<void()> before_requests{};
  /// Called when the requests that have come with one packet are served.
  std::function<void()> after_requests{};

  modbus::Table& table() { return table_; }
  modbus::ClientWatch& watch() { return watch_; }
  /// Writes the values of an instant, so that one reply has values of one instant.
  void show(const State& state, bool playing) {
    for (std::size_t i = 0; i < m_.elements.size(); ++i) {
      const ModbusElement& e = m_.elements[i];
      if (!e.to_cell && !table_.set(i, ModbusMapping::number_of(e, state, playing)))
        report_("range " + e.name,
                "The value at address " + e.name +
                    " is beyond its type; the PLC reads the end of the range. A scale or a "
                    "larger type helps.");
    }
  }
  /// What the PLC commands has its present values: at the start and after a reset.
  void begin(const State& state) {
    for (std::size_t i = 0; i < m_.elements.size(); ++i)
      if (m_.elements[i].to_cell) table_.set(i, ModbusMapping::present_of(m_.elements[i], state));
    table_.take_written();
  }
  /// Late are deadlines that have passed without a request.
  PeerStatus peer(std::uint64_t late) const {
    return {connections_.empty() ? std::string() : connections_.begin()->second->peer_address(),
            !connections_.empty(), requests_, late};
  }
  std::string figures() const {
    return std::to_string(requests_) + " requests of " + std::to_string(accepted_) + " connections, " +
           std::to_string(refused_) + " refused.";
  }

 private:
  void accept(std::shared_ptr<Connection> connection) {
    const std::uint64_t id = ++accepted_;
    const std::string peer = connection->peer_address();
    auto stream = std::make_shared<modbus::FrameStream>();
    connections_.emplace(id, connection);
    Connection& each = *connection;
    each.start(
        {[this, id, peer, stream, &each](std::string_view bytes) { receive(id, peer, *stream, each, bytes); },
         [this, id] { close(id); }});
  }
  void close(std::uint64_t id) {
    watch_.closed(id);
    connections_.erase(id);
  }
  void receive(std::uint64_t id, const std::string& peer, modbus::FrameStream& stream, Connection& connection,
               std::string_view bytes) {
    const auto keep = connection.shared_from_this();
    stream.add(bytes);
    if (before_requests) before_requests();
    std::string replies;
    while (const auto frame = stream.next()) {
      ++requests_;
      watch_.heard(id, peer, modbus::is_write(frame->pdu), wall_s());
      const bool ours = m_.unit == 0 || frame->unit == m_.unit;
      const std::string reply = ours ? modbus::reply_to(frame->pdu, table_)
                                     : modbus::exception_reply(static_cast<std::uint8_t>(frame->pdu[0]),
                                                               modbus::Exception::no_such_unit);
      if ((static_cast<unsigned char>(reply[0]) & 0x80U) != 0) {
        ++refused_;
        report_("refused",
                "Function " + std::to_string(static_cast<unsigned char>(frame->pdu[0])) + " of " + peer +
                    " is refused: " + modbus::exception_text(static_cast<std::uint8_t>(reply[1])) + ".");
      }
      replies += modbus::encode({frame->transaction, frame->unit, reply});
    }
    if (!replies.empty()) connection.send(replies);
    if (after_requests) after_requests();
    if (stream.fault().empty()) return;
    report_("fault", "The connection of " + peer + " is closed: " + stream.fault() + ".");
    connection.finish();
    close(id);
  }

  const GatewayOptions& options_;
  const ModbusMapping& m_;
  ThrottledReport report_;
  modbus::Table table_;
  modbus::ClientWatch watch_;
  std::map<std::uint64_t, std::shared_ptr<Connection>> connections_;
  std::uint64_t accepted_ = 0, requests_ = 0, refused_ = 0;
  std::uint16_t port_;
};

/// The cell runs at its own pace.
class RealtimeServer {
 public:
  RealtimeServer(const GatewayOptions& options, const ModbusMapping& m)
      : options_(options), m_(m), outputs_(m), server_(options, m, loop_) {
    loop_.stop_on_signals();
  }

  int run(Client& client) {
    if (options_.start) set_realtime(client);
    CellLink link(client, link_options(options_, m_), m_.targets());
    if (options_.start) client.play();
    link.supervise();
    begin(*link.state());
    server_.before_requests = [&] {
      const auto state = link.state();
      if (state->epoch != epoch_) begin(*state);
      server_.show(*state, link.plays());
    };
    server_.after_requests = [&] {
      for (const std::size_t i : server_.table().take_written())
        outputs_.send(i, server_.table().number(i), link.sender());
    };
    loop_.every(kWatch, [&] {
      if (due(options_, *link.state())) loop_.stop();
      link.show(server_.peer(silences_));
      if (const auto silent = server_.watch().silent(wall_s())) {
        ++silences_;
        report(options_.name, "The client at " + *silent + " is silent; the substitute values apply.");
        outputs_.substitute(link.sender(),
                            [&](std::size_t i, double number) { server_.table().set(i, number); });
      }
    });
    bool failed = false;
    supervise_each_second(loop_, client, link, options_.name, failed);
    loop_.run();
    report(options_.name, server_.figures() + " " + link.figures());
    server_.before_requests = nullptr;
    server_.after_requests = nullptr;
    return failed ? 1 : 0;
  }

 private:
  void begin(const State& state) {
    epoch_ = state.epoch;
    outputs_.forget();
    server_.begin(state);
  }

  const GatewayOptions& options_;
  const ModbusMapping& m_;
  CellOutputs outputs_;
  EventLoop loop_;
  Server server_;
  std::uint32_t epoch_ = 0;
  std::uint64_t silences_ = 0;
};

/// The cell passes one period for each allow_step.
class LockstepServer {
 public:
  LockstepServer(const GatewayOptions& options, const ModbusMapping& m)
      : options_(options), m_(m), outputs_(m), server_(options, m, loop_) {
    loop_.stop_on_signals();
    for (std::size_t i = 0; i < m_.elements.size(); ++i)
      if (m_.elements[i].special == ModbusSpecial::allow_step) allow_ = i;
    if (!allow_)
      throw std::invalid_argument(
          "--lockstep: the mapping has no coil 'cell: allow_step', so that no step would pass");
    if (m_.targets().empty())
      throw std::invalid_argument("--lockstep: the mapping commands no gripper and no signal");
  }

  int run(Client& client) {
    LockstepOptions lockstep;
    lockstep.targets = m_.targets();
    lockstep.period_s = std::max(m_.period_s, client.cell()->step_size);
    lockstep.name = options_.name;
    lockstep.timeout = Seconds{86400.0};  // the longest that a server accepts
    lockstep.start = options_.start;
    if (!options_.start) client.set_pace(Pace::lockstep);
    LockstepController controller(client, lockstep);
    GatewayReporter reporter(client, options_.name, kProtocol, lockstep.targets);
    server_.begin(controller.state());
    server_.show(controller.state(), true);
    report(options_.name, "Waits for the coil allow_step at each " + number_text(lockstep.period_s) + " s.");
    std::uint64_t steps = 0;
    while (!loop_.stopped() && !due(options_, controller.state())) {
      const auto allowed = [&] { return server_.table().number(*allow_) != 0.0; };
      while (!allowed() && !loop_.stopped()) {
        reporter.set(server_.peer(0));
        loop_.run_until(allowed, Clock::now() + kAgain);
      }
      if (loop_.stopped()) break;
      for (const std::size_t i : server_.table().take_written())
        outputs_.send(i, server_.table().number(i), controller);
      server_.show(controller.advance(), true);
      server_.table().set(*allow_, 0.0);
      ++steps;
    }
    report(options_.name, server_.figures() + " " + std::to_string(steps) + " periods.");
    report(options_.name, "Ends at " + number_text(controller.state().time) +
                              " s of simulated time, state hash " +
                              hexadecimal_text(controller.state().state_hash) + ".");
    return 0;
  }
  /// For ClientOptions::while_waiting: lets signals end a wait for the cell.
  void poll() {
    loop_.poll();
    if (loop_.stopped()) throw ClientError(ClientError::Kind::timeout, "Ended by a signal.");
  }

 private:
  const GatewayOptions& options_;
  const ModbusMapping& m_;
  CellOutputs outputs_;
  EventLoop loop_;
  Server server_;
  std::optional<std::size_t> allow_{};
};

/// takt polls a PLC's server.
class PollingClient {
 public:
  PollingClient(const GatewayOptions& options, const ModbusMapping& m)
      : options_(options),
        m_(m),
        report_(options.name),
        outputs_(m),
        poller_(m.places(), reads_of(m), poller_options(m)) {
    loop_.stop_on_signals();
  }

  int run(Client& client) {
    if (options_.start) set_realtime(client);
    CellLink link(client, link_options(options_, m_), m_.targets());
    link_ = &link;
    if (options_.start) client.play();
    link.supervise();
    epoch_ = link.state()->epoch;
    completed_s_ = wall_s();
    connect();
    loop_.every(std::chrono::milliseconds(m_.poll_ms), [this] { cycle(); });
    loop_.every(kWatch, [this] { watch(); });
    bool failed = false;
    supervise_each_second(loop_, client, link, options_.name, failed);
    loop_.run();
    const modbus::Poller::Counters& counters = poller_.counters();
    report(options_.name, std::to_string(counters.cycles) + " cycles, " + std::to_string(counters.requests) +
                              " requests, " + std::to_string(counters.exceptions) + " exceptions, " +
                              std::to_string(late_) + " cycles left out because the PLC was late, " +
                              std::to_string(connections_) + " connections. " + link.figures());
    link_ = nullptr;
    return failed ? 1 : 0;
  }

 private:
  static std::vector<bool> reads_of(const ModbusMapping& m) {
    std::vector<bool> reads;
    for (const ModbusElement& element : m.elements) reads.push_back(element.to_cell);
    return reads;
  }
  static modbus::PollerOptions poller_options(const ModbusMapping& m) {
    return {.unit = static_cast<std::uint8_t>(m.unit), .combined = m.function_23};
  }

  void connect() {
    loop_.connect(m_.address, static_cast<std::uint16_t>(m_.port), 1, 0s,
                  [this](std::shared_ptr<Connection> connection) {
                    if (connection == nullptr) {
                      report_("unreachable", "The PLC at " + m_.address + " port " + std::to_string(m_.port) +
                                                 " does not answer.");
                      loop_.after(kReconnect, [this] { connect(); });
                      return;
                    }
                    connection_ = std::move(connection);
                    ++connections_;
                    report_("connected", "The PLC at " + m_.address + " port " + std::to_string(m_.port) +
                                             " is connected.");
                    poller_.restart();
                    connection_->start({[this](std::string_view bytes) { receive(bytes); },
                                        [this] { lose("it has closed the connection"); }});
                  });
  }
  void lose(const std::string& reason) {
    if (connection_ == nullptr) return;
    report_("lost", "The PLC is lost: " + reason + ".");
    connection_->close();
    loop_.after(kReconnect, [this] { connect(); });
    loop_.post([kept = std::move(connection_)] {});  // not destroyed in its own callback
    connection_ = nullptr;
    poller_.restart();
  }

  void cycle() {
    if (connection_ == nullptr) return;
    if (!poller_.idle()) {
      ++late_;
      return;
    }
    const auto state = link_->state();
    if (state->epoch != epoch_) {
      epoch_ = state->epoch;
      outputs_.forget();
    }
    std::vector<double> numbers(m_.elements.size(), 0.0);
    for (std::size_t i = 0; i < numbers.size(); ++i)
      if (!m_.elements[i].to_cell)
        numbers[i] = ModbusMapping::number_of(m_.elements[i], *state, link_->plays());
    begun_s_ = wall_s();
    connection_->send(poller_.begin(numbers));
  }
  void receive(std::string_view bytes) {
    const std::string next = poller_.receive(bytes);
    if (!poller_.fault().empty()) {
      lose("its reply has " + poller_.fault());
      return;
    }
    if (!next.empty()) {
      connection_->send(next);
    } else if (poller_.idle()) {
      complete();
    }
  }
  void complete() {
    completed_s_ = wall_s();
    silent_ = false;
    if (poller_.counters().exceptions != exceptions_) report_("exception", poller_.counters().exception);
    exceptions_ = poller_.counters().exceptions;
    for (std::size_t i = 0; i < m_.elements.size(); ++i)
      if (m_.elements[i].to_cell && poller_.known(i)) outputs_.send(i, poller_.number(i), link_->sender());
  }
  void watch() {
    if (due(options_, *link_->state())) loop_.stop();
    const double now_s = wall_s();
    link_->show({address_text(Endpoint{m_.address, static_cast<std::uint16_t>(m_.port)}),
                 connection_ != nullptr && !silent_, poller_.counters().cycles, late_});
    if (connection_ != nullptr && !poller_.idle() &&
        now_s - begun_s_ > std::chrono::duration<double>(kReplyTimeout).count())
      lose("no reply within 1 s");
    if (silent_ || now_s - completed_s_ < m_.deadline_s) return;
    silent_ = true;
    report(options_.name, "The PLC is silent; the substitute values apply.");
    outputs_.substitute(link_->sender(), [](std::size_t, double) {});
  }

  const GatewayOptions& options_;
  const ModbusMapping& m_;
  ThrottledReport report_;
  CellOutputs outputs_;
  modbus::Poller poller_;
  EventLoop loop_;
  std::shared_ptr<Connection> connection_;
  CellLink* link_ = nullptr;
  std::uint32_t epoch_ = 0;
  double begun_s_ = 0.0, completed_s_ = 0.0;
  bool silent_ = false;
  std::uint64_t late_ = 0, connections_ = 0, exceptions_ = 0;
};

}  // namespace

int run_modbus(const GatewayOptions& options) {
  std::function<void()> while_waiting;
  Client client(polled_by_this_thread(options.client, while_waiting));
  const auto cell = client.cell();
  const ModbusMapping mapping = read_modbus_mapping(options.mapping, *cell);
  if (mapping.role == ModbusRole::client) {
    if (options.lockstep)
      throw std::invalid_argument(
          "--lockstep: a PLC's server does not wait for the cell; allowed: with 'role: server'");
    return PollingClient(options, mapping).run(client);
  }
  if (!options.lockstep) return RealtimeServer(options, mapping).run(client);
  LockstepServer server(options, mapping);
  while_waiting = [&server] { server.poll(); };
  try {
    const int code = server.run(client);
    while_waiting = nullptr;
    return code;
  } catch (...) {
    while_waiting = nullptr;
    throw;
  }
}

}  // namespace takt::tool
