#pragma once
// Finds the writers and readers of a domain by discovery, as every participant may.
#include <chrono>
#include <condition_variable>
#include <map>
#include <mutex>
#include <stdexcept>
#include <string>

#include "client_lib/dds_link.h"
#include "tests/support/foreign_sender.h"

namespace takt::test {

class WriterSpy final : public DiscoveryListener {
 public:
  explicit WriterSpy(std::uint32_t domain) : link_(static_cast<int>(domain), "spy", {}, this) {}

  void on_writer(const DiscoveredWriter& writer) override {
    if (writer.news == DiscoveredWriter::News::gone) return;
    const std::lock_guard lock(mutex_);
    writers_[writer.topic] = writer.guid;
    changed_.notify_all();
  }
  /// `topic` without "rt/".
  DdsGuid writer_of(const std::string& topic) {
    std::unique_lock lock(mutex_);
    const std::string name = "rt/" + topic;
    if (!changed_.wait_for(lock, std::chrono::seconds(60), [&] { return writers_.contains(name); }))
      throw std::runtime_error("no writer of " + topic);
    return writers_.at(name);
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::map<std::string, DdsGuid> writers_;
  client::Link link_;  // last: it calls the listener
};

inline GuidPrefixBytes prefix_of(const DdsGuid& guid) {
  GuidPrefixBytes prefix{};
  std::copy_n(guid.guidPrefix.value, prefix.size(), prefix.begin());
  return prefix;
}
inline std::uint32_t entity_of(const DdsGuid& guid) {
  std::uint32_t entity = 0;
  for (const auto byte : guid.entityId.value) entity = entity << 8U | byte;
  return entity;
}

}  // namespace takt::test
