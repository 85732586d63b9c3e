#pragma once
// Decides which sender may command a robot or gripper. Two senders never interleave.
//
// DDS itself arbitrates exclusive senders (takt's clients): the strongest live sender owns the target, among
// equals the one with the lower identity; they precede all others. Shared senders (stock ROS 2 publishers)
// have no ownership: the first of them that sends owns the target until it disappears.
//
// A robot is commanded on two topics, set-points and trajectories. DDS arbitrates on each by itself; here the
// same order holds across them, and one participant may use both.
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
    /// Orders exclusive senders of equal strength: the lower one owns the target.
    std::array<std::uint8_t, 16> identity{};
    int topic = 0;                 ///< which of the target's topics; kSeveral: of several targets
    bool spoke = false;            ///< has sent a command
    std::int64_t reported_ns = 0;  ///< time of the last report that this sender has no effect
  };
  struct Verdict {
    bool heard = false;
    std::uint64_t owner = 0;  ///< the sender that is heard instead
    bool report = false;      ///< true: an event reports it, at most once a second per sender
  };

  static constexpr int kSeveral = 2;

  /// Adds a sender. Returns the exclusive sender without effect beside a stronger one, if there is one and it
  /// was not reported yet.
  std::optional<std::uint64_t> appeared(const Sender& sender) {
    vanished(sender.id);
    const Sender* before = strongest();
    const std::optional<Sender> strongest_before = before != nullptr ? std::optional(*before) : std::nullopt;
    senders_.push_back(sender);
    if (!sender.exclusive || !strongest_before || together(sender, *strongest_before)) return std::nullopt;
    return stronger(sender, *strongest_before) ? strongest_before->id : sender.id;
  }

  void vanished(std::uint64_t id) {
    std::erase_if(senders_, [&](const Sender& sender) { return sender.id == id; });
    if (shared_owner_ == id) shared_owner_ = 0;
    if (exclusive_heard_ == id) exclusive_heard_ = 0;
  }

  /// The sender whose commands are heard; 0 while none has sent any.
  std::uint64_t owner() const { return exclusive_heard_ != 0 ? exclusive_heard_ : shared_owner_; }

  /// Whether this sender owns the target.
  bool owns(std::uint64_t id) const {
    return find(id) != nullptr && (exclusive_heard_ == id || shared_owner_ == id);
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
    place->spoke = true;
    std::uint64_t owner = exclusive_heard_;
    if (place->exclusive) {
      const Sender* other = stronger_than(*place);
      if (other == nullptr) {
        exclusive_heard_ = id;
        return {true, id, false};
      }
      owner = other->id;
    } else if (exclusive_heard_ == 0) {
      const Sender* first = find(shared_owner_);
      if (first == nullptr || first->id == id || together(*first, *place)) {
        if (first == nullptr) shared_owner_ = id;
        return {true, id, false};
      }
      owner = shared_owner_;
    }
    const bool report = place->reported_ns == 0 || now_ns - place->reported_ns >= 1'000'000'000;
    if (report) place->reported_ns = now_ns;
    return {false, owner, report};
  }

 private:
  static constexpr std::size_t kParticipantBytes = 12;  ///< of an identity

  /// One participant's senders on different topics.
  static bool together(const Sender& a, const Sender& b) {
    return a.topic != b.topic &&
           std::equal(a.identity.begin(), a.identity.begin() + kParticipantBytes, b.identity.begin());
  }
  static bool stronger(const Sender& a, const Sender& b) {
    return a.strength > b.strength || (a.strength == b.strength && a.identity < b.identity);
  }
  const Sender* find(std::uint64_t id) const {
    const auto place =
        std::find_if(senders_.begin(), senders_.end(), [&](const Sender& sender) { return sender.id == id; });
    return place == senders_.end() ? nullptr : &*place;
  }
  /// On a target's own topic DDS has already chosen.
  const Sender* stronger_than(const Sender& sender) const {
    for (const Sender& other : senders_) {
      const bool chosen = other.topic == sender.topic && sender.topic != kSeveral;
      if (other.exclusive && other.spoke && !chosen && !together(other, sender) && stronger(other, sender))
        return &other;
    }
    return nullptr;
  }
  const Sender* strongest() const {
    const Sender* best = nullptr;
    for (const Sender& sender : senders_) {
      if (sender.exclusive && (best == nullptr || stronger(sender, *best))) best = &sender;
    }
    return best;
  }

  std::vector<Sender> senders_;
  std::uint64_t shared_owner_ = 0;
  std::uint64_t exclusive_heard_ = 0;  ///< the exclusive sender of the newest command, while it lives
};

}  // namespace takt
