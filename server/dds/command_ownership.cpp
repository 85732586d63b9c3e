#include "server/dds/command_ownership.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace takt {
namespace {

LivelinessTracker::Prefix prefix_of(const DdsGuid& guid) {
  LivelinessTracker::Prefix prefix{};
  std::copy_n(guid.guidPrefix.value, prefix.size(), prefix.begin());
  return prefix;
}

}  // namespace

void CommandOwnership::listen_for(LivelinessTracker* tracker, const DdsGuid& own) {
  tracker_ = tracker;
  own_ = own;
  for (auto& [guid, writer] : writers_) watch(guid, writer);
}

void CommandOwnership::watch(const DdsGuid& guid, CommandWriter& writer) {
  if (tracker_ == nullptr || own_.is_on_same_process_as(guid))
    writer.lease_s = std::numeric_limits<double>::infinity();
  if (std::isfinite(writer.lease_s)) tracker_->watch(prefix_of(guid));
}

double CommandOwnership::silence_s(const DdsGuid& guid) const {
  return tracker_->time_since_last_packet_s(prefix_of(guid));
}

void CommandOwnership::restart(std::size_t targets) {
  arbiters_.assign(targets, {});
  silent_owners_.clear();
  gone_.clear();
}

CommandWriter& CommandOwnership::add(const DdsGuid& guid, CommandWriter writer) {
  CommandWriter& added = writers_[guid] = std::move(writer);
  if (tracker_ != nullptr) watch(guid, added);
  return added;
}

void CommandOwnership::remove(const DdsGuid& guid) {
  writers_.erase(guid);
  gone_.erase(guid);
  const auto same = [&](const auto& other) { return other.first.guidPrefix == guid.guidPrefix; };
  if (tracker_ != nullptr && std::none_of(writers_.begin(), writers_.end(), same))
    tracker_->forget(prefix_of(guid));
}

std::optional<std::uint64_t> CommandOwnership::appeared(int target, const DdsGuid& guid, bool exclusive) {
  CommandArbiter& arbiter = arbiters_[static_cast<std::size_t>(target)];
  CommandArbiter::Sender sender;
  sender.id = senders_.id(guid);
  if (arbiter.knows(sender.id)) return std::nullopt;
  sender.exclusive = exclusive;
  std::copy_n(guid.guidPrefix.value, 12, sender.identity.begin());
  std::copy_n(guid.entityId.value, 4, sender.identity.begin() + 12);
  if (const auto writer = writers_.find(guid); writer != writers_.end()) {
    if (writer->second.expired) return std::nullopt;
    sender.strength = writer->second.strength;
    const CommandKind kind = writer->second.command.kind;
    if (kind == CommandKind::trajectory) sender.topic = 1;
    if (kind == CommandKind::several) sender.topic = CommandArbiter::kSeveral;
  }
  return arbiter.appeared(sender);
}

std::optional<std::uint64_t> CommandOwnership::matched(int target, const DdsGuid& guid, bool exclusive) {
  gone_.erase(guid);
  // Which targets a sender for several commands, its commands say.
  return target < 0 ? std::nullopt : appeared(target, guid, exclusive);
}

void CommandOwnership::unmatched(int target, const DdsGuid& guid) {
  const std::uint64_t sender = senders_.id(guid);
  if (target >= 0) arbiters_[static_cast<std::size_t>(target)].vanished(sender);
  if (target < 0)
    for (CommandArbiter& arbiter : arbiters_) arbiter.vanished(sender);
  gone_.insert(guid);
}

std::optional<CommandArbiter::Verdict> CommandOwnership::on_command(int target, const DdsGuid& guid,
                                                                    bool exclusive, std::int64_t received_ns,
                                                                    std::optional<std::uint64_t>& loser) {
  if (gone_.contains(guid)) return std::nullopt;
  if (const auto writer = writers_.find(guid); writer != writers_.end()) writer->second.expired = false;
  // DDS delivers samples and matches from different threads: a first command may arrive ahead of its sender's
  // match.
  loser = appeared(target, guid, exclusive);
  return arbiters_[static_cast<std::size_t>(target)].offered(senders_.id(guid), received_ns);
}

std::vector<std::uint64_t> CommandOwnership::owners() const {
  std::vector<std::uint64_t> owners(arbiters_.size());
  std::ranges::transform(arbiters_, owners.begin(), &CommandArbiter::owner);
  return owners;
}

std::span<CommandArbiter> CommandOwnership::arbiters_of(const CommandWriter& writer) {
  if (writer.command.kind == CommandKind::several) return arbiters_;
  if (writer.command.target < 0) return {};
  return {&arbiters_[static_cast<std::size_t>(writer.command.target)], 1};
}

std::vector<CommandOwnership::Revoked> CommandOwnership::expire() {
  for (auto& [guid, writer] : writers_) {
    if (!std::isfinite(writer.lease_s)) continue;
    const bool keeps_lease = silence_s(guid) < writer.lease_s;
    // One that is heard of again takes part with its next command.
    if (std::exchange(writer.expired, !keeps_lease) || keeps_lease) continue;
    const std::uint64_t sender = senders_.id(guid);
    for (CommandArbiter& arbiter : arbiters_of(writer)) {
      if (arbiter.owns(sender)) silent_owners_[static_cast<int>(&arbiter - arbiters_.data())] = guid;
      arbiter.vanished(sender);
    }
  }
  std::vector<Revoked> revoked;
  std::erase_if(silent_owners_, [&](const auto& owner) {
    const auto& [target, guid] = owner;
    const auto found = writers_.find(guid);
    if (found == writers_.end() || !found->second.expired) return true;
    for (const auto& [other, writer] : writers_) {
      const bool commands_it = writer.command.kind == CommandKind::several || writer.command.target == target;
      if (writer.expired || other.guidPrefix == guid.guidPrefix || !commands_it) continue;
      revoked.push_back({target, guid, silence_s(guid)});
      return true;
    }
    return false;
  });
  return revoked;
}

}  // namespace takt
