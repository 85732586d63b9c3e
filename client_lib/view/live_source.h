#pragma once
// A running cell as a stream: its topics as they are sent, while a viewer subscribes to them, and its control
// requests. It is an ordinary client of the cell and survives every stop and start of the server.
#include <atomic>
#include <condition_variable>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <thread>

#include "client_lib/client.h"
#include "client_lib/raw_topics.h"
#include "client_lib/view/pendant.h"
#include "client_lib/view/stream.h"

namespace takt::view {

class LiveSource {
 public:
  /// The stream must outlive this. Throws ClientError (transport). The cell need not be there yet.
  LiveSource(const ClientOptions& options, Stream& stream);
  ~LiveSource();
  LiveSource(const LiveSource&) = delete;
  LiveSource& operator=(const LiveSource&) = delete;

  /// A request of the control vocabulary, sent to the cell; or one of the pendant. Two threads may call it: one for
  /// the requests that is_for_host() names, whose answers are waited for as long as the server lives, and one for others.
  Answer request(const std::string& name, const Arguments& arguments);
  /// Requests that wait for their answer are given up. Any thread.
  void end() { ending_ = true; }

 private:
  struct Wanted {
    int by = 0;  ///< number of subscriptions, and one more if the topic is always open
    bool open = false;
  };
  void add(const client::RawTopic& topic);
  void want(const std::string& topic, bool wanted);
  void run();
  /// Repeats a harmless request until the cell answers. After a restart of the server the page may show the cell
  /// before DDS has connected the client of the requests. The viewer's request itself is sent once.
  void reach(std::unique_ptr<Client>& client);

  const ClientOptions options_;
  Stream& stream_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool over_ = false;
  std::map<std::string, std::uint32_t> channels_;
  // One entry per topic: DDS follows the latest count, however often the subscriptions change meanwhile.
  std::map<std::string, Wanted> wanted_;
  std::set<std::string> to_follow_;  ///< of these topics, wanted_ has changed
  std::atomic<bool> ending_ = false;
  std::unique_ptr<Client> usual_, to_host_;  ///< made when the first request comes
  Pendant pendant_;
  std::unique_ptr<client::RawTopics> topics_;
  std::thread thread_;
};

}  // namespace takt::view
