#pragma once
// Holds packets of one thread back, so that they leave as one, like TCP_CORK: a controller's commands for several robots
// cost one system call and wake their reader once. RTPS allows it: a packet is a header of its participant and any number
// of submessages (OMG DDSI-RTPS 2.3, 8.3.3).
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "idl/transport/fastdds/fastdds.h"

namespace takt {

/// While one lives, packets that its thread sends to the same address wait, and leave when it ends. One within another has
/// no effect.
class PacketCork {
 public:
  PacketCork();
  ~PacketCork();
  PacketCork(const PacketCork&) = delete;
  PacketCork& operator=(const PacketCork&) = delete;

  /// That of the calling thread; nullptr without one.
  static PacketCork* of_thread();

  /// Takes the packet over, unless it cannot be joined with others to at most `most_bytes`. Then those that wait for the
  /// same address have left, so that the order is kept, and the caller sends this one.
  bool hold(rtps::SenderResource& sender, const rtps::Locator_t& to, std::span<const std::uint8_t> packet,
            std::size_t most_bytes);

 private:
  struct Waiting {
    rtps::SenderResource* sender = nullptr;
    rtps::Locator_t to;
    std::vector<std::uint8_t> packet;  ///< empty: the place is free
  };
  Waiting* waiting_for(const rtps::SenderResource& sender, const rtps::Locator_t& to);
  Waiting& free_place();
  static void send(Waiting& waiting);

  bool outer_ = false;
  std::vector<Waiting>& places_;  ///< of the thread, which keeps their memory
};

/// The part of an RTPS packet that can stand in a longer one: without a trailing submessage of statistics, which only Fast
/// DDS has and which ends its process elsewhere. Empty if the packet cannot be joined: it is of discovery, encrypted,
/// malformed, or its last submessage leaves its length to the end of the packet.
std::span<const std::uint8_t> joinable_part(std::span<const std::uint8_t> packet);

}  // namespace takt
