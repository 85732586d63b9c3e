#pragma once
// Numbers for the senders of commands, so that the step loop can carry a sender along without text.
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
    if (is_new) texts_[place->second] = text_of(guid);
    return place->second;
  }
  /// Empty for 0 and for a number without a sender.
  std::string text(std::uint64_t id) const {
    const std::lock_guard lock(mutex_);
    const auto place = texts_.find(id);
    return place == texts_.end() ? std::string() : place->second;
  }

 private:
  mutable std::mutex mutex_;
  std::map<DdsGuid, std::uint64_t> ids_;
  std::map<std::uint64_t, std::string> texts_;
};

}  // namespace takt
