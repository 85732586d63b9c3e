#pragma once
// The status of the server as metrics for Prometheus (text, version 0.0.4): GET /metrics of takt view. Each number of
// takt_msgs/msg/Status is takt_NAME, or takt_NAME_seconds, and each one of a gateway takt_gateway_NAME; the IDL has their
// meaning.
#include <cstdint>
#include <string>

#include "client_lib/view/stream.h"

namespace takt::view {

class Metrics {
 public:
  /// `cell`: name of the cell, a label of every metric. The stream must outlive this.
  Metrics(Stream& stream, std::string cell);

  /// Metrics of the newest status. takt_up is 0 after 5 s without a status, and the others are left out.
  std::string text();

 private:
  Stream& stream_;
  const std::string cell_;
  std::uint32_t channel_ = 0;
};

}  // namespace takt::view
