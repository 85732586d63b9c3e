#pragma once
// The teach pendant of takt view (idl/takt_pendant.idl): plans motions by hand and commands robots, grippers and devices
// as a client of the weakest ownership strength. It is a sender only while it moves something and a few seconds after, so
// that other senders get their targets.
#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "client_lib/client.h"
#include "client_lib/view/stream.h"
#include "takt_pendant_table.h"

namespace takt::view {

class Pendant {
 public:
  explicit Pendant(ClientOptions options);
  ~Pendant();
  Pendant(const Pendant&) = delete;
  Pendant& operator=(const Pendant&) = delete;

  /// std::nullopt: the request has another name. Throws ClientError where the cell does not answer. One thread.
  std::optional<Answer> request(const std::string& name, const Arguments& arguments);

 private:
  template <Request Type>
  Answer execute_as_sender(const Type& request);
  Answer execute(const pendant::JogJoints& request);
  Answer execute(const pendant::JogLine& request);
  Answer execute(const pendant::StopJogging& request);
  Answer execute(const pendant::CommandGripper& request);
  Answer execute(const pendant::CommandSignal& request);

  /// Throws ClientError (refused) for a target without an index, and where another sender owns it.
  void require_free(const char* kind, const std::string& target, int index) const;
  /// The positions of a robot that stands. Throws ClientError (refused) where it moves.
  std::vector<double> standing(const std::string& robot) const;
  /// Sends a motion whose duration is the response.
  template <Request Type>
  Answer move(const std::string& robot, const std::vector<TrajectoryPoint>& points);
  /// Returns the simulated time that the motion takes.
  double send(const std::string& robot, const std::vector<TrajectoryPoint>& points);
  void run();

  const ClientOptions options_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool over_ = false;
  std::unique_ptr<Client> client_;  ///< while the pendant is a sender
  double until_s_ = 0.0;            ///< simulated time at which its motions are over
  std::chrono::steady_clock::time_point newest_;
  std::thread thread_;
};

}  // namespace takt::view
