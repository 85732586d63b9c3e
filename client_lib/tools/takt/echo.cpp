// takt echo: the samples of any topic, as JSON.
#include <cstdio>

#include "client_lib/tools/takt/commands.h"
#include "client_lib/tools/takt/sample_json.h"

namespace takt::tool {

std::vector<std::string> echo_topics() {
  std::vector<std::string> ids;
  for (const TopicInfo* topic : topics::kAll)
    if (topic->is_for_clients()) ids.emplace_back(topic->id);
  return ids;
}

int echo(const Common& common, const EchoOptions& options) {
  Session cell(common);
  topics::for_each([&](const auto& topic) {
    if (topic.id != options.topic) return;
    std::uint64_t seen = 0;
    for (std::uint64_t n = 0; n < options.count; ++n) {
      const auto sample = cell->wait_for(
          topic, [&](const auto& one) { return one.sample_number > seen; }, {}, options.robot);
      if (!sample)
        throw std::runtime_error("The cell has sent nothing on '" +
                                 topic.name(common.client.cell, options.robot) +
                                 "' within the time allowed (--timeout).");
      seen = sample->sample_number;
      print_json(json_of(*sample));
      std::fflush(stdout);
    }
  });
  return kOk;
}

}  // namespace takt::tool
