#include "client_lib/view/web_request.h"

#include <boost/beast/websocket.hpp>
#include <chrono>
#include <exception>

#include "client_lib/view/addresses.h"

namespace takt::view {

namespace beast = boost::beast;
namespace http = beast::http;
using boost::asio::ip::tcp;
using boost::system::error_code;

namespace {

constexpr std::chrono::seconds kPatience{30};
constexpr std::size_t kLongestBody_bytes = 1U << 16U;  ///< no request needs a body; POST is answered

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

constexpr const char* kNoPage =
    "<!doctype html><title>takt view</title><p>takt was built without the page of takt view, since npm could "
    "not "
    "be reached then. Build once more with npm and a network; Foxglove can connect to this address all the "
    "same.</p>";

}  // namespace

template <typename Body>
struct WebRequest::Reply {
  http::response<Body> response;
  std::optional<http::response_serializer<Body>> serializer;  ///< made of the whole response
};

void WebRequest::read() {
  idle_ = true;
  parser_.emplace();
  parser_->body_limit(kLongestBody_bytes);
  stream_.expires_after(kPatience);
  http::async_read(stream_, buffer_, *parser_, [self = shared_from_this()](error_code error, std::size_t) {
    if (error) return;
    self->idle_ = false;
    self->request_ = self->parser_->release();
    self->answer_or_report();
  });
}

/// An exception in one request must not end the server for the other visitors.
void WebRequest::answer_or_report() {
  try {
    answer();
  } catch (const std::exception& error) {
    send(http::status::internal_server_error, "text/plain",
         std::string("takt view cannot answer that: ") + error.what() + "\n");
  }
}

void WebRequest::answer() {
  const std::string_view host = text_of(request_[http::field::host]);
  if (is_loopback(options_.address) && !is_loopback(host_name(host))) {
    send(http::status::forbidden, "text/plain", "takt view answers on this machine only.\n");
    return;
  }
  if (beast::websocket::is_upgrade(request_)) {
    upgrade(host);
    return;
  }
  if (request_.method() != http::verb::get && request_.method() != http::verb::head) {
    send(http::status::method_not_allowed, "text/plain", "GET is what there is.\n");
    return;
  }
  std::string path(text_of(request_.target()));
  path = path.substr(0, path.find_first_of("?#"));
  if (!path.starts_with('/')) {
    send(http::status::bad_request, "text/plain", "What is asked for must begin with a slash.\n");
    return;
  }
  if (path == "/metrics" && options_.metrics) {
    send(http::status::ok, "text/plain; version=0.0.4", options_.metrics());
    return;
  }
  constexpr std::string_view kFiles = "/files/";
  if (path.starts_with(kFiles)) {
    if (const auto file = options_.files.find(std::string_view(path).substr(kFiles.size())))
      send_file(*file);
    else
      send(http::status::not_found, "text/plain",
           "There is no such mesh file below the folders of takt view --files.\n");
    return;
  }
  send_page(path == "/" ? "/index.html" : path);
}

void WebRequest::upgrade(std::string_view host) {
  if (!sessions_.make_room()) {
    send(http::status::service_unavailable, "text/plain", "Too many look already.\n");
    return;
  }
  const std::string_view origin = text_of(request_[http::field::origin]);
  const bool same = origin.empty() || (origin.find("://") != std::string_view::npos &&
                                       origin.substr(origin.find("://") + 3) == host);
  stream_.expires_never();
  sessions_.enter(stream_.release_socket(), request_, options_.control && same);
}

void WebRequest::send_page(const std::string& path) {
  if (options_.page.empty()) {
    const bool start = path == "/index.html";
    send(start ? http::status::ok : http::status::not_found, "text/html; charset=utf-8",
         start ? kNoPage : "");
    return;
  }
  // A path that begins with two slashes is an absolute one, and would replace the directory of the page.
  const auto relative = std::filesystem::path(path).relative_path();
  if (const auto file = file_below(options_.page, options_.page / relative))
    send_file(*file);
  else
    send(http::status::not_found, "text/plain", "There is no such page.\n");
}

void WebRequest::send_file(const std::filesystem::path& file) {
  auto reply = std::make_shared<Reply<http::file_body>>();
  error_code error;
  reply->response.body().open(file.c_str(), beast::file_mode::scan, error);
  if (error) {
    send(http::status::forbidden, "text/plain", "That file cannot be read (" + error.message() + ").\n");
    return;
  }
  if (request_.method() == http::verb::head) {
    auto head = std::make_shared<Reply<http::empty_body>>();
    begin(head->response, http::status::ok, mime_type(file));
    head->response.content_length(reply->response.body().size());
    write(head);
    return;
  }
  begin(reply->response, http::status::ok, mime_type(file));
  reply->response.prepare_payload();
  write(reply);
}

void WebRequest::send(http::status status, const char* type, std::string body) {
  if (request_.method() == http::verb::head) {
    auto head = std::make_shared<Reply<http::empty_body>>();
    begin(head->response, status, type);
    head->response.content_length(body.size());
    write(head);
    return;
  }
  auto reply = std::make_shared<Reply<http::string_body>>();
  begin(reply->response, status, type);
  reply->response.body() = std::move(body);
  reply->response.prepare_payload();
  write(reply);
}

template <typename Body>
void WebRequest::begin(http::response<Body>& response, http::status status, const char* type) const {
  response.result(status);
  response.version(request_.version());
  response.set(http::field::server, "takt");
  response.set(http::field::content_type, type);
  response.set(http::field::cache_control, "no-cache");
  response.set("X-Content-Type-Options", "nosniff");
  response.keep_alive(request_.keep_alive());
}

/// Piece by piece: a large file is never in memory as a whole, and takes as long as the network does.
template <typename Body>
void WebRequest::write(const std::shared_ptr<Reply<Body>>& reply) {
  if (!reply->serializer) reply->serializer.emplace(reply->response);
  stream_.expires_after(kPatience);
  http::async_write_some(stream_, *reply->serializer,
                         [self = shared_from_this(), reply](error_code error, std::size_t) {
                           if (error) return;
                           if (!reply->serializer->is_done()) {
                             self->write(reply);
                             return;
                           }
                           if (reply->response.keep_alive())
                             self->read();
                           else
                             self->stream_.socket().shutdown(tcp::socket::shutdown_send, error);
                         });
}

}  // namespace takt::view
