#pragma once
// Reports that may come with each packet: the first of a kind at once, then at most one a second with a count.
#include <chrono>
#include <cstdint>
#include <map>
#include <string>

#include "client_lib/gateway/cell_link.h"

namespace takt::gateway {

class ThrottledReport {
 public:
  explicit ThrottledReport(std::string gateway) : gateway_(std::move(gateway)) {}

  void operator()(const std::string& kind, const std::string& sentence) {
    Kind& k = kinds_[kind];
    ++k.count;
    const auto now = std::chrono::steady_clock::now();
    if (k.count > 1 && now - k.reported < std::chrono::seconds(1)) return;
    k.reported = now;
    report(gateway_,
           k.count == 1 ? sentence : sentence + " (" + std::to_string(k.count) + " of this kind so far)");
  }

 private:
  struct Kind {
    std::uint64_t count = 0;
    std::chrono::steady_clock::time_point reported{};
  };
  const std::string gateway_;
  std::map<std::string, Kind> kinds_;
};

}  // namespace takt::gateway
