#pragma once
// The sockets of UDP ports. Their packets are delivered by a thread of the receiver or, as long as there is one, by a
// thread that waits for what they bring (leader/followers pattern, Schmidt et al., POSA2): an exchange is then spared
// the change from the thread that receives to the thread that waits.
#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
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

  UdpReceiver();
  ~UdpReceiver();
  UdpReceiver(const UdpReceiver&) = delete;
  UdpReceiver& operator=(const UdpReceiver&) = delete;

  /// Binds the port on each of these addresses; the first one starts the receiver's thread. `buffer_bytes`: of the kernel,
  /// for each socket. False: the port is taken on one of them.
  bool open(std::uint16_t port, const std::vector<Address>& addresses, std::uint32_t buffer_bytes,
            Deliver deliver);
  bool is_open(std::uint16_t port);
  /// After its return the port's `deliver` is not called. Not from within `deliver`.
  void close(std::uint16_t port);

  /// Delivers packets in this thread until `ready` or the deadline. False: no port is open, another thread waits here and
  /// delivers, or ports are opened or closed meanwhile. `ready` is asked after each packet and each interrupt(). The caller
  /// holds no lock that `deliver` takes.
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
  struct Socket {
    int descriptor;
    std::uint16_t port;
    std::shared_ptr<const Deliver> deliver;
  };
  /// Holds leader_ in place of the thread that has it, which leaves.
  class Exclusive;

  void run();
  /// With leader_ held: delivers one packet of each socket, `all`, or of the first one. False: there was none.
  bool receive(bool all);
  bool receive_from(const Socket& socket);
  /// With leader_ held: sleeps until a packet, an interrupt() or the deadline.
  void sleep_until(Clock::time_point deadline);
  bool is_led() const { return wanted_ > 0 || Clock::now().time_since_epoch().count() < led_until_.load(); }
  void wake() const;

  const int interrupt_;          ///< eventfd
  std::vector<Socket> sockets_;  // guarded by leader_, as the next three
  std::vector<std::uint8_t> packet_;
  std::uint32_t turns_ = 0;
  Clock::duration usual_wait_{std::chrono::milliseconds{1}};

  std::mutex leader_;                     ///< held by the thread that receives
  std::atomic<std::thread::id> guest_{};  ///< which is not the receiver's own
  std::atomic<Clock::rep> led_until_{0};  ///< until then the own thread leaves the sockets alone
  std::atomic<int> wanted_{0};            ///< threads that wait for leader_ in lead()
  std::atomic<int> followers_{0};
  std::atomic<int> exclusive_{0};  ///< threads that have or want leader_ for a change of the sockets
  std::atomic<bool> open_{false}, ending_{false};
  std::mutex sleep_;
  std::condition_variable woken_;
  std::thread thread_;
};

}  // namespace takt
