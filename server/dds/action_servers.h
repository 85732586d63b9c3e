#pragma once
// The actions of the cell: FollowJointTrajectory of each robot, GripperCommand and ParallelGripperCommand of each gripper
// while a scenario is loaded, and SimulateSteps. A row of takt_actions.h is one action; what its goals mean stands in
// action_goals.h.
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "server/dds/action_server.h"
#include "server/dds/participant.h"
#include "server/runtime/host/cell_host.h"

namespace takt {

class ActionServers {
 public:
  /// Ids of their control requests start here; see ControlRequest::id.
  static constexpr std::uint64_t kFirstId = std::uint64_t{1} << 62U;

  explicit ActionServers(CellHost& host);
  ~ActionServers();
  ActionServers(const ActionServers&) = delete;
  ActionServers& operator=(const ActionServers&) = delete;

  /// Makes the actions of the server. Call once; the participant must be destroyed, or silent, before this object.
  void serve(Participant& participant);
  /// Makes the actions of this loop's robots and grippers. Throws DdsError; close() then removes those made so far.
  void open(RunLoop& loop);
  /// The loop has ended: all goals get their results, and the actions are removed. May be called more than once.
  void close();

  // The publishing thread:

  /// Replies to control requests; others than its own are ignored.
  void take_replies(std::span<const ControlReply> replies);
  /// `step`: of the newest instant.
  void write(std::uint64_t step);
  /// Replies wait for their caller's reader.
  bool replies_wait();

 private:
  class Motion;
  template <typename Action>
  class TypedMotion;
  class Steps;

  template <typename Action>
  void add(int target);
  void take_reports();

  CellHost& host_;
  Participant* participant_ = nullptr;
  std::mutex mutex_;
  std::uint64_t numbers_ = 0;  // guarded by mutex_, as all below
  RunLoop* loop_ = nullptr;
  std::vector<std::unique_ptr<Motion>> motions_;
  std::unique_ptr<Steps> steps_;
};

}  // namespace takt
