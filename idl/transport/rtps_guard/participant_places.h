#pragma once
// Places for the participants that DDS stores. A peer can announce participants that do not exist; a place
// belongs to a participant that answers, and silent ones give way.
#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>

namespace takt {

/// Of fixed size. Times in s of a clock that is never set.
class ParticipantPlaces {
 public:
  using Prefix = std::array<std::uint8_t, 12>;  ///< GUID prefix
  /// Participants in all, fewer than DDS stores; of one address, of which UDP ports allow 120 in a domain; silent ones beyond which the
  /// oldest give way.
  static constexpr std::size_t kPlaces = 240, kOfOneAddress = 128, kSilent = 64;
  /// Time for an answer: of any participant, and of one beyond kSilent.
  static constexpr std::uint32_t kAnswer_s = 30, kHurry_s = 2;
  static constexpr std::uint64_t kNoAddress = 0;  ///< shared memory: not counted

  struct Farewell {
    Prefix participant{};
    std::int64_t number = 0;  ///< sequence number beyond its announcements
  };

  /// A participant is announced. False if there is no place for it.
  bool announced(const Prefix& participant, std::uint64_t address, std::int64_t number, std::uint32_t now_s) {
    if (Place* place = find(participant)) {
      place->number = std::max(place->number, number);
      return true;
    }
    const auto of_address = static_cast<std::size_t>(std::count_if(
        begin(), end(), [&](const Place& one) { return address != kNoAddress && one.address == address; }));
    // What DDS did not take gives way at once.
    Place* untaken = oldest([&](const Place& one) {
      return !one.known && (of_address < kOfOneAddress || one.address == address);
    });
    const bool full = of_address >= kOfOneAddress || count_ == kPlaces;
    if (full && untaken == nullptr) return false;
    if (untaken != nullptr && (full || silent() >= kSilent)) erase(*untaken);
    places_[count_++] = {participant, address, number, now_s, now_s};
    return true;
  }
  /// DDS has stored this participant.
  void taken(const Prefix& participant) {
    if (Place* place = find(participant)) place->known = true;
  }
  void answered(const Prefix& participant) {
    if (Place* place = find(participant)) place->answers = true;
  }
  /// DDS has dropped this participant.
  void left(const Prefix& participant) {
    if (Place* place = find(participant)) erase(*place);
  }
  /// A participant that has to give way: DDS must drop it. Named again if it is still there kHurry_s later.
  std::optional<Farewell> overdue(std::uint32_t now_s) {
    const std::uint32_t patience_s = silent() > kSilent ? kHurry_s : kAnswer_s;
    Place* place = oldest([&](const Place& one) {
      return one.known && !one.answers && now_s - one.since_s >= patience_s && now_s >= one.due_from_s;
    });
    if (place == nullptr) return std::nullopt;
    place->due_from_s = now_s + kHurry_s;
    return Farewell{place->participant, place->number + 1};
  }
  std::size_t size() const { return count_; }

 private:
  struct Place {
    Prefix participant{};
    std::uint64_t address = kNoAddress;
    std::int64_t number = 0;
    std::uint32_t since_s = 0, due_from_s = 0;
    bool known = false, answers = false;
  };
  Place* begin() { return places_.data(); }
  Place* end() { return places_.data() + count_; }
  Place* find(const Prefix& participant) {
    Place* found =
        std::find_if(begin(), end(), [&](const Place& one) { return one.participant == participant; });
    return found == end() ? nullptr : found;
  }
  template <typename Condition>
  Place* oldest(Condition condition) {
    Place* found = std::find_if(begin(), end(), condition);
    return found == end() ? nullptr : found;
  }
  std::size_t silent() {
    return static_cast<std::size_t>(
        std::count_if(begin(), end(), [](const Place& one) { return !one.answers; }));
  }
  void erase(Place& place) {
    std::move(&place + 1, end(), &place);
    --count_;
  }

  std::array<Place, kPlaces> places_{};  ///< in the order of their first announcement
  std::size_t count_ = 0;
};

}  // namespace takt
