#include "client_lib/gateway/gateway_reporter.h"

#include <chrono>
#include <utility>

namespace takt::gateway {
namespace {

constexpr std::chrono::seconds kPeriod{1};
/// A server that does not answer has its own reports; its time-out is shorter than a server remembers a gateway.
constexpr Seconds kLongestWait{2.0};

}  // namespace

GatewayReporter::GatewayReporter(Client& client, std::string name, std::string protocol,
                                 std::vector<std::string> targets)
    : client_(client) {
  report_.name = std::move(name);
  report_.protocol = std::move(protocol);
  report_.targets = std::move(targets);
  thread_ = std::thread([this] { run(); });
}

GatewayReporter::~GatewayReporter() {
  {
    const std::lock_guard lock(mutex_);
    over_ = true;
  }
  changed_.notify_one();
  thread_.join();
}

void GatewayReporter::set(PeerStatus peer) {
  bool news = false;
  {
    const std::lock_guard lock(mutex_);
    news = !peer_ || peer.connected != peer_->connected || peer.peer != peer_->peer;
    peer_ = std::move(peer);
    news_ = news_ || news;
  }
  if (news) changed_.notify_one();
}

void GatewayReporter::run() {
  std::unique_lock lock(mutex_);
  while (!over_) {
    changed_.wait_for(lock, kPeriod, [this] { return over_ || news_; });
    if (over_ || !peer_) continue;
    news_ = false;
    report_.peer = peer_->peer;
    report_.connected = peer_->connected;
    report_.messages = peer_->messages;
    report_.late = peer_->late;
    lock.unlock();
    try {
      client_.call(report_, kLongestWait);
    } catch (const ClientError&) {  // the next one is due in a second
    }
    lock.lock();
  }
}

}  // namespace takt::gateway
