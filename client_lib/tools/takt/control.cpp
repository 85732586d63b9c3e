// takt list, status, step, pace.
#include <cstdio>

#include "client_lib/tools/takt/commands.h"
#include "client_lib/tools/takt/sample_json.h"
#include "idl/common/text.h"

namespace takt::tool {
namespace {

void print_percentiles(const char* label, double p50_s, double p99_s, double max_s) {
  std::printf("  %-17s %.0f / %.0f / %.0f µs (median / 99 %% / largest)\n", label, 1e6 * p50_s, 1e6 * p99_s,
              1e6 * max_s);
}

/// A request whose whole reply is shown.
template <Request Type>
Reply ask(Session& cell, const Type& request) {
  return cell->request(std::string(request_info<Type>().name), arguments_of(request));
}

}  // namespace

int list(const Common& common) {
  const auto cells = list_cells(common.client.domain, Seconds{common.timeout_s}, common.client.profiles_file,
                                common.client.secure_directory, common.client.profile);
  if (common.json) {
    auto document = nlohmann::json::array();
    for (const auto& cell : cells)
      document.push_back({{"cell", cell.name},
                          {"servers", cell.servers},
                          {"status", cell.status ? json_of(*cell.status) : nlohmann::json()}});
    print_json(document);
    return cells.empty() ? kNoCell : kOk;
  }
  for (const auto& cell : cells) {
    if (cell.status)
      std::printf("%-20s %-8s at %.3f s, pace %s\n", cell.name.c_str(),
                  std::string(to_string(cell.status->state)).c_str(), cell.status->time,
                  std::string(to_string(cell.status->pace)).c_str());
    else
      std::printf("%-20s announced, but gives no status\n", cell.name.c_str());
    if (cell.servers > 1)
      std::printf("%-20s %d servers have this name; give the others another one (takt-server --cell)\n", "",
                  cell.servers);
  }
  if (cells.empty()) std::fprintf(stderr, "takt: no cell was found on domain %d.\n", common.client.domain);
  return cells.empty() ? kNoCell : kOk;
}

int status(const Common& common) {
  Session cell(common);
  const Status s = cell->status();
  const auto info = cell->cell();
  if (common.json) {
    auto document = json_of(s);
    document["cell"] = info->cell;
    document["scenario"] = info->scenario;
    document["server_version"] = info->server_version;
    print_json(document, 2);
    return 0;
  }
  std::printf("Cell '%s', scenario %s, step %g ms, server %s\n", info->cell.c_str(), info->scenario.c_str(),
              1e3 * info->step_size, info->server_version.c_str());
  const std::string levels = join(s.processes, ", ", [](const auto& process) {
    return process.name + " " + std::to_string(process.level_of_detail);
  });
  std::printf("  %-17s %s\n", "level of detail", levels.c_str());
  std::printf("  %-17s %s, %llu steps, %llu rejected\n", "solver", s.solver.c_str(),
              static_cast<unsigned long long>(s.solver_steps),
              static_cast<unsigned long long>(s.solver_rejected_steps));
  std::printf("  %-17s %s at %.3f s (step %llu, epoch %u)\n", "state",
              std::string(to_string(s.state)).c_str(), s.time, static_cast<unsigned long long>(s.step),
              s.epoch);
  if (s.pace == Pace::realtime)
    std::printf(
        "  %-17s %s x %g, %.2f ms behind, %llu overruns (%llu in a row at most), %llu schedule "
        "resets\n",
        "pace", std::string(to_string(s.pace)).c_str(), s.pace_factor, 1e3 * s.lag,
        static_cast<unsigned long long>(s.overruns),
        static_cast<unsigned long long>(s.max_consecutive_overruns),
        static_cast<unsigned long long>(s.schedule_resets));
  else
    std::printf("  %-17s %s\n", "pace", std::string(to_string(s.pace)).c_str());
  std::printf(
      "  %-17s %.3f (simulated per wall time); computation ratio %.5f (computed per simulated time)\n",
      "real-time factor", s.real_time_factor, s.computation_ratio);
  print_percentiles("step", s.step_time_p50, s.step_time_p99, s.step_time_max);
  print_percentiles("wake-up", s.wakeup_latency_p50, s.wakeup_latency_p99, s.wakeup_latency_max);
  print_percentiles("command to effect", s.command_latency_p50, s.command_latency_p99, s.command_latency_max);
  std::printf("  %-17s %llu applied, %llu rejected\n", "commands",
              static_cast<unsigned long long>(s.commands_applied),
              static_cast<unsigned long long>(s.commands_rejected));
  std::printf("  %-17s %llu calls made, %llu skipped\n", "collision",
              static_cast<unsigned long long>(s.mpr_calls), static_cast<unsigned long long>(s.mpr_skipped));
  if (s.contact_calls + s.contact_calls_skipped > 0)
    std::printf("  %-17s %u pairs press; %llu evaluations made, %llu skipped, %llu elements, %llu rebuilds\n",
                "surface contact", s.contact_pairs, static_cast<unsigned long long>(s.contact_calls),
                static_cast<unsigned long long>(s.contact_calls_skipped),
                static_cast<unsigned long long>(s.contact_elements),
                static_cast<unsigned long long>(s.contact_rebuilds));
  std::map<std::string, std::string> commanded;
  for (const auto& [target, sender] : s.owners) {
    std::string& targets = commanded[sender];
    targets += (targets.empty() ? "" : ", ") + target;
  }
  for (const auto& [sender, targets] : commanded)
    std::printf("  %-17s %s: %s\n", "commanded by", sender.c_str(), targets.c_str());
  std::printf("  %-17s %s\n", "scheduling", s.scheduling.c_str());
  for (const auto& gateway : s.gateways)
    std::printf("  %-17s %s: %s for %s, %s%s, %llu messages, %llu late\n", "gateway", gateway.name.c_str(),
                gateway.protocol.c_str(), list_names(gateway.targets).c_str(),
                gateway.connected      ? "connected with "
                : gateway.peer.empty() ? "no peer so far"
                                       : "not connected with ",
                gateway.peer.c_str(), static_cast<unsigned long long>(gateway.messages),
                static_cast<unsigned long long>(gateway.late));
  for (const auto& name : s.waiting_for) std::printf("  %-17s %s\n", "waiting for", name.c_str());
  if (!s.fault.empty()) std::printf("  %-17s %s\n", "fault", s.fault.c_str());
  return 0;
}

int step(const Common& common, std::uint64_t steps) {
  Session cell(common);
  cell->get_state();  // from here on the server is known to get what it is asked
  try {
    return report(common, ask(cell, requests::Step{steps}));
  } catch (const ClientError& error) {
    if (error.kind() != ClientError::Kind::timeout) throw;
    throw ClientError(ClientError::Kind::timeout,
                      std::string(error.what()) + " The server goes on with it; 'takt pause' ends it.");
  }
}

int pace(const Common& common, Pace pace, double factor) {
  Session cell(common);
  cell->set_pace(pace, factor);
  return report(common, ask(cell, requests::GetState{}));
}

}  // namespace takt::tool
