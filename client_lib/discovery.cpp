#include "client_lib/discovery.h"

#include <condition_variable>

#include "client_lib/client.h"
#include "takt_topics.h"

namespace takt {
namespace client {

void CellWatch::on_writer(const DiscoveredWriter& writer) {
  if (writer.type != topics::status.type->dds_type) return;
  const std::string& topic = writer.topic;
  const std::string prefix = "rt/", suffix = "/" + std::string(topics::status.last_level());
  if (!topic.starts_with(prefix) || !topic.ends_with(suffix) || topic.size() <= prefix.size() + suffix.size())
    return;
  {
    const std::lock_guard lock(mutex_);
    if (writer.news == DiscoveredWriter::News::gone)
      cells_.erase(writer.guid);
    else
      cells_[writer.guid] = topic.substr(prefix.size(), topic.size() - prefix.size() - suffix.size());
  }
  if (on_new_) on_new_();
}

std::vector<std::string> CellWatch::names() const {
  std::vector<std::string> names;
  for (const auto& [name, count] : servers()) names.push_back(name);
  return names;
}

std::map<std::string, int> CellWatch::servers() const {
  const std::lock_guard lock(mutex_);
  std::map<std::string, int> servers;
  for (const auto& [guid, name] : cells_) ++servers[name];
  return servers;
}

}  // namespace client

std::vector<FoundCell> list_cells(int domain, Seconds duration, const std::string& profiles_file,
                                  const std::string& secure_directory, const std::string& profile) {
  using StatusListener = client::ReaderListener<takt_msgs::msg::Status>;
  std::mutex mutex;
  std::condition_variable changed;
  std::map<std::string, std::optional<Status>> found;
  // Below, what is declared first is destroyed last: listeners outlive the entities that call them.
  std::vector<std::unique_ptr<StatusListener>> listeners;
  bool announced = false;
  client::CellWatch watch([&] {
    const std::lock_guard lock(mutex);
    announced = true;
    changed.notify_all();
  });
  client::Link link(domain, "takt-list", {profiles_file, secure_directory, profile}, &watch);

  const auto deadline = std::chrono::steady_clock::now() +
                        std::chrono::duration_cast<std::chrono::steady_clock::duration>(duration);
  std::unique_lock lock(mutex);
  do {
    announced = false;
    lock.unlock();  // a reader may be handed its first sample before create_reader returns
    for (const std::string& name : watch.names()) {
      lock.lock();
      const bool is_new = found.try_emplace(name).second;
      lock.unlock();
      if (!is_new) continue;
      listeners.push_back(std::make_unique<StatusListener>(
          [&mutex, &slot = found[name]](const takt_msgs::msg::Status& sample, const client::GuidPrefix&) {
            const std::lock_guard guard(mutex);
            slot = Status{sample};
          }));
      link.create_reader(topics::status, topics::status.name(name), listeners.back().get());
    }
    lock.lock();
  } while (changed.wait_until(lock, deadline, [&] { return announced; }));

  std::vector<FoundCell> cells;
  const auto alive = watch.servers();
  for (const auto& [name, status] : found)
    if (const auto servers = alive.find(name); servers != alive.end())
      cells.push_back({name, status, servers->second});
  return cells;
}

}  // namespace takt
