#pragma once
// The two messages of KUKA's RobotSensorInterface, one XML document in each datagram:
//
//   controller to sensor PC   <Rob Type="KUKA"><RIst X="445.0" .../><AIPos A1="0.0" .../>...<IPOC>4208163634</IPOC></Rob>
//   sensor PC to controller   <Sen Type="ImFree"><AK A1="0.5" .../>...<IPOC>4208163634</IPOC></Sen>
//
// Both are written in the order of the Ethernet configuration, with one blank between attributes and none before "/>":
// the client of KUKA's SDK reads fixed positions. Both are read tolerant to order, blanks and unknown elements. Degrees
// and millimetres. Sources: kroshu/kuka-external-control-sdk and kroshu/kuka_drivers (GitHub).
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "client_lib/gateway/rsi/configuration.h"
#include "client_lib/gateway/vendor_units.h"

namespace takt::gateway::rsi {

/// Longest message that is read, bytes.
inline constexpr std::size_t kMaxMessage = 8192;

/// The message of the controller.
struct Rob {
  Six actual_pose{}, planned_pose{};  ///< X Y Z A B C
  Six actual_axes{}, planned_axes{}, actual_external_axes{}, planned_external_axes{};
  std::uint64_t delay = 0;  ///< late packets
  std::uint64_t ipoc = 0;   ///< time stamp, ms
  /// Of the user channels, in the order of Configuration::send; values of other places do not count.
  std::vector<double> values{};
};

/// The message of the sensor PC.
struct Sen {
  std::uint64_t ipoc = 0;
  /// In the order of Configuration::receive; empty: not in the message.
  std::vector<std::optional<double>> values{};
  std::string message{};  ///< EStr
};

/// What was read: a message, or a fault.
template <class Message>
struct Parsed {
  std::optional<Message> message{};
  std::string fault{};
  std::vector<std::string> unknown{};  ///< elements and attributes that the configuration does not have
};

/// Digits after the point.
struct Decimals {
  int pose = 6, axes = 6, external_axes = 6, values = 6;
};

/// Quantities that takt cannot compute (currents, parameters of function generators) are 0. `rob.values` may be shorter
/// than the configuration; then the rest is 0.
std::string write_rob(const Configuration& configuration, const Rob& rob, const Decimals& decimals = {});
/// Values that are not set are left out.
std::string write_sen(const Configuration& configuration, const Sen& sen, const Decimals& decimals = {});

/// A fault: no XML, another root or type, no IPOC, a value that is no finite number.
Parsed<Sen> parse_sen(const Configuration& configuration, std::string_view text);
/// As above, and an axis of AIPos that is missing. Everything else that is not in the message is 0.
Parsed<Rob> parse_rob(const Configuration& configuration, std::string_view text);

}  // namespace takt::gateway::rsi
