#include "client_lib/view/web_server.h"

#include <array>
#include <boost/asio/bind_executor.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <condition_variable>
#include <deque>
#include <fstream>
#include <map>
#include <mutex>
#include <set>
#include <sstream>
#include <thread>

namespace takt::view {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using asio::ip::tcp;
using boost::system::error_code;

namespace {

constexpr std::size_t kMostSessions = 200;
constexpr std::size_t kLongestMessage_bytes = 1U << 20U;
constexpr std::size_t kMostWaiting = 4000;  ///< messages for one that does not read

std::string_view text_of(beast::string_view text) {
  return {text.data(), text.size()};
}

const char* mime_type(const std::filesystem::path& file) {
  const std::string kind = file.extension().string();
  if (kind == ".html") return "text/html; charset=utf-8";
  if (kind == ".js") return "text/javascript; charset=utf-8";
  if (kind == ".css") return "text/css; charset=utf-8";
  if (kind == ".svg") return "image/svg+xml";
  if (kind == ".json" || kind == ".map") return "application/json";
  if (kind == ".txt") return "text/plain; charset=utf-8";
  return "application/octet-stream";
}

/// Host without its port.
std::string_view host_name(std::string_view host) {
  if (host.starts_with('[')) return host.substr(0, host.find(']') + 1);
  return host.substr(0, host.find(':'));
}

bool is_loopback_name(std::string_view host) {
  return host == "localhost" || host == "127.0.0.1" || host == "[::1]";
}

constexpr const char* kNoPage =
    "<!doctype html><title>takt view</title><p>takt was built without the page of takt view, since npm could "
    "not "
    "be reached then. Build once more with npm and a network; Foxglove can connect to this address all the "
    "same.</p>";

}  // namespace

struct WebServer::Impl {
  class Session;
  class Request;

  Impl(Stream& s, WebOptions o, Control c) : stream(s), options(std::move(o)), control(std::move(c)) {}

  void listen();
  void accept();
  void tick();
  void work();
  void add(const std::shared_ptr<Session>& session);
  void remove(const std::shared_ptr<Session>& session);
  void ask(const std::shared_ptr<Session>& session, foxglove::ServiceCall call);
  bool host_is_ours(std::string_view host) const {
    return !is_loopback_name(options.address) || is_loopback_name(host_name(host));
  }

  Stream& stream;
  const WebOptions options;
  const Control control;
  asio::io_context context{1};
  tcp::acceptor acceptor{context};
  asio::steady_timer timer{context};
  bool ticking = false;
  std::set<std::shared_ptr<Session>> sessions;
  std::uint64_t session_count = 0;
  std::thread thread;

  // Requests are answered in a thread of their own: an answer may take seconds.
  std::mutex mutex;
  std::condition_variable asked;
  std::deque<std::pair<std::weak_ptr<Session>, foxglove::ServiceCall>> calls;
  bool over = false;
  std::thread worker;
};

/// One who looks, over a WebSocket.
class WebServer::Impl::Session : public std::enable_shared_from_this<Session> {
 public:
  Session(Impl& owner, tcp::socket&& socket) : owner_(owner), socket_(std::move(socket)) {}

  void run(const http::request<http::string_body>& request, bool may_control) {
    may_control_ = may_control;
    socket_.set_option(websocket::stream_base::timeout::suggested(beast::role_type::server));
    socket_.read_message_max(kLongestMessage_bytes);
    const std::string_view offered = text_of(request[http::field::sec_websocket_protocol]);
    std::string chosen;
    for (const std::string_view protocol : foxglove::kProtocols)
      if (chosen.empty() && offered.find(protocol) != std::string_view::npos) chosen = protocol;
    socket_.set_option(websocket::stream_base::decorator([chosen](websocket::response_type& response) {
      response.set(http::field::server, "takt");
      if (!chosen.empty()) response.set(http::field::sec_websocket_protocol, chosen);
    }));
    socket_.async_accept(request, [self = shared_from_this()](error_code error) {
      if (error) return;
      self->owner_.add(self);
      self->greet();
      self->read();
    });
  }

  void say(std::string text, bool binary = false) {
    queue({{}, 0, std::make_shared<const std::string>(std::move(text)), binary});
  }

  /// What is new of what is wanted; nothing while older things are still on their way.
  void offer() {
    if (!waiting_.empty()) return;
    advertise();
    for (auto& [channel, watched] : watched_) {
      samples_.clear();
      owner_.stream.after(channel, watched.number, samples_);
      for (const Sample& sample : samples_) {
        watched.number = sample.number;
        queue({foxglove::sample_head(watched.subscription, sample.time_ns), foxglove::kSampleHead_bytes,
               sample.bytes, true});
      }
    }
  }

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
  };
  struct Watched {
    std::uint32_t subscription = 0;
    std::uint64_t number = 0;  ///< of the newest sample sent
  };

  void greet() {
    foxglove::Texts metadata = owner_.options.metadata;
    metadata.emplace_back("control", may_control_ ? "true" : "false");
    say(foxglove::server_info(owner_.options.name, std::to_string(++owner_.session_count), metadata));
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
      const auto data = self->buffer_.cdata();
      const std::string_view message(static_cast<const char*>(data.data()), data.size());
      if (self->socket_.got_text())
        self->take_text(message);
      else if (auto call = foxglove::read_binary(message))
        self->take(*std::move(call));
      self->buffer_.consume(self->buffer_.size());
      self->read();
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

  void take(foxglove::ServiceCall call) {
    if (!may_control_) call.problem = "Observers may look, not touch.";
    if (call.problem.empty())
      owner_.ask(shared_from_this(), std::move(call));
    else
      say(foxglove::service_failure(call.service, call.call, call.problem));
  }

  void queue(Waiting message) {
    if (waiting_.size() > kMostWaiting) {  // the connection is there, but nobody reads
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
        return;  // read() ends too, and tidies up
      }
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
  std::size_t advertised_ = 0;
  bool may_control_ = false;
};

/// A connection until it is known what is wanted: a file, or a WebSocket.
class WebServer::Impl::Request : public std::enable_shared_from_this<Request> {
 public:
  Request(Impl& owner, tcp::socket&& socket) : owner_(owner), stream_(std::move(socket)) {}

  void read() {
    request_ = {};
    stream_.expires_after(std::chrono::seconds(30));
    http::async_read(stream_, buffer_, request_, [self = shared_from_this()](error_code error, std::size_t) {
      if (!error) self->answer();
    });
  }

 private:
  void answer() {
    const std::string_view host = text_of(request_[http::field::host]);
    if (!owner_.host_is_ours(host)) {
      send(http::status::forbidden, "text/plain", "takt view answers on this machine only.\n");
      return;
    }
    if (websocket::is_upgrade(request_)) {
      if (owner_.sessions.size() >= kMostSessions) {
        send(http::status::service_unavailable, "text/plain", "Too many look already.\n");
        return;
      }
      const std::string_view origin = text_of(request_[http::field::origin]);
      const bool same = origin.empty() || (origin.find("://") != std::string_view::npos &&
                                           origin.substr(origin.find("://") + 3) == host);
      stream_.expires_never();
      std::make_shared<Session>(owner_, stream_.release_socket())
          ->run(request_, owner_.options.control && same);
      return;
    }
    if (request_.method() != http::verb::get && request_.method() != http::verb::head) {
      send(http::status::method_not_allowed, "text/plain", "GET is what there is.\n");
      return;
    }
    std::string path(text_of(request_.target()));
    path = path.substr(0, path.find_first_of("?#"));
    if (path == "/metrics" && owner_.options.metrics) {
      send(http::status::ok, "text/plain; version=0.0.4", owner_.options.metrics());
      return;
    }
    constexpr std::string_view kFiles = "/files/";
    if (path.starts_with(kFiles)) {
      if (const auto file = owner_.options.files.find(std::string_view(path).substr(kFiles.size())))
        send_content(*file);
      else
        send(http::status::not_found, "text/plain",
             "There is no such mesh file below the folders of takt view --files.\n");
      return;
    }
    send_file(path == "/" ? "/index.html" : path);
  }

  void send_file(const std::string& path) {
    if (owner_.options.page.empty()) {
      const bool start = path == "/index.html";
      send(start ? http::status::ok : http::status::not_found, "text/html; charset=utf-8",
           start ? kNoPage : "");
      return;
    }
    const std::filesystem::path file = owner_.options.page / path.substr(1);
    std::error_code problem;
    if (path.find("..") != std::string::npos || path.find('\0') != std::string::npos ||
        !std::filesystem::is_regular_file(file, problem)) {
      send(http::status::not_found, "text/plain", "There is no such page.\n");
      return;
    }
    send_content(file);
  }

  void send_content(const std::filesystem::path& file) {
    std::ostringstream content;
    content << std::ifstream(file, std::ios::binary).rdbuf();
    send(http::status::ok, mime_type(file), content.str());
  }

  void send(http::status status, const char* type, std::string body) {
    response_ = {};
    response_.result(status);
    response_.version(request_.version());
    response_.set(http::field::server, "takt");
    response_.set(http::field::content_type, type);
    response_.set(http::field::cache_control, "no-cache");
    response_.set("X-Content-Type-Options", "nosniff");
    response_.keep_alive(request_.keep_alive());
    const bool head = request_.method() == http::verb::head;
    response_.body() = head ? std::string() : std::move(body);
    response_.prepare_payload();
    http::async_write(stream_, response_, [self = shared_from_this()](error_code error, std::size_t) {
      if (!error && self->response_.keep_alive()) self->read();
    });
  }

  Impl& owner_;
  beast::tcp_stream stream_;
  beast::flat_buffer buffer_{1U << 16U};
  http::request<http::string_body> request_;
  http::response<http::string_body> response_;
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
    if (!error) {
      error_code ignored;
      socket.set_option(tcp::no_delay(true), ignored);
      std::make_shared<Request>(*this, std::move(socket))->read();
    }
    accept();
  });
}

void WebServer::Impl::add(const std::shared_ptr<Session>& session) {
  sessions.insert(session);
  if (ticking) return;
  ticking = true;
  tick();
}

void WebServer::Impl::remove(const std::shared_ptr<Session>& session) {
  if (sessions.erase(session) > 0) session->leave();
}

/// Nothing runs while nobody looks.
void WebServer::Impl::tick() {
  if (sessions.empty()) {
    ticking = false;
    return;
  }
  timer.expires_after(std::chrono::duration_cast<asio::steady_timer::duration>(
      std::chrono::duration<double>(1.0 / options.largest_rate_Hz)));
  timer.async_wait([this](error_code error) {
    if (error) return;
    for (const auto& session : sessions) session->offer();
    tick();
  });
}

void WebServer::Impl::ask(const std::shared_ptr<Session>& session, foxglove::ServiceCall call) {
  const std::lock_guard lock(mutex);
  calls.emplace_back(session, std::move(call));
  asked.notify_one();
}

void WebServer::Impl::work() {
  std::unique_lock lock(mutex);
  for (;;) {
    asked.wait(lock, [&] { return over || !calls.empty(); });
    if (over) return;
    auto [session, call] = std::move(calls.front());
    calls.pop_front();
    lock.unlock();
    Answer answer;
    try {
      answer = control(call.request, call.arguments);
    } catch (const std::exception& error) {
      answer = {4, error.what(), {}};
    }
    asio::post(context, [session = std::move(session),
                         response = foxglove::service_response(call.service, call.call, answer)] {
      if (const auto alive = session.lock()) alive->say(response, true);
    });
    lock.lock();
  }
}

WebServer::WebServer(Stream& stream, WebOptions options, Control control)
    : impl_(std::make_unique<Impl>(stream, std::move(options), std::move(control))) {
  impl_->listen();
  impl_->accept();
  impl_->thread = std::thread([this] { impl_->context.run(); });
  impl_->worker = std::thread([this] { impl_->work(); });
}

WebServer::~WebServer() {
  {
    const std::lock_guard lock(impl_->mutex);
    impl_->over = true;
    impl_->asked.notify_all();
  }
  impl_->worker.join();
  impl_->context.stop();
  impl_->thread.join();
  for (const auto& session : impl_->sessions) session->leave();
}

std::uint16_t WebServer::port() const {
  return impl_->acceptor.local_endpoint().port();
}

}  // namespace takt::view
