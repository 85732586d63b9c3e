#include "idl/transport/fastdds/udp_receiver.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sched.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <optional>

namespace takt {
namespace {

constexpr std::size_t kLargestPacket_bytes = 1U << 16U;
/// A thread that comes back to lead() within this time keeps the sockets.
constexpr std::chrono::milliseconds kAway{5};
/// Packets that usually come sooner than this are waited for without sleeping: falling asleep and waking take longer.
constexpr std::chrono::microseconds kWorthSpinning{150};
constexpr std::uint32_t kTurnsOfTheFirst = 16;  ///< looks at the first socket for one at the others

std::optional<int> bound_socket(std::uint16_t port, const UdpReceiver::Address& address,
                                std::uint32_t buffer_bytes) {
  const int made = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (made < 0) return std::nullopt;
  const int bytes = static_cast<int>(buffer_bytes);
  if (bytes > 0) (void)setsockopt(made, SOL_SOCKET, SO_RCVBUF, &bytes, sizeof(bytes));
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(port);
  std::memcpy(&to.sin_addr, address.data(), address.size());
  if (bind(made, reinterpret_cast<const sockaddr*>(&to), sizeof(to)) == 0) return made;
  ::close(made);
  return std::nullopt;
}

}  // namespace

class UdpReceiver::Exclusive {
 public:
  explicit Exclusive(UdpReceiver& receiver) : receiver_(receiver) {
    ++receiver_.exclusive_;
    receiver_.wake();
    receiver_.leader_.lock();
  }
  ~Exclusive() {
    receiver_.open_ = !receiver_.sockets_.empty();
    receiver_.leader_.unlock();
    --receiver_.exclusive_;
    const std::lock_guard lock(receiver_.sleep_);
    receiver_.woken_.notify_all();
  }
  Exclusive(const Exclusive&) = delete;
  Exclusive& operator=(const Exclusive&) = delete;

 private:
  UdpReceiver& receiver_;
};

UdpReceiver::UdpReceiver() : interrupt_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {}

UdpReceiver::~UdpReceiver() {
  {
    const Exclusive exclusive(*this);
    ending_ = true;
    for (const Socket& socket : sockets_) ::close(socket.descriptor);
    sockets_.clear();
  }
  if (thread_.joinable()) thread_.join();
  if (interrupt_ >= 0) ::close(interrupt_);
}

void UdpReceiver::wake() const {
  const std::uint64_t one = 1;
  (void)!write(interrupt_, &one, sizeof(one));
}

bool UdpReceiver::open(std::uint16_t port, const std::vector<Address>& addresses, std::uint32_t buffer_bytes,
                       Deliver deliver) {
  const auto shared = std::make_shared<const Deliver>(std::move(deliver));
  std::vector<Socket> made;
  for (const Address& address : addresses) {
    const auto descriptor = bound_socket(port, address, buffer_bytes);
    if (descriptor) made.push_back({*descriptor, port, shared});
    if (descriptor && interrupt_ >= 0) continue;
    for (const Socket& socket : made) ::close(socket.descriptor);
    return false;
  }
  const Exclusive exclusive(*this);
  packet_.resize(kLargestPacket_bytes);
  sockets_.insert(sockets_.end(), made.begin(), made.end());
  if (!thread_.joinable()) thread_ = std::thread([this] { run(); });
  return true;
}

bool UdpReceiver::is_open(std::uint16_t port) {
  const Exclusive exclusive(*this);
  return std::any_of(sockets_.begin(), sockets_.end(),
                     [&](const Socket& socket) { return socket.port == port; });
}

void UdpReceiver::close(std::uint16_t port) {
  const Exclusive exclusive(*this);
  std::erase_if(sockets_, [&](const Socket& socket) {
    if (socket.port != port) return false;
    ::close(socket.descriptor);
    return true;
  });
}

void UdpReceiver::run() {
  while (!ending_) {
    {
      std::unique_lock lock(sleep_);
      while (!ending_ && (exclusive_ > 0 || is_led())) woken_.wait_for(lock, kAway);
    }
    const std::lock_guard lead(leader_);
    while (!ending_ && exclusive_ == 0 && !is_led())
      if (!receive(true)) sleep_until(Clock::time_point::max());
  }
}

bool UdpReceiver::lead(Clock::time_point deadline, const std::function<bool()>& ready) {
  if (!open_ || exclusive_ > 0) return false;
  const auto stay_away = [&](Clock::time_point now) {
    led_until_ = (now + kAway).time_since_epoch().count();
  };
  std::unique_lock lead(leader_, std::defer_lock);
  stay_away(Clock::now());
  if (!lead.try_lock()) {
    if (guest_.load() != std::thread::id()) return false;
    ++wanted_;
    wake();
    lead.lock();
    --wanted_;
  }
  if (sockets_.empty()) return false;
  guest_ = std::this_thread::get_id();
  const auto began = Clock::now();
  auto now = began;
  bool came = false;
  // A thread that came ahead of guest_ waits for leader_ without a deadline: it gets its turn.
  while (exclusive_ == 0 && wanted_ == 0 && !ready()) {
    came = receive(++turns_ % kTurnsOfTheFirst == 0 || now - began > kWorthSpinning);
    if (!came) {
      now = Clock::now();
      if (now >= deadline) break;
      if (usual_wait_ > kWorthSpinning || now - began > 2 * kWorthSpinning) {
        sleep_until(deadline);
        if (Clock::now() >= deadline && !receive(true)) break;
      } else {
        // Two controllers and a server may look for packets on two processors. A thread that sleeps soon does not yield: on
        // a busy processor it would come back a time slice later, behind the packet.
        sched_yield();
      }
    }
  }
  const auto ended = Clock::now();
  usual_wait_ += (std::min<Clock::duration>(ended - began, 10 * kWorthSpinning) - usual_wait_) / 8;
  guest_ = std::thread::id();
  if (followers_ > 0) {
    led_until_ = 0;
    lead.unlock();
    const std::lock_guard lock(sleep_);
    woken_.notify_all();
  } else {
    stay_away(ended);
  }
  return exclusive_ == 0;
}

void UdpReceiver::interrupt() {
  const auto guest = guest_.load();
  if (guest == std::thread::id() || guest == std::this_thread::get_id()) return;
  wake();
}

bool UdpReceiver::receive(bool all) {
  if (sockets_.empty()) return false;
  bool came = receive_from(sockets_.front());
  if (!all) return came;
  for (std::size_t i = 1; i < sockets_.size(); ++i) came = receive_from(sockets_[i]) || came;
  return came;
}

bool UdpReceiver::receive_from(const Socket& socket) {
  sockaddr_in sender{};
  socklen_t size = sizeof(sender);
  const auto bytes = recvfrom(socket.descriptor, packet_.data(), packet_.size(), MSG_DONTWAIT,
                              reinterpret_cast<sockaddr*>(&sender), &size);
  if (bytes <= 0) return bytes == 0;
  Address from{};
  std::memcpy(from.data(), &sender.sin_addr, from.size());
  (*socket.deliver)({packet_.data(), static_cast<std::size_t>(bytes)}, from, ntohs(sender.sin_port));
  return true;
}

void UdpReceiver::sleep_until(Clock::time_point deadline) {
  thread_local std::vector<pollfd> sources;
  sources.clear();
  for (const Socket& socket : sockets_) sources.push_back({socket.descriptor, POLLIN, 0});
  sources.push_back({interrupt_, POLLIN, 0});
  timespec left{};
  const bool endless = deadline == Clock::time_point::max();
  if (!endless) {
    const auto rest = std::max(deadline - Clock::now(), Clock::duration(0));
    const auto whole = std::chrono::duration_cast<std::chrono::seconds>(rest);
    left.tv_sec = static_cast<time_t>(std::min<std::int64_t>(whole.count(), 3600));
    left.tv_nsec = static_cast<long>(std::chrono::nanoseconds(rest - whole).count());
  }
  if (ppoll(sources.data(), sources.size(), endless ? nullptr : &left, nullptr) <= 0) return;
  std::uint64_t count = 0;
  if (sources.back().revents != 0) (void)!read(interrupt_, &count, sizeof(count));
}

}  // namespace takt
