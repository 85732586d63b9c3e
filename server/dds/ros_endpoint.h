#pragma once
// The server's end of one ROS 2 service: the topics rq/NAMERequest and rr/NAMEReply, for callers with either middleware.
//
// - rmw_fastrtps: a reply names its request in its related_sample_identity: the caller's reply reader, which the
//   request carries in the same place (else the writer of the request), and the request's sequence number.
// - rmw_cyclonedds: 16 bytes ahead of each message name the caller and its request (uint64 guid, int64 number, in the
//   byte order of the message); the reply repeats them. The vendor of the caller's participant, which its GUID begins
//   with, distinguishes the two.
//
// Every reply reaches all readers. A caller of the one kind drops what is meant for the other: by the identity, or by 16
// bytes that are not its own. Callers count readers and writers, so that each topic has exactly one.
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <set>
#include <span>
#include <string>

#include "server/dds/participant.h"

namespace takt {

class RosEndpoint final : public dds::DataReaderListener, public dds::DataWriterListener {
 public:
  /// Bytes ahead of the message in samples of rmw_cyclonedds.
  struct PayloadHeader {
    std::uint64_t guid = 0;
    std::int64_t number = 0;
  };
  struct Caller {
    rtps::SampleIdentity identity;
    std::optional<PayloadHeader> header;  ///< of a caller of rmw_cyclonedds
  };
  /// In a thread of DDS: a request as plain CDR, without such a header.
  using OnRequest = std::function<void(const Caller& caller, std::span<const std::uint8_t> sample)>;

  /// `name` without a slash at its beginning. `on_match` is called in threads of DDS when a caller's reader of replies
  /// appears. The participant must outlive it or be silent. Throws DdsError.
  RosEndpoint(Participant& participant, const std::string& name, const MessageInfo& request,
              const MessageInfo& response, OnRequest on_request, std::function<void()> on_match);

  /// Removes reader and writer.
  void remove(Participant& participant);
  /// DDS may discover a caller's reader of replies after its request; a reply before that is lost. So is one that a reader
  /// of Cyclone DDS learns of by its first heartbeat: a volatile reader begins behind the samples that this names
  /// (ddsi_receive.c, handle_Heartbeat). An empty sample goes ahead then, whose heartbeat the reader answers.
  bool reaches(const Caller& caller);
  /// `sample`: the response as plain CDR. A reply that DDS refuses is lost; the caller's time-out reports it.
  void write(const Caller& caller, std::string sample);
  void wait_for_acknowledgments();

 private:
  void on_data_available(dds::DataReader* reader) override;
  void on_publication_matched(dds::DataWriter*, const dds::PublicationMatchedStatus& status) override;

  const OnRequest on_request_;
  const std::function<void()> on_match_;
  std::mutex mutex_;
  std::set<DdsGuid> readers_;  // guarded by mutex_
  std::set<DdsGuid> primed_;   ///< those of them that were sent an empty sample; guarded by mutex_
  const PacketGuard* guard_ = nullptr;
  dds::DataWriter* writer_ = nullptr;
  dds::DataReader* reader_ = nullptr;
};

/// The request behind the header of rmw_cyclonedds as plain CDR; std::nullopt if the sample is too short.
std::optional<std::string> without_header(std::span<const std::uint8_t> sample,
                                          RosEndpoint::PayloadHeader& header);
/// A sample of plain CDR, little endian, with such a header.
std::string with_header(const RosEndpoint::PayloadHeader& header, const std::string& sample);

}  // namespace takt
