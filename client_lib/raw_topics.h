#pragma once
// Samples of a cell as bytes of any type, for recorders and bridges, which pass them on undecoded.
//
// Discovery finds the topics. A topic is received while it is open. Samples arrive in threads of DDS in the form
// in which they were sent (CDR with its head of four bytes).
#include <condition_variable>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "client_lib/client.h"
#include "client_lib/dds_link.h"

namespace takt::client {

struct RawTopic {
  std::string name;      ///< ROS 2 name: /cell/state
  std::string type;      ///< pkg/msg/Name
  bool latched = false;  ///< late joiners get the newest sample
  bool reliable = true;  ///< what was lost is sent again
};

class RawTopics {
 public:
  using OnTopic = std::function<void(const RawTopic&)>;
  using OnSample = std::function<void(const RawTopic&, std::string_view sample)>;

  /// `on_topic` is called once for each topic of the cell that has a writer, and for /clock, /tf and /tf_static.
  /// The topics of control requests and replies are left out. `on_topic` runs in a thread of this object and may call
  /// open(). Throws ClientError (transport).
  RawTopics(const ClientOptions& options, OnTopic on_topic, OnSample on_sample);
  ~RawTopics();
  RawTopics(const RawTopics&) = delete;
  RawTopics& operator=(const RawTopics&) = delete;

  /// Receives a topic that was announced. `depth`: how many samples may wait. Throws ClientError (transport).
  void open(const std::string& topic, int depth);
  void close(const std::string& topic);

 private:
  class Watch;
  struct Known;
  bool is_wanted(const std::string& name) const;
  void run();

  const std::string cell_;
  OnTopic on_topic_;
  OnSample on_sample_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool over_ = false;
  std::vector<std::string> to_announce_;  ///< names of topics
  std::map<std::string, std::unique_ptr<Known>> topics_;
  std::unique_ptr<Watch> watch_;
  std::unique_ptr<Link> link_;
  std::thread thread_;
};

/// Publishes samples as bytes: replay. Each writer is reliable and latched as its topic says.
class RawPublisher {
 public:
  /// Throws ClientError (transport).
  explicit RawPublisher(const ClientOptions& options);
  ~RawPublisher();
  RawPublisher(const RawPublisher&) = delete;
  RawPublisher& operator=(const RawPublisher&) = delete;

  /// Makes the writer of a topic (ROS 2 name). Throws ClientError (transport).
  void add(const RawTopic& topic);
  /// False where DDS refused it.
  bool write(const std::string& topic, std::string_view sample);

 private:
  std::map<std::string, dds::DataWriter*> writers_;
  Link link_;
};

}  // namespace takt::client
