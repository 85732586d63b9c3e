#include "client_lib/gateway/cell_link.h"

#include <cstdio>

#include "idl/common/utf8.h"

namespace takt::gateway {
namespace {

/// Real-time factor below which the cell counts as too slow for wall time.
constexpr double kLeastFactor = 0.98;
constexpr std::size_t kLongestSentence = 1000;
constexpr int kCallsOfFigures = 3;
/// A filtered set-point is reached after so many periods, so that one that misses its step leaves no gap: the robot would brake
/// at the end of the period.
constexpr double kPeriodsOfSetPoint = 2.0;

std::string milliseconds(double s) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f ms", 1e3 * s);
  return text;
}

}  // namespace

void report(const std::string& gateway, const std::string& sentence) {
  // Sentences may have texts of clients.
  std::printf("%s: %s\n", gateway.c_str(), utf8_sanitize(sentence, kLongestSentence).c_str());
  std::fflush(stdout);
}

void set_realtime(Client& client) {
  client.set_pace(Pace::realtime, client.status().pace_factor);
}

CellLink::CellLink(Client& client, CellLinkOptions options, const std::vector<std::string>& targets)
    : client_(client),
      options_(std::move(options)),
      info_(client.cell()),
      sender_(client),
      reporter_(client, options_.name, options_.protocol, targets),
      states_(client, [this](const State& state) { sender_.instant(state.time); }),
      targets_(targets) {
  options_.period_s = std::max(options_.period_s, info_->step_size);
  if (options_.filter_rad_per_s > 0.0) {
    SetPointFilterOptions filter{options_.filter_rad_per_s, options_.period_s};
    const int robot = info_->find_robot(options_.robot);
    for (const auto& joint : info_->robots.at(static_cast<std::size_t>(robot)).joints) {
      filter.lower.push_back(joint.lower);
      filter.upper.push_back(joint.upper);
      filter.fastest.push_back(joint.max_velocity);
    }
    sender_.filter(options_.robot, filter);
    options_.period_s *= kPeriodsOfSetPoint;
  }
  // A gateway that only reads does not control.
  if (!targets_.empty())
    client_.register_controller(options_.name, Seconds{options_.period_s}, Seconds{10.0}, targets_);
  supervise();
}

CellLink::~CellLink() {
  try {
    if (client_.connected() && !targets_.empty()) client_.unregister_controller(options_.name);
  } catch (const ClientError& error) {
    report(options_.name, error.what());
  }
}

bool CellLink::supervise() {
  const Status status = client_.status();
  plays_ = status.state == SimulationState::playing;
  playing_calls_ = plays_ ? playing_calls_ + 1 : 0;
  const bool measured =
      playing_calls_ > kCallsOfFigures;  // figures of the last second are of the playing cell
  std::string shortfall;
  const LatestState::Intervals intervals = states_.intervals();
  if (status.pace == Pace::lockstep) {
    shortfall =
        "The cell runs in lockstep and waits for commands that do not come: start this gateway with "
        "--lockstep where it has that option, or set another pace: takt pace realtime.";
  } else if (plays_ && options_.needs_wall_time && status.pace != Pace::realtime) {
    shortfall =
        "The cell does not run at the pace realtime, but the outside controller's clock is wall time. Set "
        "it: "
        "takt pace realtime; or set 'time: simulated' in the mapping.";
  } else if (measured && options_.needs_wall_time &&
             status.real_time_factor < kLeastFactor * status.pace_factor) {
    char text[160];
    std::snprintf(
        text, sizeof text,
        "The cell is too slow for the protocol: real-time factor %.2f of %.2f. The robot lags behind its "
        "controller.",
        status.real_time_factor, status.pace_factor);
    shortfall = text;
  } else if (measured && intervals.count > 0 && intervals.p99_s > options_.most_interval_s) {
    shortfall = "Instants of the cell come too late for the protocol: 99 % within " +
                milliseconds(intervals.p99_s) + ", allowed " + milliseconds(options_.most_interval_s) + ".";
  }
  // The numbers of a sentence change each second; its kind is what is reported.
  const auto kind = [](const std::string& text) { return text.substr(0, text.find_first_of(".:")); };
  if (kind(shortfall) != kind(shortfall_))
    report(options_.name, shortfall.empty() ? "The cell keeps the limits of the protocol." : shortfall);
  shortfall_ = shortfall;
  const CommandSender::Counters counters = sender_.counters();
  if (counters.failed > failures_) report(options_.name, "Commands were not sent: " + counters.failure);
  failures_ = counters.failed;
  return plays_;
}

std::string CellLink::figures() const {
  const CommandSender::Counters counters = sender_.counters();
  const LatestState::Intervals intervals = states_.intervals();
  return std::to_string(counters.sent) + " commands sent, " + std::to_string(counters.replaced) +
         " replaced by newer ones; instants every " + milliseconds(intervals.p50_s) +
         " (99 %: " + milliseconds(intervals.p99_s) + ").";
}

}  // namespace takt::gateway
