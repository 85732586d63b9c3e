#pragma once
// Which client of a Modbus server has become silent. A client that has written must make a request within the deadline,
// any request; a client that only reads may be silent. One that closes and comes back from the same address within the
// deadline is not silent.
#include <cstdint>
#include <map>
#include <optional>
#include <string>

namespace takt::gateway::modbus {

class ClientWatch {
 public:
  explicit ClientWatch(double deadline_s) : deadline_s_(deadline_s) {}

  /// A request of a connection; `writes`: it is a write.
  void heard(std::uint64_t connection, const std::string& address, bool writes, double now_s) {
    const auto found = clients_.find(connection);
    if (found == clients_.end() && !writes) return;
    if (found == clients_.end())
      std::erase_if(clients_,
                    [&](const auto& one) { return one.second.closed && one.second.address == address; });
    clients_.insert_or_assign(connection, Client{address, now_s, false});
  }
  void closed(std::uint64_t connection) {
    if (const auto found = clients_.find(connection); found != clients_.end()) found->second.closed = true;
  }
  /// The address of a client whose deadline has passed; each silence is returned once.
  std::optional<std::string> silent(double now_s) {
    for (auto client = clients_.begin(); client != clients_.end(); ++client) {
      if (now_s - client->second.heard_s < deadline_s_) continue;
      std::string address = client->second.address;
      clients_.erase(client);
      return address;
    }
    return std::nullopt;
  }

 private:
  struct Client {
    std::string address;
    double heard_s = 0.0;
    bool closed = false;
  };
  double deadline_s_;
  std::map<std::uint64_t, Client> clients_;
};

}  // namespace takt::gateway::modbus
