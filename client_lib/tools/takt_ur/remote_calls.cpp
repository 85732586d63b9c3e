#include "client_lib/tools/takt_ur/remote_calls.h"

namespace takt::ur {

using urscript::Value;
using urscript::ValueError;

RemoteCalls::~RemoteCalls() {
  while (!calls_.empty()) forget(calls_.begin()->first);
}

void RemoteCalls::forget(std::uint64_t thread) {
  const auto found = calls_.find(thread);
  if (found == calls_.end()) return;
  if (found->second->connection) found->second->connection->close();
  calls_.erase(found);
}

void RemoteCalls::begin(std::uint64_t thread, const rpc::Address& address, std::string request) {
  const auto call = calls_[thread] = std::make_shared<Call>();
  controller_.loop().connect(address.host, address.port, 1, std::chrono::seconds(0),
                             [weak = std::weak_ptr(call), request = std::move(request)](auto connection) {
                               const auto mine = weak.lock();
                               if (!mine) return;
                               mine->connecting = false;
                               mine->connection = std::move(connection);
                               if (!mine->connection) return;
                               mine->connection->start({[weak](std::string_view bytes) {
                                                          if (const auto me = weak.lock())
                                                            me->reply.add(bytes);
                                                        },
                                                        [weak] {
                                                          if (const auto me = weak.lock()) me->reply.close();
                                                        }});
                               mine->connection->send(request);
                             });
}

std::optional<Value> RemoteCalls::call(std::uint64_t thread, std::span<const Value> arguments, bool begins,
                                       std::uint64_t begun_cycle) {
  const std::string& url = *arguments[0].record()->values[1].text();
  const std::string& procedure = *arguments[1].text();
  if (procedure == "closeXMLRPCClientConnection") return Value(true);  // each call has its own connection
  try {
    if (begins) {
      const rpc::Address address = rpc::parse_url(url);
      begin(thread, address, rpc::request(address, procedure, arguments.subspan(2)));
      return std::nullopt;
    }
    const Call& mine = *calls_.at(thread);
    if (!mine.connecting && !mine.connection) throw ValueError("the server cannot be reached");
    std::optional<Value> result = mine.reply.result();
    const double waited_s = UrController::kCycle_s * static_cast<double>(controller_.cycle() - begun_cycle);
    if (!result && waited_s > kMost_s)
      throw ValueError("no reply within " + std::to_string(static_cast<int>(kMost_s)) + " s");
    if (result) forget(thread);
    return result;
  } catch (const ValueError& error) {
    forget(thread);
    throw ValueError("XML-RPC: " + procedure + " at " + url + ": " + error.what());
  }
}

}  // namespace takt::ur
