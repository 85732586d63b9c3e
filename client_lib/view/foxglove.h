#pragma once
// Messages of Foxglove's WebSocket protocol, version 1 (subprotocols foxglove.websocket.v1, foxglove.sdk.v1):
// the page of takt view speaks it as Foxglove and Lichtblick do. This file uses no network.
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "client_lib/view/stream.h"

namespace takt::view::foxglove {

inline constexpr std::string_view kProtocols[] = {"foxglove.sdk.v1", "foxglove.websocket.v1"};
/// The one service: requests of the control vocabulary, in JSON.
inline constexpr std::uint32_t kControlService = 1;

using Texts = std::vector<std::pair<std::string, std::string>>;

std::string server_info(const std::string& name, const std::string& session, const Texts& metadata);
std::string advertise(std::span<const Channel> channels);
std::string advertise_control();
std::string status(int level, const std::string& message);
std::string service_failure(std::uint32_t service, std::uint32_t call, const std::string& message);

/// Head of a binary message with a sample; the sample follows.
inline constexpr std::size_t kSampleHead_bytes = 1 + 4 + 8;
std::array<char, kSampleHead_bytes> sample_head(std::uint32_t subscription, std::uint64_t time_ns);

/// Whole binary message: the answer to a call.
std::string service_response(std::uint32_t service, std::uint32_t call, const Answer& answer);

struct Subscription {
  std::uint32_t id = 0, channel = 0;
};
struct ClientMessage {
  std::vector<Subscription> subscribe;
  std::vector<std::uint32_t> unsubscribe;
};
/// The used fields of a text message; empty if the message does not belong to the protocol.
std::optional<ClientMessage> read_text(std::string_view text);

struct ServiceCall {
  std::uint32_t service = 0, call = 0;
  std::string request;
  Arguments arguments;
  std::string problem;  ///< reason why no answer is possible, or empty
};
/// Empty if the binary message is no call. A call of an observer is refused unread.
std::optional<ServiceCall> read_binary(std::string_view message, bool may_control = true);

}  // namespace takt::view::foxglove
