#include "client_lib/tools/takt_ur/servers.h"

#include <algorithm>

#include "client_lib/gateway/rtde/realtime.h"

namespace takt::ur {
namespace {

/// Cycles between two robot states of the primary interface: 10 Hz.
constexpr std::uint64_t kPrimaryCycles = 50;
/// A client that has this much unread gets no further data package until it has read.
constexpr std::size_t kUnread = 1U << 15U;
constexpr std::size_t kLongestLine = 4096;
constexpr int kPrimaryPort = 30001, kSecondaryPort = 30002, kRealtimePort = 30003, kInterpreterPort = 30020;
/// A read-only interface has the port of its interface and this.
constexpr int kReadOnlyOffset = 10;

std::uint16_t as_port(int number) {
  return static_cast<std::uint16_t>(number);
}

template <class List>
void drop_closed(List& list) {
  std::erase_if(list, [](const auto& one) { return !one->connection->is_open(); });
}

}  // namespace

struct Servers::Rtde {
  std::shared_ptr<gateway::Connection> connection;
  rtde::ServerSession session;
};
struct Servers::ScriptClient {
  std::shared_ptr<gateway::Connection> connection;
  urscript::ScriptStream scripts{};
};

Servers::Servers(gateway::EventLoop& loop, UrController& controller, const UrMapping& mapping)
    : controller_(controller), owners_(controller.inputs().variables().size()) {
  loop.listen(mapping.address, as_port(mapping.rtde_port), [this](auto c) { accept_rtde(std::move(c)); });
  listen(loop, mapping.address, mapping.primary_port, kPrimaryPort, primary_);
  listen(loop, mapping.address, mapping.secondary_port, kSecondaryPort, secondary_);
  listen(loop, mapping.address, mapping.realtime_port, kRealtimePort, realtime_);
  loop.listen(mapping.address, as_port(mapping.dashboard_port), [this](auto c) {
    c->send(rtde::kDashboardGreeting);
    accept_lines(std::move(c), [this](std::string_view line, const std::string& peer_address) {
      const auto reply = rtde::dashboard_reply(line, peer_address, controller_, dashboard_);
      return Reply{reply.line + "\n", reply.quit};
    });
  });
  if (mapping.primary_port == kPrimaryPort)
    loop.listen(mapping.address, as_port(kInterpreterPort), [this](auto c) {
      accept_lines(std::move(c), [this](std::string_view line, const std::string&) {
        while (!line.empty() && (line.back() == '\r' || line.back() == ' ')) line.remove_suffix(1);
        return line.empty() ? Reply{} : Reply{controller_.interpret(line) + "\n"};
      });
    });
  if (!mapping.robotiq.empty())
    loop.listen(mapping.address, as_port(mapping.robotiq_port), [this](auto c) {
      accept_lines(std::move(c), [this](std::string_view line, const std::string&) {
        return Reply{controller_.robotiq_answer(line)};
      });
    });
  controller.on_primary_message = [this](const std::string& message) {
    const auto clients = primary_;  // a client that is closed leaves the list
    for (const auto& client : clients) client->connection->send(message);
  };
}

Servers::~Servers() {
  controller_.on_primary_message = [](const std::string&) {};
}

void Servers::accept_rtde(std::shared_ptr<gateway::Connection> connection) {
  const auto [major, minor, bugfix] = controller_.mapping().version_numbers();
  const rtde::ControllerVersion version{static_cast<std::uint32_t>(major), static_cast<std::uint32_t>(minor),
                                        static_cast<std::uint32_t>(bugfix), 0};
  // A struct with a session, which cannot be moved.
  auto client = std::shared_ptr<Rtde>(new Rtde{
      connection, rtde::ServerSession(controller_.outputs(), controller_.inputs(), owners_, ++connections_,
                                      version, UrController::kCycle_s,
                                      [this](const auto& written) { controller_.take_inputs(written); })});
  rtde_.push_back(client);
  connection->start({[this, weak = std::weak_ptr<Rtde>(client)](std::string_view bytes) {
                       const auto me = weak.lock();
                       if (!me) return;
                       me->connection->send(me->session.receive(bytes));
                       if (!me->session.broken()) return;
                       controller_.log("An RTDE client at " + me->connection->peer_address() +
                                       " sent bytes that are no RTDE package; its connection is closed.");
                       me->connection->close();
                       drop_closed(rtde_);
                     },
                     [this] { drop_closed(rtde_); }});
}

void Servers::listen(gateway::EventLoop& loop, const std::string& address, int port, int standard_port,
                     ScriptClients& clients) {
  loop.listen(address, as_port(port),
              [this, &clients](auto c) { accept_scripts(std::move(c), clients, false); });
  if (port == standard_port)
    loop.listen(address, as_port(port + kReadOnlyOffset),
                [this, &clients](auto c) { accept_scripts(std::move(c), clients, true); });
}

void Servers::accept_scripts(std::shared_ptr<gateway::Connection> connection, ScriptClients& clients,
                             bool read_only) {
  auto client = std::make_shared<ScriptClient>(ScriptClient{connection});
  clients.push_back(client);
  if (&clients != &realtime_) {
    connection->send(controller_.primary_version());
    connection->send(controller_.primary_state());
  }
  connection->start({[this, &clients, read_only, weak = std::weak_ptr(client)](std::string_view bytes) {
                       const auto me = weak.lock();
                       if (!me || read_only) return;
                       me->scripts.add(bytes);
                       while (const auto text = me->scripts.next()) controller_.take_script(*text);
                       if (me->scripts.broken()) {
                         controller_.log("A program of more than 1 MB was refused.");
                         me->connection->close();
                         drop_closed(clients);
                       }
                     },
                     [&clients] { drop_closed(clients); }});
}

void Servers::accept_lines(std::shared_ptr<gateway::Connection> connection, Answer answer) {
  line_clients_.push_back(connection);
  connection->start(
      {[weak = std::weak_ptr(connection), buffer = std::make_shared<std::string>(),
        answer = std::move(answer)](std::string_view bytes) {
         const auto me = weak.lock();
         if (!me) return;
         buffer->append(bytes);
         for (std::size_t end; (end = buffer->find('\n')) != std::string::npos && me->is_open();) {
           const Reply reply = answer(std::string_view(*buffer).substr(0, end), me->peer_address());
           buffer->erase(0, end + 1);
           if (!reply.bytes.empty()) me->send(reply.bytes);
           if (reply.quit) me->finish();
         }
         if (buffer->size() > kLongestLine) me->close();
       },
       [this] { std::erase_if(line_clients_, [](const auto& c) { return !c->is_open(); }); }});
}

gateway::PeerStatus Servers::peer(std::uint64_t missed) const {
  return {rtde_.empty() ? std::string() : rtde_.front()->connection->peer_address(), !rtde_.empty(), sent_,
          missed + left_out_};
}

bool Servers::publish() {
  const std::uint64_t before = sent_;
  const auto clients = rtde_;  // a client that is closed leaves the list
  for (const auto& client : clients) {
    const std::string package = client->session.data(controller_.cycle());
    if (package.empty()) continue;
    if (client->connection->waiting() > kUnread) {
      ++left_out_;
    } else {
      client->connection->send(package);
      ++sent_;
    }
  }
  if (!realtime_.empty()) {
    const std::string package =
        rtde::realtime_package(controller_.outputs(), controller_.mapping().version_numbers()[1]);
    const auto readers = realtime_;
    for (const auto& client : readers)
      if (client->connection->waiting() < kUnread) client->connection->send(package);
  }
  if (controller_.cycle() % kPrimaryCycles != 0) return sent_ > before;
  const std::string state = controller_.primary_state();
  for (const ScriptClients& readers : {primary_, secondary_})  // copies, as above
    for (const auto& client : readers)
      if (client->connection->waiting() < kUnread) client->connection->send(state);
  drop_closed(rtde_);
  drop_closed(primary_);
  drop_closed(secondary_);
  drop_closed(realtime_);
  std::erase_if(line_clients_, [](const auto& c) { return !c->is_open(); });
  return sent_ > before;
}

}  // namespace takt::ur
