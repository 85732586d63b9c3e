#pragma once
// The status of the server as metrics for Prometheus (text, version 0.0.4): GET /metrics of takt view. Each number of
// takt_msgs/msg/Status is takt_NAME, or takt_NAME_seconds; the IDL has its meaning.
#include <memory>
#include <string>

#include "client_lib/view/stream.h"

namespace takt::view {

class Metrics {
 public:
  /// `cell`: name of the cell, a label of every metric. The stream must outlive this.
  Metrics(Stream& stream, const std::string& cell);
  ~Metrics();
  Metrics(const Metrics&) = delete;
  Metrics& operator=(const Metrics&) = delete;

  /// Metrics of the newest status. takt_up is 0 after 5 s without a status.
  std::string text();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace takt::view
