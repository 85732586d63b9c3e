#pragma once
// Received control requests and their replies. Client id and sequence number identify a request: a repetition
// (by a client that received no reply in time) is not executed, but answered with the same reply.
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
  /// Largest number of stored requests, the newest ones; fewer if their replies exceed this size together.
  static constexpr std::size_t kRemembered = 1000, kMaxReplyBytes = std::size_t{16} << 20U;

  explicit ControlService(CellHost& host) : host_(host) {}

  /// Makes the reader and the writer. Call once; the participant must be destroyed before this object.
  void listen(Participant& participant, const TopicNames& names);

  void on_data_available(dds::DataReader* reader) override;

  /// Publishing thread: writes the replies of this service, and repeated ones.
  void write_replies(std::span<const ControlReply> replies);
  /// Waits a little until the clients have received the last replies.
  void finish();

 private:
  using Key = std::pair<std::string, std::uint64_t>;  // client id, sequence number
  struct Request {
    std::uint64_t id = 0;
    std::size_t content = 0;            ///< hash of the request, see content_of()
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
