// Sockets of gateways over loopback.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include "client_lib/gateway/event_loop.h"

namespace {

using takt::gateway::Clock;
using takt::gateway::Connection;
using takt::gateway::Endpoint;
using takt::gateway::EventLoop;
using takt::gateway::SocketError;

constexpr std::chrono::seconds kGenerous{60};
constexpr const char* kHere = "127.0.0.1";

/// Both ends of one connection; the loop keeps references to them.
void connect(EventLoop& loop, std::shared_ptr<Connection>& server, std::shared_ptr<Connection>& client) {
  const auto port = loop.listen(kHere, 0, [&server](auto connection) { server = std::move(connection); });
  loop.connect(kHere, port, 1, std::chrono::seconds(0),
               [&client](auto connection) { client = std::move(connection); });
  ASSERT_TRUE(loop.run_until([&] { return client && server; }, Clock::now() + kGenerous));
}

TEST(EventLoop, BytesArriveInOrderAndAClosedPeerIsReported) {
  EventLoop loop;
  std::shared_ptr<Connection> server;
  std::string received;
  bool closed = false;
  const auto port = loop.listen(kHere, 0, [&](std::shared_ptr<Connection> connection) {
    server = std::move(connection);
    server->start({[&](std::string_view bytes) { received.append(bytes); }, [&] { closed = true; }});
  });
  std::shared_ptr<Connection> client;
  loop.connect(kHere, port, 1, std::chrono::seconds(0),
               [&](auto connection) { client = std::move(connection); });
  ASSERT_TRUE(loop.run_until([&] { return client && server; }, Clock::now() + kGenerous));
  std::string sent;
  for (int i = 0; i < 1000; ++i) {
    const std::string part = std::to_string(i) + ",";
    sent += part;
    client->send(part);
  }
  EXPECT_TRUE(loop.run_until([&] { return received == sent; }, Clock::now() + kGenerous));
  client->finish();
  EXPECT_TRUE(loop.run_until([&] { return closed; }, Clock::now() + kGenerous));
  EXPECT_FALSE(server->is_open());
}

TEST(EventLoop, PollRunsWhatIsDueAndDoesNotWait) {
  EventLoop loop;
  std::shared_ptr<Connection> server, client;
  ASSERT_NO_FATAL_FAILURE(connect(loop, server, client));
  int posted = 0;
  loop.post([&] { ++posted; });
  loop.post([&] { ++posted; });
  EXPECT_FALSE(loop.run_until([] { return false; }, Clock::now()));
  EXPECT_EQ(posted, 0);
  loop.poll();
  EXPECT_EQ(posted, 2);
  loop.poll();  // the open connections wait for nothing that is due
  EXPECT_EQ(posted, 2);
}

TEST(EventLoop, APeerThatDoesNotReadIsClosed) {
  EventLoop loop;
  std::shared_ptr<Connection> server, client;
  ASSERT_NO_FATAL_FAILURE(connect(loop, server, client));
  const std::string block(1U << 20U, 'x');
  std::size_t sent = 0;
  while (client->is_open() && sent < 64 * block.size()) {
    client->send(block);
    sent += block.size();
  }
  EXPECT_FALSE(client->is_open());
  EXPECT_LE(sent, Connection::kMostWaiting + 2 * block.size());
}

TEST(EventLoop, FurtherConnectionsThanAllowedAreClosed) {
  EventLoop loop;
  std::vector<std::shared_ptr<Connection>> servers, clients;
  const auto port = loop.listen(
      kHere, 0, [&](auto connection) { servers.push_back(std::move(connection)); }, 1);
  int refused = 0;
  for (int i = 0; i < 2; ++i)
    loop.connect(kHere, port, 1, std::chrono::seconds(0), [&](std::shared_ptr<Connection> connection) {
      clients.push_back(connection);
      connection->start({[](std::string_view) {}, [&] { ++refused; }});
    });
  EXPECT_TRUE(loop.run_until([&] { return clients.size() == 2 && refused == 1; }, Clock::now() + kGenerous));
  EXPECT_EQ(servers.size(), 1U);
}

/// A port without a listener, which no other program gets.
class UnheardPort {
 public:
  UnheardPort() : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in place{};
    place.sin_family = AF_INET;
    place.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof(place);
    EXPECT_EQ(::bind(socket_, reinterpret_cast<const sockaddr*>(&place), size), 0);
    EXPECT_EQ(::getsockname(socket_, reinterpret_cast<sockaddr*>(&place), &size), 0);
    number_ = ntohs(place.sin_port);
  }
  ~UnheardPort() { ::close(socket_); }
  UnheardPort(const UnheardPort&) = delete;
  UnheardPort& operator=(const UnheardPort&) = delete;
  std::uint16_t number() const { return number_; }

 private:
  int socket_;
  std::uint16_t number_ = 0;
};

TEST(EventLoop, APortWithoutAListenerIsReportedAfterTheAttempts) {
  EventLoop loop;
  const UnheardPort port;
  bool called = false;
  loop.connect(kHere, port.number(), 3, std::chrono::milliseconds(1), [&](auto connection) {
    called = true;
    EXPECT_EQ(connection, nullptr);
  });
  EXPECT_TRUE(loop.run_until([&] { return called; }, Clock::now() + kGenerous));
}

TEST(EventLoop, AnAddressThatCannotBeUsedIsNamed) {
  EventLoop loop;
  try {
    loop.listen("nowhere", 1, [](auto) {});
    FAIL();
  } catch (const SocketError& error) {
    EXPECT_NE(std::string(error.what()).find("'nowhere'"), std::string::npos);
  }
  const auto port = loop.listen(kHere, 0, [](auto) {});
  EXPECT_THROW(loop.listen(kHere, port, [](auto) {}), SocketError);
}

TEST(EventLoop, DatagramsArriveWithTheirSender) {
  EventLoop loop;
  const auto a = loop.udp(kHere, 0), b = loop.udp(kHere, 0);
  std::string received;
  b->start([&](std::string_view bytes, const Endpoint& from) {
    received = bytes;
    b->send("answer", from);
  });
  std::string answer;
  a->start([&](std::string_view bytes, const Endpoint&) { answer = bytes; });
  EXPECT_TRUE(a->send("question", {kHere, b->port()}));
  EXPECT_TRUE(loop.run_until([&] { return !answer.empty(); }, Clock::now() + kGenerous));
  EXPECT_EQ(received, "question");
}

TEST(EventLoop, AnExceptionOfACallbackEndsTheRun) {
  EventLoop loop;
  loop.every(std::chrono::milliseconds(1), [] { throw std::runtime_error("from the callback"); });
  EXPECT_THROW(loop.run(), std::runtime_error);
}

}  // namespace
