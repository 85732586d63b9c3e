#pragma once
// HTTP and WebSocket for takt view: the page, and Foxglove's protocol for it and for other programs. One
// thread of its own; who is slow gets fewer samples, never an older queue.
//
// It listens on this machine unless told otherwise. Control is given to pages from the same origin and to
// programs that name none; a page from elsewhere that a browser shows may look, not touch.
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>

#include "client_lib/view/foxglove.h"
#include "client_lib/view/robot_files.h"
#include "client_lib/view/stream.h"

namespace takt::view {

class WebError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct WebOptions {
  std::string address = "127.0.0.1";
  std::uint16_t port = 8765;             ///< 0: any free one
  std::filesystem::path page;            ///< directory of the built page; empty: there is none
  RobotFiles files;                      ///< below /files/
  std::string name;                      ///< what is shown
  foxglove::Texts metadata;              ///< for the page
  bool control = true;                   ///< false: all are observers
  double largest_rate_Hz = 60.0;         ///< samples of one channel to one who looks
  std::function<std::string()> metrics;  ///< text for /metrics (Prometheus); none: there is no such page
};

class WebServer {
 public:
  /// Listens, and serves from then on. The stream must outlive this. Throws WebError when it cannot listen.
  WebServer(Stream& stream, WebOptions options, Control control);
  ~WebServer();
  WebServer(const WebServer&) = delete;
  WebServer& operator=(const WebServer&) = delete;

  std::uint16_t port() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace takt::view
