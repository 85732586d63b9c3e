#pragma once
// One HTTP connection of takt view. It answers requests for files and pages one after the other, and passes on a
// request for a WebSocket.
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http.hpp>
#include <memory>
#include <optional>
#include <string>

#include "client_lib/view/web_server.h"

namespace takt::view {

class WebRequest : public std::enable_shared_from_this<WebRequest> {
 public:
  using Message = boost::beast::http::request<boost::beast::http::string_body>;

  /// Receives the connections that ask for a WebSocket.
  class Sessions {
   public:
    /// Whether there is a place for one more; idle connections may lose theirs.
    virtual bool make_room() = 0;
    virtual void enter(boost::asio::ip::tcp::socket&& socket, const Message& request, bool may_control) = 0;

   protected:
    ~Sessions() = default;
  };

  /// Both must outlive this.
  WebRequest(const WebOptions& options, Sessions& sessions, boost::asio::ip::tcp::socket&& socket)
      : options_(options), sessions_(sessions), stream_(std::move(socket)) {}

  void read();
  /// True while the connection waits for its first or next request.
  bool idle() const { return idle_; }
  void close() { stream_.close(); }

 private:
  template <typename Body>
  struct Reply;

  void answer_or_report();
  void answer();
  void upgrade(std::string_view host);
  void send_page(const std::string& path);
  void send_file(const std::filesystem::path& file);
  void send(boost::beast::http::status status, const char* type, std::string body);
  template <typename Body>
  void begin(boost::beast::http::response<Body>& response, boost::beast::http::status status,
             const char* type) const;
  template <typename Body>
  void write(const std::shared_ptr<Reply<Body>>& reply);

  const WebOptions& options_;
  Sessions& sessions_;
  boost::beast::tcp_stream stream_;
  boost::beast::flat_buffer buffer_{1U << 16U};
  std::optional<boost::beast::http::request_parser<boost::beast::http::string_body>> parser_;
  Message request_;
  bool idle_ = true;
};

}  // namespace takt::view
