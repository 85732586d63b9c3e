#include "server/messages/status_messages.h"

#include "idl/common/stamp.h"
#include "idl/common/utf8.h"

namespace takt {

takt_msgs::msg::Status to_message(const LoopStatus& status, const CellDescription& cell) {
  takt_msgs::msg::Status message;
  message.stamp = to_time(status.time_s);
  message.time = status.time_s;
  message.step = status.step;
  message.epoch = status.epoch;
  message.scenario_generation = cell.scenario_generation;
  message.state = status.state;
  message.pace = status.pace;
  message.pace_factor = status.pace_factor;
  message.wall_time = status.wall_time_s;
  message.real_time_factor = status.real_time_factor;
  message.computation_ratio = status.computation_ratio;
  message.lag = status.lag_s;
  message.overruns = status.overruns;
  message.max_consecutive_overruns = status.max_consecutive_overruns;
  message.schedule_resets = status.schedule_resets;
  message.step_time_p50 = status.step_time.p50_s;
  message.step_time_p99 = status.step_time.p99_s;
  message.step_time_max = status.step_time.max_s;
  message.wakeup_latency_p50 = status.wakeup_latency.p50_s;
  message.wakeup_latency_p99 = status.wakeup_latency.p99_s;
  message.wakeup_latency_max = status.wakeup_latency.max_s;
  message.command_latency_p50 = status.command_latency.p50_s;
  message.command_latency_p99 = status.command_latency.p99_s;
  message.command_latency_max = status.command_latency.max_s;
  message.commands_applied = status.commands_applied;
  message.commands_rejected = status.commands_rejected;
  message.mpr_calls = status.mpr_calls;
  message.mpr_skipped = status.mpr_skipped;
  message.solver = std::string(status.solver.str());
  message.solver_steps = status.solver_steps;
  message.solver_rejected_steps = status.solver_rejected_steps;
  for (std::uint32_t i = 0; i < status.process_count; ++i) {
    auto& process = message.processes.emplace_back();
    process.name = utf8_sanitize(cell.processes[i].name, 128);
    process.level_of_detail = status.process_levels[i];
  }
  for (std::uint32_t i = 0; i < status.waiting_count; ++i) {
    message.waiting_for.emplace_back(utf8_sanitize(status.waiting_for[i].view()));
  }
  message.scheduling = utf8_sanitize(status.scheduling.view());
  message.fault = utf8_sanitize(status.fault.view());
  message.contact_pairs = status.contact_pairs;
  message.contact_calls = status.contact_calls.made;
  message.contact_calls_skipped = status.contact_calls.skipped;
  message.contact_elements = status.contact_calls.elements;
  message.contact_rebuilds = status.contact_calls.rebuilds;
  return message;
}

takt_msgs::msg::Event to_message(const EventRecord& event, const CellDescription& cell) {
  const EventText text = describe(event, cell);
  takt_msgs::msg::Event message;
  message.stamp = to_time(event.time_s);
  message.time = event.time_s;
  message.step = event.step;
  message.epoch = event.epoch;
  message.severity = info_of(event).severity;
  message.code = std::string(info_of(event).code);
  message.subject = utf8_sanitize(text.subject, 128);
  message.message = utf8_sanitize(text.message, 1024);
  return message;
}

}  // namespace takt
