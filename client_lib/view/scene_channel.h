#pragma once
// The cell in Foxglove's own messages, for 3D views of other programs: /takt/scene has the shapes, /takt/frames
// their poses, /takt/forces the resultant forces on Parts as arrows, /takt/pressures the coloured elements under
// pressure (of the pairs in the request watch_pressures). The source is description, state and pressures. Each
// channel is sent 20 times a second while it has a subscriber.
#include <array>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "client_lib/view/stream.h"
#include "takt_msgs.h"

namespace takt::view {

class SceneChannel {
 public:
  explicit SceneChannel(Stream& stream);
  ~SceneChannel();
  SceneChannel(const SceneChannel&) = delete;
  SceneChannel& operator=(const SceneChannel&) = delete;

 private:
  void run();
  void find_sources();
  template <typename Message>
  void push(std::uint32_t channel, std::uint64_t time_ns, const Message& message);
  void follow();
  void make_scene(std::uint64_t time_ns);
  void make_frames(const takt_msgs::msg::CellState& state, std::uint64_t time_ns);
  void make_forces(const takt_msgs::msg::CellState& state, std::uint64_t time_ns);
  void follow_pressures(bool wanted);
  void make_pressures(const takt_msgs::msg::ContactPressures& sample, std::uint64_t time_ns);

  Stream& stream_;
  std::uint32_t scene_ = 0, frames_ = 0, forces_ = 0, pressures_ = 0;
  std::uint32_t description_channel_ = 0, state_channel_ = 0, pressures_channel_ = 0;
  std::uint64_t description_number_ = 0, state_number_ = 0, pressures_number_ = 0;
  std::optional<takt_msgs::msg::CellDescription> description_;
  bool follows_state_ = false, follows_pressures_ = false;
  bool complained_ = false;  ///< an invalid sample has been reported

  std::mutex mutex_;
  std::condition_variable changed_;
  bool over_ = false;
  int wanted_ = 0, pressures_wanted_ = 0;
  std::thread thread_;
};

}  // namespace takt::view
