#pragma once
// A set-associative LRU table of fixed size. A set evicts its least recently used entry.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

namespace takt {

/// `Entry` has a member `key`, 0 for an empty entry.
template <typename Entry, std::size_t Sets, std::size_t Ways = 4>
class LruTable {
 public:
  /// nullptr for an unknown key. A successful search counts as a use.
  Entry* find(std::uint64_t key) {
    auto& set = set_of(key);
    const auto found =
        std::find_if(set.begin(), set.end(), [&](const Entry& entry) { return entry.key == key; });
    if (found == set.end()) return nullptr;
    std::rotate(set.begin(), found, found + 1);
    return &set.front();
  }
  /// Replaces the least recently used entry of the set; the result is empty except for its key.
  Entry& insert(std::uint64_t key) {
    return *insert_for(key, [](const Entry&) { return true; });
  }
  /// Replaces an entry that `expendable` accepts; nullptr if the set is full and has no such entry.
  template <typename Condition>
  Entry* insert_for(std::uint64_t key, Condition expendable) {
    auto& set = set_of(key);
    const auto victim = std::find_if(set.rbegin(), set.rend(),
                                     [&](const Entry& entry) { return entry.key == 0 || expendable(entry); });
    if (victim == set.rend()) return nullptr;
    std::rotate(set.begin(), victim.base() - 1, victim.base());
    set.front() = {};
    set.front().key = key;
    return &set.front();
  }

  /// Visits all entries; emptied entries are reused first.
  template <typename Condition>
  void erase_if(Condition condition) {
    for (Set& set : sets_) {
      const auto rest = std::remove_if(
          set.begin(), set.end(), [&](const Entry& entry) { return entry.key != 0 && condition(entry); });
      std::fill(rest, set.end(), Entry{});
    }
  }

 private:
  using Set = std::array<Entry, Ways>;
  Set& set_of(std::uint64_t key) { return sets_[(key >> 20U) % Sets]; }
  std::array<Set, Sets> sets_{};
};

}  // namespace takt
