#pragma once
// UDP between the processes of one machine, the default of servers and clients without a profile.
//
// Loopback alone would suffice for takt's own programs. Stock participants (ROS 2 tools with Fast DDS and its
// defaults) announce themselves on the other interfaces only, so those are listened to as well; packets to a
// group do not leave the machine (time to live 0), and the guard drops packets from other machines
// (guard_transport.h).
#include <array>
#include <chrono>
#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include "idl/transport/fastdds/fastdds.h"

namespace takt {

using Ipv4 = std::array<std::uint8_t, 4>;
inline constexpr Ipv4 kLoopback{127, 0, 0, 1};

/// Addresses of the interfaces that are up, 127.0.0.1 first.
std::vector<Ipv4> local_ipv4_addresses();

/// On all of these addresses. A type of its own, so that the guard recognises it.
struct ThisMachineUdp final : transports::UDPv4TransportDescriptor {
  ThisMachineUdp();
};

/// Whether an address is one of this machine's. Any thread.
class LocalAddresses {
 public:
  bool has(const Ipv4& address);

 private:
  std::mutex mutex_;
  std::vector<Ipv4> addresses_ = local_ipv4_addresses();
  std::chrono::steady_clock::time_point looked_ = std::chrono::steady_clock::now();
};

}  // namespace takt
