#pragma once
// Who may command one robot or gripper. Two senders never interleave.
//
// Exclusive senders (takt's clients) are arbitrated by DDS itself: the strongest that is alive is heard,
// among equals the one with the lower identity; they come before all others. Shared senders (stock ROS 2
// publishers) know no ownership: here the first of them that sends owns the target until it goes away.
#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

namespace takt {

class CommandArbiter {
 public:
  struct Sender {
    std::uint64_t id = 0;
    bool exclusive = false;
    std::uint32_t strength = 0;
    std::array<std::uint8_t, 16>
        identity{};            ///< orders exclusive senders of equal strength: the lower one is heard
    std::int64_t told_ns = 0;  ///< when this sender was last told that it is not heard
  };
  struct Verdict {
    bool heard = false;
    std::uint64_t owner = 0;  ///< the sender that is heard instead
    bool tell = false;        ///< say so in an event: not more often than once a second per sender
  };

  /// A sender appeared. Returns the exclusive sender that will not be heard beside a stronger one, if there
  /// is one now that was not announced before.
  std::optional<std::uint64_t> appeared(const Sender& sender) {
    vanished(sender.id);
    const Sender* before = strongest();
    const std::optional<Sender> strongest_before = before != nullptr ? std::optional(*before) : std::nullopt;
    senders_.push_back(sender);
    if (!sender.exclusive || !strongest_before) return std::nullopt;
    return strongest()->id == sender.id ? strongest_before->id : sender.id;
  }

  void vanished(std::uint64_t id) {
    std::erase_if(senders_, [&](const Sender& sender) { return sender.id == id; });
    if (shared_owner_ == id) shared_owner_ = 0;
    if (exclusive_heard_ == id) exclusive_heard_ = 0;
  }

  bool knows(std::uint64_t id) const {
    return std::any_of(senders_.begin(), senders_.end(),
                       [&](const Sender& sender) { return sender.id == id; });
  }

  /// A valid command came in from this sender.
  Verdict offered(std::uint64_t id, std::int64_t now_ns) {
    const auto place =
        std::find_if(senders_.begin(), senders_.end(), [&](const Sender& sender) { return sender.id == id; });
    if (place == senders_.end()) return {};
    if (place->exclusive) {  // DDS has already chosen
      exclusive_heard_ = id;
      return {true, id, false};
    }
    if (exclusive_heard_ == 0 && (shared_owner_ == 0 || shared_owner_ == id)) {
      shared_owner_ = id;
      return {true, id, false};
    }
    const bool tell = place->told_ns == 0 || now_ns - place->told_ns >= 1'000'000'000;
    if (tell) place->told_ns = now_ns;
    return {false, exclusive_heard_ != 0 ? exclusive_heard_ : shared_owner_, tell};
  }

 private:
  const Sender* strongest() const {
    const Sender* best = nullptr;
    for (const Sender& sender : senders_) {
      if (!sender.exclusive) continue;
      const bool stronger =
          best != nullptr && (sender.strength > best->strength ||
                              (sender.strength == best->strength && sender.identity < best->identity));
      if (best == nullptr || stronger) best = &sender;
    }
    return best;
  }

  std::vector<Sender> senders_;
  std::uint64_t shared_owner_ = 0;
  std::uint64_t exclusive_heard_ = 0;  ///< the exclusive sender of the newest command, while it lives
};

}  // namespace takt
