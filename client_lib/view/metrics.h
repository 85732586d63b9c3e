#pragma once
// The status of the server as metrics for Prometheus (text, version 0.0.4): GET /metrics of takt view. Each number of
// takt_msgs/msg/Status is takt_NAME, or takt_NAME_seconds; the IDL says what it means.
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

  /// Of the newest status; takt_up is 0 when none has come for 5 s.
  std::string text();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace takt::view
