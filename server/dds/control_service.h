#pragma once
// Control requests off the wire and replies onto it. A request is known by client id and sequence number:
// sent twice (by a client that heard no reply in time), it is executed once and answered with the same reply
// again.
#include <cstdint>
#include <deque>
#include <map>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "server/dds/participant.h"
#include "server/dds/topic_names.h"
#include "server/runtime/host/cell_host.h"
#include "takt_msgs.h"

namespace takt {

class ControlService final : public dds::DataReaderListener {
 public:
  /// So many of the newest requests are remembered, fewer if their replies are larger than that together.
  static constexpr std::size_t kRemembered = 1000, kMaxReplyBytes = std::size_t{16} << 20U;

  explicit ControlService(CellHost& host) : host_(host) {}

  /// Makes the reader and the writer. Call once; the participant must be destroyed before this object.
  void listen(Participant& participant, const TopicNames& names);

  void on_data_available(dds::DataReader* reader) override;

  /// Publishing thread: writes those of the replies that are for it, and those asked for again.
  void write_replies(std::span<const ControlReply> replies);

 private:
  using Key = std::pair<std::string, std::uint64_t>;  // client id, sequence number
  struct Request {
    std::uint64_t id = 0;
    std::size_t content = 0;            ///< what was asked for, see content_of()
    std::optional<ControlReply> reply;  ///< not the message of DDS: its texts take all the room they may have
  };
  struct Answer {
    Key key;
    ControlReply reply;
  };

  void received(const takt_msgs::msg::ControlRequest& message);
  /// Under the lock.
  void forget_old();

  CellHost& host_;
  dds::DataWriter* writer_ = nullptr;
  std::mutex mutex_;
  std::uint64_t newest_id_ = 0;  // guarded by mutex_, as all below
  std::map<Key, Request> requests_;
  std::map<std::uint64_t, Key> keys_;
  std::deque<Key> order_;  // oldest first
  std::size_t reply_bytes_ = 0;
  std::vector<Answer> asked_again_;
};

}  // namespace takt
