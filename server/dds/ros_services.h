#pragma once
// The control requests as ROS 2 services: /<cell>/<service> of simulation_interfaces 2.1, and
// /<cell>/control (takt_msgs/srv/Control), which takes any request of takt by name.
//
// How a reply finds its caller: ros_endpoint.h.
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "server/dds/participant.h"
#include "server/dds/ros_endpoint.h"
#include "server/dds/ros_service_messages.h"
#include "server/runtime/host/cell_host.h"

namespace takt {

class RosServices {
 public:
  /// Ids of the services' requests start here; see ControlRequest::id.
  static constexpr std::uint64_t kFirstId = std::uint64_t{1} << 63U;
  /// Largest number of requests stored for their answers, the newest ones.
  static constexpr std::size_t kRemembered = 1000;

  explicit RosServices(CellHost& host);
  ~RosServices();
  RosServices(const RosServices&) = delete;
  RosServices& operator=(const RosServices&) = delete;

  /// Makes readers and writers. Call once; the participant must be destroyed before this object.
  void serve(Participant& participant, const std::string& cell);

  /// Publishing thread, without a lock that the host waits for: submits requests that follow others.
  void submit_following();
  /// Publishing thread: writes the replies of the services, and those that wait for the discovery of their
  /// caller's reader.
  /// `now` answers what is no request of takt; nullptr while a cell that was opened has no instant yet: what
  /// needs one waits.
  void write_replies(std::span<const ControlReply> replies, const ros::Instant* now);
  /// Replies wait for their caller's reader or for the first instant of a cell.
  bool replies_wait();

 private:
  class Service;
  template <typename RequestType, typename ResponseType>
  class TypedService;
  template <typename RequestType, typename ResponseType>
  class InstantService;
  class SpawnEntities;
  struct Batch;
  struct Call {
    Service* service = nullptr;
    RosEndpoint::Caller caller;
    /// The part of the request that the response needs; all of it where the instant answers.
    std::string note;
    std::shared_ptr<Batch> batch{};  ///< that the request is one of, or nullptr
  };
  struct Waiting {
    Call call;
    ControlReply reply;
    std::int64_t since_ns = 0;
  };
  void submit(Call call, ControlRequest request);
  void answer(Call call, ControlReply reply);
  void begin(std::shared_ptr<Batch> batch);
  /// With mutex_ held: passes on the next request of the batch, or its answer.
  void go_on(const std::shared_ptr<Batch>& batch);

  CellHost& host_;
  std::vector<std::unique_ptr<Service>> services_;
  std::mutex mutex_;
  std::uint64_t newest_id_ = kFirstId;  // guarded by mutex_, as all below
  std::map<std::uint64_t, Call> calls_;
  std::vector<ControlRequest> of_batches_;  ///< to be submitted
  std::vector<Waiting> waiting_;
};

}  // namespace takt
