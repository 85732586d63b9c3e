#pragma once
// Numbers of the participants of this process, from which their ports and the ends of their GUIDs follow.
#include <deque>
#include <mutex>
#include <vector>

namespace takt::client {

/// Clients draw their numbers at random, for two reasons. A killed client leaves its ports in shared memory, and
/// a server writes into them for a while; a client with the same number receives nothing during that time. And
/// two participants of one process with the same number have the same GUID; a server that still remembers the
/// first one mistakes the second for it. So a number is used again as late as possible. The numbers lie above
/// those of servers, and the ports of the highest domain exist for them. Any thread.
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
