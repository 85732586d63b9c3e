#include "client_lib/discovery.h"

#include <algorithm>
#include <cctype>
#include <condition_variable>
#include <fstream>
#include <set>
#include <sstream>
#include <utility>

#include "client_lib/client.h"
#include "idl/transport/fastdds/server_participant.h"
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

void CellWatch::on_participant(const DdsGuid& guid, const std::string& name) {
  {
    const std::lock_guard lock(mutex_);
    if (name.empty())
      participants_.erase(guid);
    else
      participants_[guid] = name;
  }
  if (on_new_) on_new_();
}

std::vector<std::string> CellWatch::participants() const {
  const std::lock_guard lock(mutex_);
  std::vector<std::string> names;
  for (const auto& [guid, name] : participants_) names.push_back(name);
  return names;
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

namespace {

/// The cells of these participants, with the number of servers of each.
std::map<std::string, int> cells_of(const std::vector<std::string>& participants) {
  std::map<std::string, int> cells;
  const auto is_part_of_topics = [](unsigned char c) { return std::isalnum(c) != 0 || c == '_'; };
  for (const std::string& name : participants) {
    if (!name.starts_with(kServerParticipant)) continue;
    const std::string cell = name.substr(kServerParticipant.size());
    if (!cell.empty() && std::all_of(cell.begin(), cell.end(), is_part_of_topics)) ++cells[cell];
  }
  return cells;
}

/// A cell was found. Each expected server has announced its cell, and each announced cell has sent its status.
bool all_answered(const std::map<std::string, std::optional<Status>>& found,
                  const std::map<std::string, int>& announced, const std::map<std::string, int>& expected) {
  const auto answered = [&](const std::string& cell) {
    const auto place = found.find(cell);
    return place != found.end() && place->second.has_value();
  };
  return !announced.empty() && std::all_of(announced.begin(), announced.end(), [&](const auto& cell) {
    return answered(cell.first);
  }) && std::all_of(expected.begin(), expected.end(), [&](const auto& cell) {
    const auto place = announced.find(cell.first);
    return place != announced.end() && place->second >= cell.second;
  });
}

/// The number of participants of the domain on this machine, by their ports of discovery; 0 where the kernel does not say.
std::size_t participants_of_this_machine(int domain) {
  constexpr std::uint32_t kMaxParticipants = 120;  // the ports of a domain
  constexpr int kHexadecimal = 16;
  std::ifstream sockets("/proc/net/udp");
  std::string line;
  std::getline(sockets, line);  // the names of the columns
  std::set<std::uint32_t> ports;
  while (std::getline(sockets, line)) {
    std::string number, local;
    std::istringstream(line) >> number >> local;
    const std::size_t colon = local.find(':');
    if (colon != std::string::npos)
      ports.insert(
          static_cast<std::uint32_t>(std::strtoul(local.c_str() + colon + 1, nullptr, kHexadecimal)));
  }
  const rtps::PortParameters of_rtps;
  std::size_t count = 0;
  for (std::uint32_t id = 0; id < kMaxParticipants; ++id)
    count += ports.count(of_rtps.getUnicastPort(static_cast<std::uint32_t>(domain), id));
  return count;
}

}  // namespace

std::vector<FoundCell> list_cells(int domain, Seconds duration, const std::string& profiles_file,
                                  const std::string& secure_directory, const std::string& profile) {
  using StatusListener = client::ReaderListener<takt_msgs::msg::Status>;
  using Clock = std::chrono::steady_clock;
  // Below this an answer is no measure for the others: announcements are repeated each 100 ms.
  constexpr std::chrono::milliseconds kShortestQuiet{150}, kLook{10};
  // A port of this machine without a participant that this one can discover is not waited for any longer.
  constexpr std::chrono::seconds kDiscovery{2};
  const auto began = Clock::now();
  std::mutex mutex;
  std::condition_variable changed;
  std::map<std::string, std::optional<Status>> found;
  Clock::time_point newest = began;  ///< participant, announcement or first status
  // Below, what is declared first is destroyed last: listeners outlive the entities that call them.
  std::vector<std::unique_ptr<StatusListener>> listeners;
  bool announced = false;
  client::CellWatch watch([&] {
    const std::lock_guard lock(mutex);
    announced = true;
    newest = Clock::now();
    changed.notify_all();
  });
  client::Link link(domain, "takt-list", {profiles_file, secure_directory, profile}, &watch);

  const auto deadline = began + std::chrono::duration_cast<Clock::duration>(duration);
  // Without a profile the participants are those that the kernel lists: once all of them are known, no other is expected.
  const bool only_this_machine = profiles_file.empty();
  std::size_t participants = 0;
  std::unique_lock lock(mutex);
  for (;;) {
    announced = false;
    lock.unlock();  // a reader may be handed its first sample before create_reader returns
    // A server's participant is known ahead of its topics: its status then comes with them.
    const std::vector<std::string> names = watch.participants();
    const std::map<std::string, int> expected = cells_of(names), servers = watch.servers();
    std::set<std::string> cells;
    for (const auto* of : {&expected, &servers})
      for (const auto& [name, count] : *of) cells.insert(name);
    for (const std::string& name : cells) {
      lock.lock();
      const bool is_new = found.try_emplace(name).second;
      lock.unlock();
      if (!is_new) continue;
      listeners.push_back(std::make_unique<StatusListener>(
          [&, &slot = found[name]](takt_msgs::msg::Status&& sample, const client::GuidPrefix&) {
            const std::lock_guard guard(mutex);
            if (!slot) newest = Clock::now();
            slot = Status{std::move(sample)};
          }));
      link.create_reader(topics::status, topics::status.name(name), listeners.back().get());
    }
    lock.lock();
    const auto now = Clock::now();
    if (names.size() > participants) newest = now;
    participants = std::max(participants, names.size());
    const std::size_t of_this_machine = participants_of_this_machine(domain);  // this one included
    const bool all_discovered = names.size() + 1 >= of_this_machine;
    const bool nothing_expected = only_this_machine && of_this_machine > 0 && all_discovered;
    const auto quiet = std::max<Clock::duration>(kShortestQuiet, newest - began);
    const bool all_found =
        (all_discovered || now >= began + kDiscovery) && all_answered(found, servers, expected);
    if (now >= deadline || (all_found && (nothing_expected || now >= newest + quiet))) break;
    changed.wait_until(lock, std::min(deadline, now + kLook), [&] { return announced; });
  }

  std::vector<FoundCell> cells;
  const auto alive = watch.servers();
  for (const auto& [name, status] : found)
    if (const auto servers = alive.find(name); servers != alive.end())
      cells.push_back({name, status, servers->second});
  return cells;
}

}  // namespace takt
