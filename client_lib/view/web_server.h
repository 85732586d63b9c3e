#pragma once
// HTTP and WebSocket for takt view: the page, and Foxglove's protocol for the page and for other programs. The
// server has one thread of its own. A slow viewer gets fewer samples, never a growing queue.
//
// The default address is this machine only. A page from the same origin may send requests, and so may a program
// without an Origin header. A page from another origin may only observe.
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
  std::string name;                      ///< of the cell or the recording file, for viewers
  foxglove::Texts metadata;              ///< for the page
  bool control = true;                   ///< false: all are observers
  double largest_rate_Hz = 60.0;         ///< samples of one channel to one viewer
  std::function<std::string()> metrics;  ///< text for /metrics (Prometheus); empty: no such page
};

class WebServer {
 public:
  /// Listens and serves. The stream must outlive the server. Throws WebError when it cannot listen.
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
