#include "client_lib/view/stream.h"

namespace takt::view {

bool is_for_host(std::string_view request) {
  const RequestInfo* info = find_request(request);
  return info != nullptr && info->phase == RequestPhase::host;
}

std::uint32_t Stream::add_channel(Channel channel) {
  const std::lock_guard lock(mutex_);
  channel.id = static_cast<std::uint32_t>(slots_.size() + 1);
  slots_.push_back(std::make_unique<Slot>());
  slots_.back()->channel = std::move(channel);
  return slots_.back()->channel.id;
}

void Stream::push(std::uint32_t channel, std::uint64_t time_ns, std::string_view bytes) {
  const std::lock_guard lock(mutex_);
  Slot& to = slot(channel);
  to.pending.assign(bytes);
  to.pending_time_ns = time_ns;
  ++to.pushed;
  if (!to.channel.each_counts) return;
  share(to);
  to.history.push_back(to.shared);
  if (to.history.size() > kHistory) to.history.pop_front();
}

void Stream::clear(std::uint32_t channel) {
  const std::lock_guard lock(mutex_);
  Slot& cleared = slot(channel);
  cleared.history.clear();
  cleared.shared = {cleared.pushed, 0, nullptr};
}

void Stream::share(Slot& slot) {
  if (slot.shared.number == slot.pushed) return;
  slot.shared = {slot.pushed, slot.pending_time_ns, std::make_shared<const std::string>(slot.pending)};
}

std::vector<Channel> Stream::channels_from(std::size_t first) const {
  const std::lock_guard lock(mutex_);
  std::vector<Channel> channels;
  for (std::size_t i = first; i < slots_.size(); ++i) channels.push_back(slots_[i]->channel);
  return channels;
}

void Stream::after(std::uint32_t channel, std::uint64_t number, std::vector<Sample>& samples) {
  const std::lock_guard lock(mutex_);
  Slot& from = slot(channel);
  if (from.pushed <= number) return;
  if (from.channel.each_counts) {
    for (const Sample& sample : from.history)
      if (sample.number > number) samples.push_back(sample);
    return;
  }
  share(from);
  if (from.shared.bytes) samples.push_back(from.shared);
}

Sample Stream::newest(std::uint32_t channel) {
  const std::lock_guard lock(mutex_);
  Slot& from = slot(channel);
  share(from);
  return from.shared;
}

void Stream::on_wanted(const void* owner, OnWanted function) {
  const std::lock_guard wanted_lock(wanted_mutex_);
  on_wanted_.emplace_back(owner, std::move(function));
}

void Stream::forget(const void* owner) {
  const std::lock_guard wanted_lock(wanted_mutex_);
  std::erase_if(on_wanted_, [&](const auto& entry) { return entry.first == owner; });
}

void Stream::set_wanted(std::uint32_t channel, bool wanted) {
  const std::lock_guard wanted_lock(wanted_mutex_);
  Channel changed;
  {
    const std::lock_guard lock(mutex_);
    Slot& of = slot(channel);
    of.watchers += wanted ? 1 : -1;
    if (of.watchers != (wanted ? 1 : 0)) return;
    changed = of.channel;
  }
  for (const auto& [owner, notify] : on_wanted_) notify(changed, wanted);
}

}  // namespace takt::view
