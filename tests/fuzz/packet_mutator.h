#pragma once
// Makes bad packets from good ones, the same ones for the same seed.
#include <algorithm>
#include <cstdint>
#include <map>
#include <random>
#include <vector>

#include "tests/fuzz/packet_hook.h"

namespace takt::test {

class PacketMutator {
 public:
  using Bytes = std::vector<std::uint8_t>;
  using Recorded = PacketHook::Recorded;

  /// Further packets are derived from those recorded: kinds that a healthy network rarely shows.
  PacketMutator(std::vector<Recorded> recorded, std::uint64_t seed)
      : seeds_(std::move(recorded)), random_(seed) {
    const std::size_t count = seeds_.size();
    for (std::size_t i = 0; i < count; ++i) derive(i);
  }
  std::size_t seeds() const { return seeds_.size(); }

  struct Packet {
    std::size_t channel;
    Bytes bytes;
  };
  Packet next() {
    const Recorded& seed = seeds_[below(seeds_.size())];
    Packet packet{seed.channel, seed.bytes};
    if (below(2) == 0) renumber(packet.bytes);
    if (below(10) == 0) return packet;  // good ones in between keep the endpoints matched
    for (std::size_t n = 1 + below(4); n > 0; --n) mutate(packet.bytes);
    // The number of a participant within its process: never that of another client, because only security
    // prevents a participant from imitating another one.
    constexpr std::size_t from = 16, to = 20;
    if (packet.bytes.size() >= to)
      std::copy(seed.bytes.begin() + from, seed.bytes.begin() + to, packet.bytes.begin() + from);
    return packet;
  }

 private:
  struct Submessage {
    std::size_t start, body, end;
    std::uint8_t id, flags;
  };
  static std::vector<Submessage> submessages(const Bytes& packet) {
    std::vector<Submessage> found;
    for (std::size_t at = 20; at + 4 <= packet.size();) {
      const std::uint8_t flags = packet[at + 1];
      std::size_t length =
          (flags & 1U) != 0 ? packet[at + 2] + 256U * packet[at + 3] : 256U * packet[at + 2] + packet[at + 3];
      if (at + 4 + length > packet.size()) break;
      if (length == 0 && packet[at] != 0x09) length = packet.size() - at - 4;
      found.push_back({at, at + 4, at + 4 + length, packet[at], flags});
      at += 4 + length;
    }
    return found;
  }

  static void put(Bytes& bytes, std::uint32_t value, int size) {
    for (int i = 0; i < size; ++i)
      bytes.push_back(static_cast<std::uint8_t>(value >> static_cast<unsigned>(8 * i)));
  }
  void add(std::size_t channel, const Bytes& packet, const Submessage& after, std::uint8_t id,
           const Bytes& body) {
    Bytes made(packet.begin(), packet.begin() + static_cast<std::ptrdiff_t>(after.start));
    made.push_back(id);
    made.push_back(1);
    put(made, static_cast<std::uint32_t>(body.size()), 2);
    made.insert(made.end(), body.begin(), body.end());
    seeds_.push_back({channel, std::move(made)});
  }
  /// From heartbeats: gaps, fragments of heartbeats and of data; from acknowledgements: requests for
  /// fragments; from discovery data: the same with a type object.
  void derive(std::size_t index) {
    if (seeds_.size() > 6000) return;
    const Recorded source = seeds_[index];
    for (const Submessage& sub : submessages(source.bytes)) {
      if ((sub.flags & 1U) == 0 || sub.end - sub.body < 16) continue;
      const auto part = [&](std::size_t from, std::size_t count) {
        const auto begin = source.bytes.begin() + static_cast<std::ptrdiff_t>(sub.body + from);
        return Bytes(begin, begin + static_cast<std::ptrdiff_t>(count));
      };
      if (sub.id == 0x07) {
        const std::uint32_t last = source.bytes[sub.body + 20];
        Bytes gap = part(0, 8), fragment, beat = part(0, 8);
        for (const std::uint32_t word : {0U, last + 1, 0U, last + 3, 4U, 0xa0000000U}) put(gap, word, 4);
        add(source.channel, source.bytes, sub, 0x08, gap);
        for (const std::uint32_t word : {0U, last + 1, 3U, 1U}) put(beat, word, 4);
        add(source.channel, source.bytes, sub, 0x13, beat);
        put(fragment, 28U << 16U, 4);
        const Bytes ids = part(0, 8);
        fragment.insert(fragment.end(), ids.begin(), ids.end());
        for (const std::uint32_t word : {0U, last + 1, 1U, 1U | 200U << 16U, 500U}) put(fragment, word, 4);
        put(fragment, 0x0100, 4);
        fragment.resize(fragment.size() + 196, 1);
        add(source.channel, source.bytes, sub, 0x16, fragment);
      } else if (sub.id == 0x06) {
        Bytes request = part(0, 8);
        for (const std::uint32_t word : {0U, 1U, 1U, 2U, 0xc0000000U, 1U}) put(request, word, 4);
        add(source.channel, source.bytes, sub, 0x12, request);
      } else if (sub.id == 0x15 && (sub.flags & 6U) == 4 && sub.end - sub.body > 28 &&
                 source.bytes[sub.body + 11] == 0xc2) {
        for (const std::uint32_t id : {0x0072U, 0x0075U, 0x0069U, 0x0035U, 0x8006U}) {
          Bytes body = part(0, 24);
          put(body, id, 2);
          put(body, 64, 2);
          put(body, 0x0100, 4);
          for (int i = 0; i < 60; ++i)
            put(body, below(4) == 0 ? static_cast<std::uint32_t>(random_()) : 0U, 1);
          const Bytes rest = part(24, sub.end - sub.body - 24);
          body.insert(body.end(), rest.begin(), rest.end());
          add(source.channel, source.bytes, sub, 0x15, body);
          seeds_.back().bytes[sub.start + 1] = sub.flags;
        }
      }
    }
  }

  /// A received sample is not read again: gives it the next number of its writer, sometimes an old one.
  /// Submessages about numbers (heartbeats, gaps) get numbers near it.
  void renumber(Bytes& packet) {
    // Fast DDS remembers each number of a gap, and walks over all of them for every packet: seldom.
    const bool speaks_of_these = below(64) == 0;
    for (const Submessage& sub : submessages(packet)) {
      const std::size_t size = sub.end - sub.body;
      if ((sub.flags & 1U) == 0 || size < 20) continue;
      const auto writer_at = [&](std::size_t at) -> std::uint32_t& {
        std::uint32_t writer = 0;
        for (std::size_t i = 0; i < 4; ++i) writer = writer << 8U | packet[sub.body + at + i];
        return numbers_.try_emplace(writer, 20U).first->second;
      };
      if (sub.id == 0x15 || sub.id == 0x16) {
        std::uint32_t& next = writer_at(8);
        const std::uint32_t number = below(16) == 0 ? back(next, 4) : next++;
        write(packet, sub.body + 16, number, 4);
      } else if (!speaks_of_these) {
        continue;
      } else if (sub.id == 0x07 && size >= 28) {
        const std::uint32_t last = back(writer_at(4), 4), first = back(last, 40);
        write(packet, sub.body + 12, first, 4);
        write(packet, sub.body + 20, last, 4);
        if (below(2) == 0) write(packet, sub.body + 24, beats_ += 1, 4);
      } else if (sub.id == 0x08 && size >= 28) {
        const std::uint32_t base = back(writer_at(4), 4), start = back(base, 4);
        write(packet, sub.body + 12, start, 4);
        write(packet, sub.body + 20, base, 4);
      }
    }
  }
  std::uint32_t back(std::uint32_t number, std::size_t most) {
    const auto by = static_cast<std::uint32_t>(below(most));
    return number > by ? number - by : 1;
  }

  void mutate(Bytes& packet) {
    if (packet.size() < 24) packet.resize(24);
    // Mostly behind the header, whose change would only make it another participant's packet.
    const std::size_t first = below(20) == 0 ? 0 : 20;
    const std::size_t at = first + below(packet.size() - first);
    static constexpr std::uint32_t edges[] = {0,      1,          2,          3,          0x7f,
                                              0x80,   0xff,       0x100,      4095,       0x7fff,
                                              0x8000, 0xffffffff, 0x7fffffff, 0x80000000, 0xfffffffc};
    switch (below(12)) {
      case 0:
      case 1:
        packet[at] ^= static_cast<std::uint8_t>(1U << below(8));
        break;
      case 2:
        packet[at] = static_cast<std::uint8_t>(random_());
        break;
      case 3:
        packet[at] = static_cast<std::uint8_t>(edges[below(std::size(edges))]);
        break;
      case 4:
      case 5:
        write(packet, at & ~std::size_t{1}, edges[below(std::size(edges))], 2);
        break;
      case 6:
      case 7:
        write(packet, at & ~std::size_t{3}, edges[below(std::size(edges))], 4);
        break;
      case 8:
        packet.resize(at);
        break;
      case 9: {
        const std::size_t count = std::min<std::size_t>(4 * (1 + below(8)), packet.size() - at);
        const Bytes piece(packet.begin() + static_cast<std::ptrdiff_t>(at),
                          packet.begin() + static_cast<std::ptrdiff_t>(at + count));
        packet.insert(packet.begin() + static_cast<std::ptrdiff_t>(at), piece.begin(), piece.end());
        break;
      }
      case 10: {
        const Bytes& other = seeds_[below(seeds_.size())].bytes;
        if (other.size() > 24) packet.insert(packet.end(), other.begin() + 20, other.end());
        break;
      }
      default: {  // a submessage's own words: id, flags, length, ids, numbers
        const auto subs = submessages(packet);
        if (subs.empty()) break;
        const Submessage& sub = subs[below(subs.size())];
        const std::size_t word = sub.start + 4 * below(11);
        if (word + 4 <= packet.size())
          write(packet, word + below(4), static_cast<std::uint32_t>(random_()), 1 + below(4));
      }
    }
    constexpr std::size_t largest = 65000;
    if (packet.size() > largest) packet.resize(largest);
  }
  static void write(Bytes& packet, std::size_t at, std::uint32_t value, std::size_t size) {
    for (std::size_t i = 0; i < size && at + i < packet.size(); ++i)
      packet[at + i] = static_cast<std::uint8_t>(value >> 8U * i);
  }
  std::size_t below(std::size_t count) { return static_cast<std::size_t>(random_() % count); }

  std::vector<Recorded> seeds_;
  std::map<std::uint32_t, std::uint32_t> numbers_;
  std::uint32_t beats_ = 100;
  std::mt19937_64 random_;
};

}  // namespace takt::test
