#pragma once
// Numbers for the senders of commands, so that the step loop can carry a sender along without text; and the names of the
// participants to which they belong.
#include <cstdint>
#include <map>
#include <mutex>
#include <string>

#include "idl/transport/fastdds/fastdds.h"

namespace takt {

class SenderRegistry {
 public:
  /// The number of a sender, from 1; constant for an identity during the life of the server.
  std::uint64_t id(const DdsGuid& guid) {
    const std::lock_guard lock(mutex_);
    const auto [place, is_new] = ids_.try_emplace(guid, ids_.size() + 1);
    if (is_new) guids_[place->second] = guid;
    return place->second;
  }
  /// The name of a participant that was discovered; an empty one once it is gone.
  void name(const DdsGuid& participant, const std::string& name) {
    const std::lock_guard lock(mutex_);
    if (name.empty())
      names_.erase(participant.guidPrefix);
    else
      names_[participant.guidPrefix] = name;
  }
  /// The name of the sender's participant, or the sender's identity where it has none.
  std::string name(std::uint64_t id) const {
    const std::lock_guard lock(mutex_);
    const auto sender = guids_.find(id);
    if (sender == guids_.end()) return {};
    const auto name = names_.find(sender->second.guidPrefix);
    return name == names_.end() ? text_of(sender->second) : name->second;
  }
  /// Empty for 0 and for a number without a sender.
  std::string text(std::uint64_t id) const {
    const std::lock_guard lock(mutex_);
    const auto sender = guids_.find(id);
    return sender == guids_.end() ? std::string() : text_of(sender->second);
  }

 private:
  mutable std::mutex mutex_;
  std::map<DdsGuid, std::uint64_t> ids_;
  std::map<std::uint64_t, DdsGuid> guids_;
  std::map<rtps::GuidPrefix_t, std::string> names_;  ///< of the participants that are there
};

}  // namespace takt
