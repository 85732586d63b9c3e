#pragma once
// The sockets of one UDP port. Their packets are delivered by a thread of the receiver or, as long as there is one, by a
// thread that waits for what they bring (leader/followers pattern, Schmidt et al., POSA2): an exchange is then spared
// the change from the thread that receives to the thread that waits.
#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <span>
#include <thread>
#include <vector>

namespace takt {

class UdpReceiver {
 public:
  using Clock = std::chrono::steady_clock;
  using Address = std::array<std::uint8_t, 4>;
  /// A packet and its sender. One thread at a time.
  using Deliver =
      std::function<void(std::span<const std::uint8_t> packet, const Address& from, std::uint16_t from_port)>;

  UdpReceiver() = default;
  ~UdpReceiver() { close(); }
  UdpReceiver(const UdpReceiver&) = delete;
  UdpReceiver& operator=(const UdpReceiver&) = delete;

  /// Binds the port on each of these addresses and starts the receiver's thread. `buffer_bytes`: of the kernel, for each
  /// socket. False: the port is taken on one of them, or the receiver is open.
  bool open(std::uint16_t port, const std::vector<Address>& addresses, std::uint32_t buffer_bytes,
            Deliver deliver);
  bool is_open(std::uint16_t port) const { return port_.load() == port && port != 0; }
  /// After its return `deliver` is not called. Not from within `deliver`.
  void close();

  /// Delivers packets in this thread until `ready` or the deadline. False, at once: the receiver is closed, or another
  /// thread waits here; that one delivers. `ready` is asked after each packet and each interrupt(). The caller holds no
  /// lock that `deliver` takes.
  bool lead(Clock::time_point deadline, const std::function<bool()>& ready);
  /// Any thread: the thread in lead() asks `ready` again.
  void interrupt();

  /// A thread that was sent away by lead() and waits elsewhere: the receiver's own thread delivers for it.
  class Follower {
   public:
    explicit Follower(UdpReceiver& receiver) : receiver_(receiver) { ++receiver_.followers_; }
    ~Follower() { --receiver_.followers_; }
    Follower(const Follower&) = delete;
    Follower& operator=(const Follower&) = delete;

   private:
    UdpReceiver& receiver_;
  };

 private:
  void run();
  /// With leader_ held: delivers one packet of each socket, `all`, or of the first one. False: there was none.
  bool receive(bool all);
  bool receive_from(int socket);
  /// With leader_ held: sleeps until a packet, an interrupt() or the deadline.
  void sleep_until(Clock::time_point deadline);
  bool is_led() const { return wanted_ > 0 || Clock::now().time_since_epoch().count() < led_until_.load(); }
  void release();

  std::vector<int> sockets_;
  int interrupt_ = -1;  ///< eventfd
  Deliver deliver_;
  std::vector<std::uint8_t> packet_;  // as all below: guarded by leader_
  std::uint32_t turns_ = 0;
  Clock::duration usual_wait_{std::chrono::milliseconds{1}};

  std::mutex leader_;                     ///< held by the thread that receives
  std::atomic<std::thread::id> guest_{};  ///< which is not the receiver's own
  std::atomic<Clock::rep> led_until_{0};  ///< until then the own thread leaves the sockets alone
  std::atomic<int> wanted_{0};            ///< threads that wait for leader_ in lead()
  std::atomic<int> followers_{0};
  std::atomic<std::uint16_t> port_{0};  ///< 0: closed
  std::atomic<bool> closing_{false};
  std::mutex sleep_;
  std::condition_variable woken_;
  std::thread thread_;
};

}  // namespace takt
