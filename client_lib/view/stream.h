#pragma once
// Buffer between a source (a running cell, a recording) and the viewers. A channel keeps its newest sample, or
// its newest kHistory samples where each one counts (events). A viewer reads at its own speed. The source never
// waits for a viewer, and a slow viewer misses samples.
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "idl/vocabulary/arguments.h"

namespace takt::view {

struct Channel {
  std::uint32_t id = 0;
  std::string topic, encoding, type, schema_encoding, schema;
  bool each_counts = false;  ///< the channel keeps the newest kHistory samples, not one
};

/// A sample. All viewers share its bytes.
struct Sample {
  std::uint64_t number = 0;  ///< counts the samples of its channel, from 1
  std::uint64_t time_ns = 0;
  std::shared_ptr<const std::string> bytes;
};

class Stream {
 public:
  static constexpr std::size_t kHistory = 1000;

  /// Ids are counted from 1.
  std::uint32_t add_channel(Channel channel);
  void push(std::uint32_t channel, std::uint64_t time_ns, std::string_view bytes);
  /// Deletes the channel's samples, e.g. because a player went back in time.
  void clear(std::uint32_t channel);

  /// Channels from the index `first` on. Channels are never removed.
  std::vector<Channel> channels_from(std::size_t first) const;
  /// Appends the samples after `number`, at most the newest one where not each counts.
  void after(std::uint32_t channel, std::uint64_t number, std::vector<Sample>& samples);
  /// The newest sample, or an empty one.
  Sample newest(std::uint32_t channel);

  /// Called in the thread of set_wanted() at a channel's first subscription and at the end of its last one.
  using OnWanted = std::function<void(const Channel&, bool wanted)>;
  void on_wanted(const void* owner, OnWanted function);
  /// Removes this owner's function. It is not called after the return.
  void forget(const void* owner);
  void set_wanted(std::uint32_t channel, bool wanted);

 private:
  struct Slot {
    Channel channel;
    std::string pending;  ///< the newest, not yet shared: most samples are never read
    std::uint64_t pending_time_ns = 0, pushed = 0;
    Sample shared;
    std::deque<Sample> history;
    int watchers = 0;
  };
  Slot& slot(std::uint32_t channel) { return *slots_.at(channel - 1); }
  static void share(Slot& slot);

  mutable std::mutex mutex_;
  std::vector<std::unique_ptr<Slot>> slots_;
  std::recursive_mutex wanted_mutex_;  ///< an OnWanted function may call set_wanted() for another channel
  std::vector<std::pair<const void*, OnWanted>> on_wanted_;  ///< guarded by wanted_mutex_
};

/// The thread of the server that exchanges the scenario answers this request.
bool is_for_host(std::string_view request);

/// Answer to a request of the control vocabulary.
struct Answer {
  ControlResult result = ControlResult::ok;
  std::string message;
  Arguments values;
};
/// Executes the request if it is one of these types; std::nullopt: it has another name. Wrong arguments are the answer.
template <Request... Types, typename Execute>
std::optional<Answer> answer_one_of(const std::string& name, const Arguments& arguments, Execute&& execute) {
  std::optional<Answer> answer;
  const auto answered = [&]<Request Type>(Type request) {
    if (name != request_info<Type>().name) return false;
    const auto fault = read_arguments(name, arguments, request);
    answer = fault ? Answer{fault->result, fault->sentence, {}} : execute(request);
    return true;
  };
  static_cast<void>((answered(Types{}) || ...));
  return answer;
}

/// May take its time; called in one thread.
using Control = std::function<Answer(const std::string& request, const Arguments& arguments)>;

}  // namespace takt::view
