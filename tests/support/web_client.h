#pragma once
// A visitor of takt view that sends arbitrary bytes, unlike any browser.
#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>

namespace takt::test {

class WebClient {
 public:
  explicit WebClient(std::uint16_t port, bool six = false) {
    socket_ = ::socket(six ? AF_INET6 : AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    const timeval patience{20, 0};
    ::setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    int reached = -1;
    if (six) {
      sockaddr_in6 address{};
      address.sin6_family = AF_INET6;
      address.sin6_port = htons(port);
      address.sin6_addr = in6addr_loopback;
      reached = ::connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address);
    } else {
      sockaddr_in address{};
      address.sin_family = AF_INET;
      address.sin_port = htons(port);
      address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
      reached = ::connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address);
    }
    if (reached != 0) throw std::runtime_error("that port has no listener");
  }
  ~WebClient() { ::close(socket_); }
  WebClient(const WebClient&) = delete;
  WebClient& operator=(const WebClient&) = delete;

  void send(std::string_view bytes) {
    while (!bytes.empty()) {
      const ssize_t sent = ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
      if (sent <= 0) return;  // the next read shows the reason
      bytes.remove_prefix(static_cast<std::size_t>(sent));
    }
  }

  /// Head and body of one answer; its received part if the connection ends. HEAD has no body.
  std::string answer(bool head_only = false) {
    while (received_.find("\r\n\r\n") == std::string::npos)
      if (!receive()) return take(received_.size());
    const std::size_t head = received_.find("\r\n\r\n") + 4;
    const std::size_t field = received_.find("Content-Length: ");
    std::size_t body = 0;
    if (!head_only && field < head) body = std::stoul(received_.substr(field + 16));
    while (received_.size() < head + body)
      if (!receive()) break;
    return take(std::min(received_.size(), head + body));
  }
  std::string ask(const std::string& target, const std::string& fields = "Host: localhost\r\n") {
    send("GET " + target + " HTTP/1.1\r\n" + fields + "\r\n");
    return answer();
  }
  /// Whether the other side has ended the connection; waits for it.
  bool ended() {
    while (receive()) {
    }
    return ended_;
  }
  /// True when nothing came for so long.
  bool silent_for(std::chrono::milliseconds time) const {
    pollfd what{socket_, POLLIN, 0};
    return ::poll(&what, 1, static_cast<int>(time.count())) == 0;
  }

  /// The answer to a wish for a WebSocket.
  std::string open(const std::string& fields = "Host: localhost\r\n") {
    return ask("/", fields +
                        "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
                        "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n"
                        "Sec-WebSocket-Protocol: foxglove.websocket.v1\r\n");
  }
  void say(std::string_view message, bool binary = false) {
    std::string frame(1, binary ? '\x82' : '\x81');
    const auto size = static_cast<std::uint64_t>(message.size());
    const int bytes = size < 126 ? 0 : size < 65536 ? 2 : 8;
    frame += static_cast<char>(0x80U | (bytes == 0 ? size : bytes == 2 ? 126U : 127U));
    for (int i = bytes - 1; i >= 0; --i)
      frame += static_cast<char>((size >> (8U * static_cast<unsigned>(i))) & 0xffU);
    frame += std::string(4, '\0');  // a mask that changes nothing
    send(frame += message);
  }
  /// A call of the service /control.
  void call(std::uint32_t number, std::string_view request) {
    std::string message("\x02\x01\x00\x00\x00", 5);
    for (unsigned i = 0; i < 4; ++i) message += static_cast<char>((number >> (8U * i)) & 0xffU);
    message += std::string("\x04\x00\x00\x00json", 8);
    say(message += request, true);
  }
  /// The next message, of any kind; empty when the connection has ended.
  std::string hear() {
    if (!have(2)) return {};
    std::uint64_t size = static_cast<unsigned char>(received_[1]) & 0x7fU;
    const std::size_t more = size < 126 ? 0 : size == 126 ? 2 : 8;
    if (!have(2 + more)) return {};
    if (more > 0) size = 0;
    for (std::size_t i = 0; i < more; ++i) size = size << 8U | static_cast<unsigned char>(received_[2 + i]);
    if (!have(2 + more + size)) return {};
    (void)take(2 + more);
    return take(size);
  }
  /// The next message with these words in it; empty when the connection has ended.
  std::string hear_of(std::string_view words) {
    for (;;) {
      std::string message = hear();
      if (message.empty() || message.find(words) != std::string::npos) return message;
    }
  }

 private:
  bool receive() {
    std::array<char, 1U << 16U> bytes{};
    const ssize_t count = ::recv(socket_, bytes.data(), bytes.size(), 0);
    ended_ = count == 0 || (count < 0 && errno != EAGAIN);
    if (count <= 0) return false;
    received_.append(bytes.data(), static_cast<std::size_t>(count));
    return true;
  }
  bool have(std::size_t bytes) {
    while (received_.size() < bytes)
      if (!receive()) return false;
    return true;
  }
  std::string take(std::size_t bytes) {
    std::string taken = received_.substr(0, bytes);
    received_.erase(0, bytes);
    return taken;
  }

  int socket_ = -1;
  bool ended_ = false;
  std::string received_;
};

}  // namespace takt::test
