#include "idl/transport/rtps_guard/packet_cork.h"

#include <algorithm>

#include "idl/transport/rtps_guard/rtps_submessage.h"

namespace takt {
namespace {

thread_local PacketCork* cork_of_thread = nullptr;

}  // namespace

PacketCork::PacketCork()
    : places_([]() -> std::vector<Waiting>& {
        thread_local std::vector<Waiting> places;
        return places;
      }()) {
  outer_ = cork_of_thread == nullptr;
  if (outer_) cork_of_thread = this;
}

PacketCork::~PacketCork() {
  if (!outer_) return;
  cork_of_thread = nullptr;
  for (Waiting& waiting : places_) send(waiting);
}

PacketCork* PacketCork::of_thread() {
  return cork_of_thread;
}

bool PacketCork::hold(rtps::SenderResource& sender, const rtps::Locator_t& to,
                      std::span<const std::uint8_t> packet, std::size_t most_bytes) {
  const std::span<const std::uint8_t> part = joinable_part(packet);
  Waiting* waiting = waiting_for(sender, to);
  if (waiting != nullptr) {
    const bool same_participant =
        part.size() > kRtpsHeaderBytes &&
        std::equal(part.begin(), part.begin() + kRtpsHeaderBytes, waiting->packet.begin());
    if (same_participant && waiting->packet.size() + part.size() - kRtpsHeaderBytes <= most_bytes) {
      waiting->packet.insert(waiting->packet.end(), part.begin() + kRtpsHeaderBytes, part.end());
      return true;
    }
    send(*waiting);
  }
  if (part.empty() || part.size() > most_bytes) return false;
  Waiting& place = free_place();
  place.sender = &sender;
  place.to = to;
  place.packet.assign(part.begin(), part.end());
  return true;
}

PacketCork::Waiting* PacketCork::waiting_for(const rtps::SenderResource& sender, const rtps::Locator_t& to) {
  for (Waiting& waiting : places_)
    if (!waiting.packet.empty() && waiting.sender == &sender && waiting.to == to) return &waiting;
  return nullptr;
}

PacketCork::Waiting& PacketCork::free_place() {
  for (Waiting& waiting : places_)
    if (waiting.packet.empty()) return waiting;
  return places_.emplace_back();
}

void PacketCork::send(Waiting& waiting) {
  if (waiting.packet.empty()) return;
  (void)send_packet(*waiting.sender, waiting.packet, waiting.to);
  waiting.packet.clear();
}

std::span<const std::uint8_t> joinable_part(std::span<const std::uint8_t> packet) {
  if (packet.size() <= kRtpsHeaderBytes || speaks_of_discovery(packet)) return {};
  std::size_t at = kRtpsHeaderBytes;
  while (at < packet.size()) {
    const auto submessage = submessage_at(packet, at);
    if (!submessage) return {};
    const std::size_t end = at + kSubmessageHeadBytes + submessage->body_bytes;
    if (submessage->id == kFastDdsStatistics)
      return end == packet.size() ? packet.first(at) : packet.first(0);
    if (submessage->open || submessage->id >= kSecureBody) return {};
    at = end;
  }
  return packet;
}

}  // namespace takt
