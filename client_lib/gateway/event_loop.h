#pragma once
// Sockets and timers of a gateway: one thread runs all of them, so that a protocol's code needs no locks and an answer
// never waits for another thread. Boost.Asio does the work and stays in event_loop.cpp.
//
//   EventLoop loop;
//   auto port = loop.listen("127.0.0.2", 30004, [](std::shared_ptr<Connection> c) { ... });
//   loop.every(std::chrono::milliseconds(2), [] { ... });
//   loop.run();                                                // until stop()
//
// All functions but stop() and post() belong to the thread that runs the loop. Callbacks run in that thread and must
// not wait. An exception of a callback ends run(), which throws it.
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

namespace takt::gateway {

using Clock = std::chrono::steady_clock;

/// A socket that cannot be made. The sentence names address, port and reason.
class SocketError : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A TCP connection. It closes when its last owner lets go of it.
class Connection : public std::enable_shared_from_this<Connection> {
 public:
  struct Handlers {
    std::function<void(std::string_view bytes)>
        data;                        ///< as many as have come; messages are split and merged
    std::function<void()> closed{};  ///< once, by the other side or by an error, not by close()
  };
  virtual ~Connection() = default;
  /// Begins to read.
  virtual void start(Handlers handlers) = 0;
  /// Sends, in order, without waiting. A peer that leaves more than kMostWaiting bytes unread is closed.
  virtual void send(std::string_view bytes) = 0;
  /// Bytes that the system has not taken yet: a sender of states leaves one out instead of making a backlog.
  virtual std::size_t waiting() const = 0;
  virtual void close() = 0;
  /// Closes when everything is sent.
  virtual void finish() = 0;
  virtual bool is_open() const = 0;
  virtual std::string peer_address() const = 0;  ///< without its port
  virtual std::string own_address() const = 0;

  static constexpr std::size_t kMostWaiting = 4U << 20U;
};

/// A sender or receiver of datagrams.
struct Endpoint {
  std::string address;
  std::uint16_t port = 0;
  bool operator==(const Endpoint&) const = default;
};
inline std::string address_text(const Endpoint& endpoint) {
  return endpoint.address + " port " + std::to_string(endpoint.port);
}

class UdpSocket {
 public:
  using OnDatagram = std::function<void(std::string_view bytes, const Endpoint& from)>;
  virtual ~UdpSocket() = default;
  /// Begins to read; each datagram of at most 65507 bytes is one call.
  virtual void start(OnDatagram on_datagram) = 0;
  /// Sends at once; false where the system refused.
  virtual bool send(std::string_view bytes, const Endpoint& to) = 0;
  virtual std::uint16_t port() const = 0;
};

class EventLoop {
 public:
  EventLoop();
  ~EventLoop();
  EventLoop(const EventLoop&) = delete;
  EventLoop& operator=(const EventLoop&) = delete;

  void run();
  /// Runs callbacks until `done` is true after one of them, or the deadline has passed. Returns done().
  bool run_until(const std::function<bool()>& done, Clock::time_point deadline);
  /// Runs the callbacks that are due, without a wait.
  void poll();
  /// Ends run() and run_until(); any thread.
  void stop();
  bool stopped() const;
  /// Calls in the loop's thread; any thread.
  void post(std::function<void()> call);
  /// SIGINT and SIGTERM stop the loop.
  void stop_on_signals();

  /// From one period after now on. A late call is made once, and the schedule is kept.
  void every(std::chrono::nanoseconds period, std::function<void()> call);
  void after(std::chrono::nanoseconds delay, std::function<void()> call);

  using OnConnection = std::function<void(std::shared_ptr<Connection>)>;
  /// Listens at an IP address of this machine; port 0: any. At most `most` connections are open at once, others are
  /// closed at once. Returns the port. Throws SocketError.
  std::uint16_t listen(const std::string& address, std::uint16_t port, OnConnection on_connection,
                       std::size_t most = 32);
  /// Connects to a host; `done` gets nullptr after `attempts` failures with `pause` between them. Each attempt takes at
  /// most 2 s.
  void connect(const std::string& host, std::uint16_t port, int attempts, std::chrono::nanoseconds pause,
               OnConnection done);
  /// Throws SocketError.
  std::unique_ptr<UdpSocket> udp(const std::string& address, std::uint16_t port);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace takt::gateway
