#pragma once
// Numbers of the participants of this process, from which their ports and the ends of their GUIDs follow.
#include <deque>
#include <mutex>
#include <vector>

namespace takt::client {

/// A client that was killed leaves its ports in shared memory behind, and a server goes on writing into them
/// for a while; who takes the same number next hears nothing meanwhile. So clients draw their numbers: above
/// those of servers, and such that the ports of the highest domain exist. And two participants of one process
/// with the same number have the same GUID: others would take the second one for the first, which they may
/// not have forgotten yet. So a number comes again as late as possible. Any thread.
class ParticipantNumbers {
 public:
  static constexpr int kSmallest = 10, kCount = 50;

  /// Of all participants of this process: DDS does not share a number among them.
  static ParticipantNumbers& of_process();

  ParticipantNumbers();
  /// By chance among those that were never drawn, then the one that was given back first. -1 (DDS chooses)
  /// when all are in use.
  int draw();
  void give_back(int number);

 private:
  std::mutex mutex_;
  std::vector<int> fresh_;  ///< never drawn
  std::deque<int> used_;    ///< given back, oldest first
};

}  // namespace takt::client
