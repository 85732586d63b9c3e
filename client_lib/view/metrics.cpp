#include "client_lib/view/metrics.h"

#include <prometheus/gauge.h>
#include <prometheus/registry.h>
#include <prometheus/text_serializer.h>

#include <chrono>
#include <map>

#include "client_lib/recording/sample.h"

namespace takt::view {
namespace {

struct Figure {
  const char* member;  ///< of takt_msgs/msg/Status
  const char* name;
  const char* help;
};
constexpr Figure kFigures[] = {
    {"time", "takt_simulated_seconds", "Simulated time since the last reset."},
    {"step", "takt_steps", "Steps since the last reset."},
    {"epoch", "takt_resets", "Resets, loads and restored snapshots."},
    {"state", "takt_state", "0 stopped, 1 playing, 2 paused, 3 quitting, 4 no scenario, 5 loading."},
    {"pace_factor", "takt_pace_factor", "Simulated per wall time that is wanted."},
    {"wall_time", "takt_wall_seconds", "Since the server started."},
    {"real_time_factor", "takt_real_time_factor", "Simulated time per wall time, over the last second."},
    {"computation_ratio", "takt_computation_ratio",
     "Computation time per simulated time, over the last second."},
    {"lag", "takt_lag_seconds", "Behind schedule."},
    {"overruns", "takt_overruns", "Steps that ended after their time."},
    {"max_consecutive_overruns", "takt_max_consecutive_overruns", "Most overruns in a row."},
    {"schedule_resets", "takt_schedule_resets", "Times the schedule was set anew after a long delay."},
    {"step_time_p50", "takt_step_seconds_p50", "Computation of one step, median."},
    {"step_time_p99", "takt_step_seconds_p99", "Computation of one step, 99th percentile."},
    {"step_time_max", "takt_step_seconds_max", "Computation of one step, longest."},
    {"wakeup_latency_p50", "takt_wakeup_latency_seconds_p50", "Lateness of the wake-up, median."},
    {"wakeup_latency_p99", "takt_wakeup_latency_seconds_p99", "Lateness of the wake-up, 99th percentile."},
    {"wakeup_latency_max", "takt_wakeup_latency_seconds_max", "Lateness of the wake-up, longest."},
    {"command_latency_p50", "takt_command_latency_seconds_p50", "Receipt to effect, median."},
    {"command_latency_p99", "takt_command_latency_seconds_p99", "Receipt to effect, 99th percentile."},
    {"command_latency_max", "takt_command_latency_seconds_max", "Receipt to effect, longest."},
    {"commands_applied", "takt_commands_applied", "Commands that took effect."},
    {"commands_rejected", "takt_commands_rejected", "Commands that were refused."},
    {"mpr_calls", "takt_collision_queries", "Collision queries made."},
    {"mpr_skipped", "takt_collision_queries_skipped", "Collision queries that nothing had changed for."},
    {"solver_steps", "takt_solver_steps", "Steps of the solver, accepted."},
    {"solver_rejected_steps", "takt_solver_rejected_steps", "Steps of the solver, rejected."},
    {"contact_pairs", "takt_contact_pairs", "Pairs that press upon each other now, by surface contact."},
    {"contact_calls", "takt_contact_evaluations", "Evaluations of a pair's surface contact."},
    {"contact_calls_skipped", "takt_contact_evaluations_skipped",
     "Evaluations of surface contact that nothing had changed for."},
    {"contact_elements", "takt_contact_elements", "Elements with force, over all evaluations."},
    {"contact_rebuilds", "takt_contact_rebuilds", "Candidate lists of surface contact made anew."},
};
constexpr double kSilence_s = 5.0;

double wall_s() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

}  // namespace

struct Metrics::Impl {
  Impl(Stream& s, const std::string& c) : stream(s), cell(c) {}
  Stream& stream;
  const std::string cell;
  prometheus::Registry registry;
  std::map<std::string, prometheus::Family<prometheus::Gauge>*> families;
  std::uint32_t channel = 0;

  void set(const char* name, const char* help, double value, const prometheus::Labels& more = {}) {
    auto& family = families[name];
    if (family == nullptr)
      family = &prometheus::BuildGauge().Name(name).Help(help).Labels({{"cell", cell}}).Register(registry);
    family->Add(more).Set(value);
  }
};

Metrics::Metrics(Stream& stream, const std::string& cell) : impl_(std::make_unique<Impl>(stream, cell)) {}
Metrics::~Metrics() = default;

std::string Metrics::text() {
  Impl& impl = *impl_;
  if (impl.channel == 0)
    for (const Channel& channel : impl.stream.channels_from(0))
      if (channel.type == "takt_msgs/msg/Status") impl.channel = channel.id;
  const Sample sample = impl.channel == 0 ? Sample{} : impl.stream.newest(impl.channel);
  const bool up = sample.bytes && wall_s() - 1e-9 * static_cast<double>(sample.time_ns) < kSilence_s;
  impl.set("takt_up", "1 while the server sends its status.", up ? 1.0 : 0.0);
  if (up) {
    const recording::Json status =
        recording::to_json(recording::known_types(), "takt_msgs/msg/Status", *sample.bytes);
    for (const Figure& figure : kFigures)
      impl.set(figure.name, figure.help, status.value(figure.member, 0.0));
    impl.set("takt_fault", "1 when a fault has stopped the simulation.",
             status.value("fault", std::string()).empty() ? 0.0 : 1.0);
    for (const auto& process : status["processes"])
      impl.set("takt_level_of_detail", "Of a process, 1 to 3.", process["level_of_detail"].get<double>(),
               {{"process", process["name"].get<std::string>()}});
  }
  return prometheus::TextSerializer().Serialize(impl.registry.Collect());
}

}  // namespace takt::view
