#include "client_lib/view/web_server.h"

#include <algorithm>
#include <array>
#include <boost/asio/bind_executor.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <deque>
#include <map>
#include <mutex>
#include <set>
#include <thread>
#include <vector>

#include "client_lib/view/web_request.h"

namespace takt::view {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using asio::ip::tcp;
using boost::system::error_code;

namespace {

constexpr std::size_t kMaxSessions = 200;
constexpr std::size_t kMaxRequests = 200;  ///< connections that are not, or not yet, sessions
constexpr std::chrono::milliseconds kAcceptPause{100};
constexpr std::size_t kLongestMessage_bytes = 1U << 20U;
constexpr std::size_t kKeptBuffer_bytes = 1U << 16U;
// Of one session: what is on its way to one that does not read, and what it has asked and is not answered
// yet.
constexpr std::size_t kMaxWaiting = 4000;
constexpr std::size_t kMaxSaid_bytes = 32U << 20U;
constexpr std::size_t kMaxAsked = 100;
// Of all, those that have gone since included.
constexpr std::size_t kMaxCalls = 1000;
constexpr std::size_t kMaxCalls_bytes = 32U << 20U;

}  // namespace

struct WebServer::Impl final : WebRequest::Sessions {
  class Session;

  Impl(Stream& s, WebOptions o, Control c) : stream(s), options(std::move(o)), control(std::move(c)) {}

  void listen();
  void accept();
  void welcome(tcp::socket&& socket);
  void run();
  bool make_room() override;
  void enter(tcp::socket&& socket, const WebRequest::Message& request, bool may_control) override;
  void tick();
  struct Lane;
  void work(Lane& lane);
  void add(const std::shared_ptr<Session>& session);
  void remove(const std::shared_ptr<Session>& session);
  struct Asked {
    std::weak_ptr<Session> session;
    foxglove::ServiceCall call;
    std::size_t bytes = 0;
  };
  /// False when too many wait already.
  bool ask(Asked asked_for);

  Stream& stream;
  const WebOptions options;
  const Control control;
  asio::io_context context{1};
  tcp::acceptor acceptor{context};
  asio::steady_timer timer{context}, accept_timer{context};
  bool ticking = false;
  std::vector<std::weak_ptr<WebRequest>> requests;  ///< in the order in which they came
  std::size_t entering = 0;                         ///< sessions whose handshake is not over
  std::set<std::shared_ptr<Session>> sessions;
  std::uint64_t session_count = 0;
  std::thread thread;

  // Requests are answered in threads of their own: an answer may take seconds. That of the thread which exchanges the
  // scenario takes as long as a scenario takes to be read; meanwhile all other requests are answered.
  struct Lane {
    std::deque<Asked> calls;
    std::thread worker;
  };
  std::mutex mutex;
  std::condition_variable asked;
  Lane usual, host;
  std::size_t calls_bytes = 0;
  bool over = false;
};

/// A viewer, connected by a WebSocket.
class WebServer::Impl::Session : public std::enable_shared_from_this<Session> {
 public:
  Session(Impl& owner, tcp::socket&& socket) : owner_(owner), socket_(std::move(socket)) {}

  void run(const WebRequest::Message& request, bool may_control) {
    may_control_ = may_control;
    socket_.set_option(websocket::stream_base::timeout::suggested(beast::role_type::server));
    socket_.read_message_max(kLongestMessage_bytes);
    const beast::string_view field = request[http::field::sec_websocket_protocol];
    const std::string_view offered(field.data(), field.size());
    std::string chosen;
    for (const std::string_view protocol : foxglove::kProtocols)
      if (chosen.empty() && offered.find(protocol) != std::string_view::npos) chosen = protocol;
    socket_.set_option(websocket::stream_base::decorator([chosen](websocket::response_type& response) {
      response.set(http::field::server, "takt");
      if (!chosen.empty()) response.set(http::field::sec_websocket_protocol, chosen);
    }));
    ++owner_.entering;
    socket_.async_accept(request, [self = shared_from_this()](error_code error) {
      --self->owner_.entering;
      if (error) return;
      self->owner_.add(self);
      self->without_harm([&] {
        self->greet();
        self->read();
      });
    });
  }

  void say(std::string text, bool binary = false) {
    said_bytes_ += text.size();
    queue({{}, 0, std::make_shared<const std::string>(std::move(text)), binary, true});
  }

  void take_answer(std::string response, std::size_t call_bytes) {
    --asked_;
    asked_bytes_ -= call_bytes;
    say(std::move(response), true);
  }

  /// An exception in one session ends this session only.
  template <typename Function>
  void without_harm(Function&& function) {
    try {
      function();
    } catch (const std::exception&) {
      beast::get_lowest_layer(socket_).close();
      asio::post(owner_.context, [self = shared_from_this()] { self->owner_.remove(self); });
    }
  }

  /// Queues the new samples of the subscribed channels. Does nothing while earlier messages wait to be written.
  void offer() {
    if (!waiting_.empty()) return;
    advertise();
    for (auto& [channel, watched] : watched_) {
      samples_.clear();
      owner_.stream.after(channel, watched.number, samples_);
      for (const Sample& sample : samples_) {
        watched.number = sample.number;
        queue({foxglove::sample_head(watched.subscription, sample.time_ns), foxglove::kSampleHead_bytes,
               sample.bytes, true, false});
      }
    }
  }

  /// In the order in which they came.
  std::uint64_t number() const { return number_; }
  bool watches() const { return !watched_.empty(); }

  void leave() {
    for (const auto& [channel, watched] : watched_) owner_.stream.set_wanted(channel, false);
    watched_.clear();
    beast::get_lowest_layer(socket_).close();
  }

 private:
  struct Waiting {
    std::array<char, foxglove::kSampleHead_bytes> head{};
    std::size_t head_size = 0;
    std::shared_ptr<const std::string> body;
    bool binary = false;
    bool said = false;  ///< to this one alone, unlike a sample
  };
  struct Watched {
    std::uint32_t subscription = 0;
    std::uint64_t number = 0;  ///< of the newest sample sent
  };

  void greet() {
    foxglove::Texts metadata = owner_.options.metadata;
    metadata.emplace_back("control", may_control_ ? "true" : "false");
    number_ = ++owner_.session_count;
    say(foxglove::server_info(owner_.options.name, std::to_string(number_), metadata));
    advertise();
    if (may_control_) say(foxglove::advertise_control());
  }

  void advertise() {
    const auto channels = owner_.stream.channels_from(advertised_);
    if (channels.empty()) return;
    advertised_ += channels.size();
    say(foxglove::advertise(channels));
  }

  void read() {
    socket_.async_read(buffer_, [self = shared_from_this()](error_code error, std::size_t) {
      if (error) {
        self->owner_.remove(self);
        return;
      }
      self->without_harm([&] {
        const auto data = self->buffer_.cdata();
        const std::string_view message(static_cast<const char*>(data.data()), data.size());
        if (self->socket_.got_text())
          self->take_text(message);
        else if (auto call = foxglove::read_binary(message, self->may_control_))
          self->take(*std::move(call), message.size());
        self->buffer_.consume(self->buffer_.size());
        if (self->buffer_.capacity() > kKeptBuffer_bytes) self->buffer_.shrink_to_fit();
        self->read();
      });
    });
  }

  void take_text(std::string_view text) {
    const auto message = foxglove::read_text(text);
    if (!message) {
      say(foxglove::status(2, "That message was not understood."));
      return;
    }
    for (const auto& wanted : message->subscribe) {
      if (wanted.channel == 0 || wanted.channel > advertised_ || watched_.contains(wanted.channel)) {
        say(foxglove::status(
            1, "Channel " + std::to_string(wanted.channel) + " does not exist or is subscribed to already."));
        continue;
      }
      watched_[wanted.channel] = {wanted.id, 0};
      owner_.stream.set_wanted(wanted.channel, true);
    }
    for (const std::uint32_t id : message->unsubscribe)
      for (auto watched = watched_.begin(); watched != watched_.end(); ++watched)
        if (watched->second.subscription == id) {
          owner_.stream.set_wanted(watched->first, false);
          watched_.erase(watched);
          break;
        }
  }

  void take(foxglove::ServiceCall call, std::size_t bytes) {
    const std::uint32_t service = call.service, number = call.call;
    std::string problem = call.problem;
    const bool patient = asked_ == 0 || (asked_ < kMaxAsked && asked_bytes_ + bytes <= kLongestMessage_bytes);
    if (problem.empty() && !(patient && owner_.ask({shared_from_this(), std::move(call), bytes})))
      problem = "Too many requests wait for their answer already.";
    if (!problem.empty()) {
      say(foxglove::service_failure(service, number, problem));
      return;
    }
    ++asked_;
    asked_bytes_ += bytes;
  }

  void queue(Waiting message) {
    // The viewer does not read its connection.
    if (waiting_.size() > kMaxWaiting || (!waiting_.empty() && said_bytes_ > kMaxSaid_bytes)) {
      beast::get_lowest_layer(socket_).close();
      return;
    }
    waiting_.push_back(std::move(message));
    if (waiting_.size() == 1) write();
  }

  void write() {
    const Waiting& message = waiting_.front();
    socket_.binary(message.binary);
    const std::array<asio::const_buffer, 2> parts{asio::buffer(message.head.data(), message.head_size),
                                                  asio::buffer(message.body->data(), message.body->size())};
    socket_.async_write(parts, [self = shared_from_this()](error_code error, std::size_t) {
      if (error) {
        self->waiting_.clear();
        self->said_bytes_ = 0;
        return;  // read() ends too, and tidies up
      }
      if (self->waiting_.front().said) self->said_bytes_ -= self->waiting_.front().body->size();
      self->waiting_.pop_front();
      if (!self->waiting_.empty()) self->write();
    });
  }

  Impl& owner_;
  websocket::stream<beast::tcp_stream> socket_;
  beast::flat_buffer buffer_;
  std::deque<Waiting> waiting_;
  std::map<std::uint32_t, Watched> watched_;
  std::vector<Sample> samples_;
  std::uint64_t number_ = 0;
  std::size_t advertised_ = 0, said_bytes_ = 0, asked_ = 0, asked_bytes_ = 0;
  bool may_control_ = false;
};

void WebServer::Impl::listen() {
  error_code error;
  const auto address =
      asio::ip::make_address(options.address == "localhost" ? "127.0.0.1" : options.address, error);
  if (error)
    throw WebError("'" + options.address +
                   "' is no address to listen on; 127.0.0.1 is this machine only, "
                   "0.0.0.0 every network.");
  const tcp::endpoint endpoint(address, options.port);
  acceptor.open(endpoint.protocol(), error);
  if (!error) acceptor.set_option(asio::socket_base::reuse_address(true), error);
  if (!error) acceptor.bind(endpoint, error);
  if (!error) acceptor.listen(asio::socket_base::max_listen_connections, error);
  if (error)
    throw WebError("Port " + std::to_string(options.port) + " of " + options.address +
                   " cannot be listened on (" + error.message() +
                   "); --port takes another one, 0 any free one.");
}

void WebServer::Impl::accept() {
  acceptor.async_accept([this](error_code error, tcp::socket socket) {
    if (!acceptor.is_open()) return;
    if (error) {
      // Mostly for want of file descriptors: at once it would fail again, and take a whole core for that.
      accept_timer.expires_after(kAcceptPause);
      accept_timer.async_wait([this](error_code cancelled) {
        if (!cancelled) accept();
      });
      return;
    }
    try {
      welcome(std::move(socket));
    } catch (const std::exception&) {  // this one goes; there will be room for the next
    }
    accept();
  });
}

void WebServer::Impl::welcome(tcp::socket&& socket) {
  std::erase_if(requests, [](const auto& request) { return request.expired(); });
  if (requests.size() >= kMaxRequests) {
    // The connection that has been idle for longest is closed: idle connections keep no client out.
    auto leaving = std::find_if(requests.begin(), requests.end(), [](const auto& request) {
      const auto there = request.lock();
      return there && there->idle();
    });
    if (leaving == requests.end()) leaving = requests.begin();
    if (const auto there = leaving->lock()) there->close();
    requests.erase(leaving);
  }
  error_code ignored;
  socket.set_option(tcp::no_delay(true), ignored);
  const auto request = std::make_shared<WebRequest>(options, *this, std::move(socket));
  requests.push_back(request);
  request->read();
}

/// Where all places are taken, the first of the viewers that subscribe to nothing loses its own.
bool WebServer::Impl::make_room() {
  if (entering + sessions.size() < kMaxSessions) return true;
  std::shared_ptr<Session> leaving;
  for (const auto& session : sessions)
    if (!session->watches() && (!leaving || session->number() < leaving->number())) leaving = session;
  remove(leaving);
  return leaving != nullptr;
}

void WebServer::Impl::enter(tcp::socket&& socket, const WebRequest::Message& request, bool may_control) {
  std::make_shared<Session>(*this, std::move(socket))->run(request, may_control);
}

/// Handlers deal with their own exceptions; what still gets here is dropped with its connection.
void WebServer::Impl::run() {
  for (;;) {
    try {
      context.run();
      return;
    } catch (const std::exception& error) {
      std::fprintf(stderr, "takt: note: a visitor was dropped (%s).\n", error.what());
    }
  }
}

void WebServer::Impl::add(const std::shared_ptr<Session>& session) {
  sessions.insert(session);
  if (ticking) return;
  ticking = true;
  tick();
}

void WebServer::Impl::remove(const std::shared_ptr<Session>& session) {
  if (session && sessions.erase(session) > 0) session->leave();
}

/// The timer runs while a viewer is connected.
void WebServer::Impl::tick() {
  if (sessions.empty()) {
    ticking = false;
    return;
  }
  timer.expires_after(std::chrono::duration_cast<asio::steady_timer::duration>(
      std::chrono::duration<double>(1.0 / options.largest_rate_Hz)));
  timer.async_wait([this](error_code error) {
    if (error) return;
    for (const auto& session : sessions) session->without_harm([&] { session->offer(); });
    tick();
  });
}

bool WebServer::Impl::ask(Asked asked_for) {
  const std::lock_guard lock(mutex);
  if (usual.calls.size() + host.calls.size() >= kMaxCalls || calls_bytes + asked_for.bytes > kMaxCalls_bytes)
    return false;
  calls_bytes += asked_for.bytes;
  Lane& lane = is_for_host(asked_for.call.request) ? host : usual;
  lane.calls.push_back(std::move(asked_for));
  asked.notify_all();
  return true;
}

void WebServer::Impl::work(Lane& lane) {
  std::unique_lock lock(mutex);
  for (;;) {
    asked.wait(lock, [&] { return over || !lane.calls.empty(); });
    if (over) return;
    auto [session, call, bytes] = std::move(lane.calls.front());
    lane.calls.pop_front();
    calls_bytes -= bytes;
    lock.unlock();
    Answer answer;
    try {
      answer = control(call.request, call.arguments);
    } catch (const std::exception& error) {
      answer = {ControlResult::failed, error.what(), {}};
    }
    asio::post(context, [session = std::move(session), bytes = bytes,
                         response = foxglove::service_response(call.service, call.call, answer)]() mutable {
      if (const auto alive = session.lock())
        alive->without_harm([&] { alive->take_answer(std::move(response), bytes); });
    });
    lock.lock();
  }
}

WebServer::WebServer(Stream& stream, WebOptions options, Control control)
    : impl_(std::make_unique<Impl>(stream, std::move(options), std::move(control))) {
  impl_->listen();
  impl_->accept();
  impl_->thread = std::thread([this] { impl_->run(); });
  for (Impl::Lane* lane : {&impl_->usual, &impl_->host})
    lane->worker = std::thread([this, lane] { impl_->work(*lane); });
}

WebServer::~WebServer() {
  {
    const std::lock_guard lock(impl_->mutex);
    impl_->over = true;
    impl_->asked.notify_all();
  }
  impl_->usual.worker.join();
  impl_->host.worker.join();
  impl_->context.stop();
  impl_->thread.join();
  for (const auto& session : impl_->sessions) session->leave();
}

std::uint16_t WebServer::port() const {
  return impl_->acceptor.local_endpoint().port();
}

}  // namespace takt::view
