#include "client_lib/gateway/event_loop.h"

#include <array>
#include <boost/asio/bind_executor.hpp>
#include <boost/asio/buffer.hpp>
#include <boost/asio/connect.hpp>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ip/udp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/write.hpp>
#include <csignal>

namespace takt::gateway {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using asio::ip::udp;
using boost::system::error_code;

constexpr std::chrono::seconds kConnectTime{2};

class TcpConnection final : public Connection {
 public:
  TcpConnection(tcp::socket socket, std::shared_ptr<std::size_t> open)
      : socket_(std::move(socket)), open_(std::move(open)) {
    error_code ignored;
    socket_.set_option(tcp::no_delay(true), ignored);
    if (const auto peer = socket_.remote_endpoint(ignored); !ignored) peer_ = peer.address().to_string();
    if (const auto own = socket_.local_endpoint(ignored); !ignored) own_ = own.address().to_string();
    ++*open_;
  }
  TcpConnection(const TcpConnection&) = delete;
  TcpConnection& operator=(const TcpConnection&) = delete;
  ~TcpConnection() override { --*open_; }

  void start(Handlers handlers) override {
    handlers_ = std::move(handlers);
    read();
  }
  void send(std::string_view bytes) override {
    if (!socket_.is_open()) return;
    if (waiting() + bytes.size() > kMostWaiting) {
      fail();
      return;
    }
    next_.append(bytes);
    if (sending_.empty()) write();
  }
  std::size_t waiting() const override { return sending_.size() + next_.size(); }
  void close() override {
    error_code ignored;
    if (socket_.is_open()) socket_.shutdown(tcp::socket::shutdown_both, ignored);
    socket_.close(ignored);
    handlers_ = {};
  }
  void finish() override {
    finishing_ = true;
    if (waiting() == 0) close();
  }
  bool is_open() const override { return socket_.is_open(); }
  std::string peer_address() const override { return peer_; }
  std::string own_address() const override { return own_; }

 private:
  std::shared_ptr<TcpConnection> self() {
    return std::static_pointer_cast<TcpConnection>(shared_from_this());
  }
  void read() {
    // The loop holds no connection that has no owner: a weak pointer, and the buffer lives as long as the operation.
    auto buffer = std::make_shared<std::array<char, 16384>>();
    socket_.async_read_some(asio::buffer(*buffer), [weak = std::weak_ptr<TcpConnection>(self()), buffer](
                                                       const error_code& problem, std::size_t size) {
      const auto me = weak.lock();
      if (!me || !me->socket_.is_open()) return;
      if (problem) {
        me->fail();
        return;
      }
      if (const auto data = me->handlers_.data) data({buffer->data(), size});
      if (me->socket_.is_open()) me->read();
    });
  }
  void write() {
    std::swap(sending_, next_);
    asio::async_write(socket_, asio::buffer(sending_), [me = self()](const error_code& problem, std::size_t) {
      me->sending_.clear();
      if (!me->socket_.is_open()) return;
      if (problem)
        me->fail();
      else if (!me->next_.empty())
        me->write();
      else if (me->finishing_)
        me->close();
    });
  }
  void fail() {
    const auto closed = handlers_.closed;
    close();
    if (closed) closed();
  }

  tcp::socket socket_;
  std::shared_ptr<std::size_t> open_;
  Handlers handlers_;
  std::string sending_, next_;
  bool finishing_ = false;
  std::string peer_, own_;
};

class AsioUdpSocket final : public UdpSocket {
 public:
  explicit AsioUdpSocket(udp::socket socket) : socket_(std::move(socket)) {}
  void start(OnDatagram on_datagram) override {
    on_datagram_ = std::move(on_datagram);
    read();
  }
  bool send(std::string_view bytes, const Endpoint& to) override {
    error_code problem;
    const auto address = asio::ip::make_address(to.address, problem);
    if (problem) return false;
    socket_.send_to(asio::buffer(bytes.data(), bytes.size()), udp::endpoint(address, to.port), 0, problem);
    return !problem;
  }
  std::uint16_t port() const override { return socket_.local_endpoint().port(); }

 private:
  void read() {
    socket_.async_receive_from(
        asio::buffer(buffer_), from_, [this](const error_code& problem, std::size_t size) {
          if (problem == asio::error::operation_aborted) return;  // destroyed
          // Other errors are those of earlier sends (a port without a listener); reading continues.
          if (!problem) on_datagram_({buffer_.data(), size}, {from_.address().to_string(), from_.port()});
          read();
        });
  }
  udp::socket socket_;
  OnDatagram on_datagram_;
  std::array<char, 65536> buffer_{};
  udp::endpoint from_;
};

asio::ip::address address_of(const std::string& text) {
  error_code problem;
  const auto address = asio::ip::make_address(text, problem);
  if (problem) throw SocketError("'" + text + "' is no IP address; allowed: e.g. 127.0.0.1, 0.0.0.0, ::1.");
  return address;
}

[[noreturn]] void cannot_bind(const std::string& address, std::uint16_t port, const error_code& problem) {
  throw SocketError("cannot listen at " + address + " port " + std::to_string(port) + ": " +
                    problem.message() +
                    "; another program may use the port, or the address is not one of this machine.");
}

}  // namespace

struct EventLoop::Impl {
  struct Repeated : std::enable_shared_from_this<Repeated> {
    Repeated(asio::io_context& io, std::chrono::nanoseconds every, std::function<void()> what)
        : timer(io), period(every), call(std::move(what)), next(Clock::now() + every) {}
    void arm() {
      timer.expires_at(next);
      timer.async_wait([me = shared_from_this()](const error_code& problem) {
        if (problem) return;
        me->next += me->period;
        const auto now = Clock::now();
        if (me->next < now) me->next += (now - me->next) / me->period * me->period;
        me->call();
        me->arm();
      });
    }
    asio::steady_timer timer;
    std::chrono::nanoseconds period;
    std::function<void()> call;
    Clock::time_point next;
  };
  struct Listener : std::enable_shared_from_this<Listener> {
    Listener(asio::io_context& io, OnConnection call, std::size_t limit)
        : acceptor(io), on_connection(std::move(call)), most(limit) {}
    void accept() {
      acceptor.async_accept([me = shared_from_this()](const error_code& problem, tcp::socket socket) {
        if (problem == asio::error::operation_aborted) return;
        if (!problem && *me->open < me->most)
          me->on_connection(std::make_shared<TcpConnection>(std::move(socket), me->open));
        me->accept();
      });
    }
    tcp::acceptor acceptor;
    OnConnection on_connection;
    std::size_t most;
    std::shared_ptr<std::size_t> open = std::make_shared<std::size_t>(0);
  };
  struct Connector : std::enable_shared_from_this<Connector> {
    explicit Connector(asio::io_context& io) : socket(io), timer(io), resolver(io) {}
    void attempt() {
      --left;
      settled = false;
      socket = tcp::socket(socket.get_executor());
      timer.expires_after(kConnectTime);
      timer.async_wait([me = shared_from_this()](const error_code& problem) {
        error_code ignored;
        if (!problem && !me->settled) me->socket.close(ignored);
        if (!problem && !me->settled) me->resolver.cancel();
      });
      resolver.async_resolve(host, std::to_string(port),
                             [me = shared_from_this()](const error_code& problem, const auto& found) {
                               if (problem) {
                                 me->settle(problem);
                                 return;
                               }
                               asio::async_connect(
                                   me->socket, found,
                                   [me](const error_code& failed, const auto&) { me->settle(failed); });
                             });
    }
    void settle(const error_code& problem) {
      settled = true;
      timer.cancel();
      if (!problem) {
        done(std::make_shared<TcpConnection>(std::move(socket), std::make_shared<std::size_t>(0)));
      } else if (left > 0) {
        timer.expires_after(std::chrono::duration_cast<Clock::duration>(pause));
        timer.async_wait([me = shared_from_this()](const error_code& stopped) {
          if (!stopped) me->attempt();
        });
      } else {
        done(nullptr);
      }
    }
    tcp::socket socket;
    asio::steady_timer timer;
    tcp::resolver resolver;
    std::string host;
    std::uint16_t port = 0;
    int left = 1;
    std::chrono::nanoseconds pause{};
    bool settled = false;
    OnConnection done;
  };

  asio::io_context io{1};
  asio::executor_work_guard<asio::io_context::executor_type> work = asio::make_work_guard(io);
  asio::signal_set signals{io};
};

EventLoop::EventLoop() : impl_(std::make_unique<Impl>()) {}
EventLoop::~EventLoop() = default;

void EventLoop::run() {
  impl_->io.run();
}

bool EventLoop::run_until(const std::function<bool()>& done, Clock::time_point deadline) {
  while (!done()) {
    if (impl_->io.run_one_until(deadline) == 0) return done();
  }
  return true;
}

void EventLoop::poll() {
  impl_->io.poll();
}

void EventLoop::stop() {
  impl_->io.stop();
}
bool EventLoop::stopped() const {
  return impl_->io.stopped();
}
void EventLoop::post(std::function<void()> call) {
  asio::post(impl_->io, std::move(call));
}

void EventLoop::stop_on_signals() {
  impl_->signals.add(SIGINT);
  impl_->signals.add(SIGTERM);
  impl_->signals.async_wait([this](const error_code& problem, int) {
    if (!problem) stop();
  });
}

void EventLoop::every(std::chrono::nanoseconds period, std::function<void()> call) {
  std::make_shared<Impl::Repeated>(impl_->io, period, std::move(call))->arm();
}

void EventLoop::after(std::chrono::nanoseconds delay, std::function<void()> call) {
  auto timer =
      std::make_shared<asio::steady_timer>(impl_->io, std::chrono::duration_cast<Clock::duration>(delay));
  timer->async_wait([timer, call = std::move(call)](const error_code& problem) {
    if (!problem) call();
  });
}

std::uint16_t EventLoop::listen(const std::string& address, std::uint16_t port, OnConnection on_connection,
                                std::size_t most) {
  const tcp::endpoint place(address_of(address), port);
  auto listener = std::make_shared<Impl::Listener>(impl_->io, std::move(on_connection), most);
  error_code problem;
  listener->acceptor.open(place.protocol(), problem);
  if (!problem) listener->acceptor.set_option(tcp::acceptor::reuse_address(true), problem);
  if (!problem) listener->acceptor.bind(place, problem);
  if (!problem) listener->acceptor.listen(tcp::acceptor::max_listen_connections, problem);
  if (problem) cannot_bind(address, port, problem);
  listener->accept();
  return listener->acceptor.local_endpoint().port();
}

void EventLoop::connect(const std::string& host, std::uint16_t port, int attempts,
                        std::chrono::nanoseconds pause, OnConnection done) {
  auto connector = std::make_shared<Impl::Connector>(impl_->io);
  connector->host = host;
  connector->port = port;
  connector->left = attempts;
  connector->pause = pause;
  connector->done = std::move(done);
  connector->attempt();
}

std::unique_ptr<UdpSocket> EventLoop::udp(const std::string& address, std::uint16_t port) {
  const udp::endpoint place(address_of(address), port);
  udp::socket socket(impl_->io);
  error_code problem;
  socket.open(place.protocol(), problem);
  if (!problem) socket.bind(place, problem);
  if (problem) cannot_bind(address, port, problem);
  return std::make_unique<AsioUdpSocket>(std::move(socket));
}

}  // namespace takt::gateway
