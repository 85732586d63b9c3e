#include "client_lib/gateway/rsi/sensor_pc.h"

#include <utility>

namespace takt::gateway::rsi {
namespace {

constexpr std::size_t kMaxUnknown = 64;
/// RSI up to 2.3 begins with an empty frame shorter than this.
constexpr std::size_t kEmptyFrame = 100;

}  // namespace

SensorPc::SensorPc(Configuration configuration, const SensorPcOptions& options)
    : configuration_(std::move(configuration)), options_(options), clock_(options.clock) {
  answer_.values.assign(configuration_.receive.size(), 0.0);
}

Reception SensorPc::receive(std::string_view bytes, double arrival_s) {
  Reception made;
  auto parsed = parse_rob(configuration_, bytes);
  for (std::string& name : parsed.unknown)
    if (unknown_.size() < kMaxUnknown && unknown_.insert(name).second)
      new_unknown_.push_back(std::move(name));
  if (!parsed.message) {
    if (packets_ == 0 && bytes.size() < kEmptyFrame) return made;
    ++invalid_;
    made.fault = std::move(parsed.fault);
    return made;
  }
  const Rob& rob = *parsed.message;
  if (!configuration_.only_send) {
    answer_.ipoc = rob.ipoc;
    made.answer = write_sen(configuration_, answer_);
  }
  delay_ = rob.delay;
  const PeerClock::Reading reading = clock_.read(rob.ipoc, arrival_s, packets_ == 0 || silent(arrival_s));
  ++packets_;
  last_arrival_s_ = arrival_s;
  made.old = reading.old;
  if (made.old) return made;
  made.restarted = reading.restarted;
  if (made.restarted) ++restarts_;
  made.time_s = reading.time_s;
  made.state = rob;
  return made;
}

std::vector<std::string> SensorPc::new_unknown() {
  return std::exchange(new_unknown_, {});
}

}  // namespace takt::gateway::rsi
