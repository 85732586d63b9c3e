#pragma once
// QoS of each topic. Writers keep last, never all (one frozen reader would block them);
// memory that grows with the samples, since the largest possible sample is far larger than any real one; no
// data sharing, which brings nothing at these sizes and does not go with security.
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "server/dds/participant.h"
#include "server/dds/ros_type_hash.h"

namespace takt {

namespace qos_detail {
inline dds::DataWriterQos writer(const Participant& participant, dds::ReliabilityQosPolicyKind reliability,
                                 int depth) {
  dds::DataWriterQos qos = participant.default_writer_qos();
  qos.reliability().kind = reliability;
  qos.durability().kind = dds::VOLATILE_DURABILITY_QOS;
  qos.history().kind = dds::KEEP_LAST_HISTORY_QOS;
  qos.history().depth = depth;
  qos.resource_limits().allocated_samples = depth < 16 ? depth : 16;
  qos.endpoint().history_memory_policy = kGrowingMemory;
  qos.data_sharing().off();
  qos.publish_mode().kind = dds::SYNCHRONOUS_PUBLISH_MODE;
  beat_soon(qos);
  return qos;
}
/// Samples of all senders together that wait for a missing one.
inline constexpr int kMaxWaiting = 1000;
inline dds::DataReaderQos reader(const Participant& participant, int depth) {
  dds::DataReaderQos qos = participant.default_reader_qos();
  qos.reliability().kind = dds::RELIABLE_RELIABILITY_QOS;
  qos.durability().kind = dds::VOLATILE_DURABILITY_QOS;
  // Samples are taken as they come; only those after a missing one wait. Of keep last, 2.9.1 loses memory for
  // each that is older than all that wait (DataReaderHistory.cpp, received_change_keep_last), and hears
  // nobody any more once max_samples are lost. Keep all refuses what does not fit.
  qos.history().kind = dds::KEEP_ALL_HISTORY_QOS;
  qos.resource_limits().max_samples = kMaxWaiting;
  qos.resource_limits().max_samples_per_instance = kMaxWaiting;
  qos.resource_limits().allocated_samples = depth < 16 ? depth : 16;
  qos.endpoint().history_memory_policy = kGrowingMemory;
  qos.data_sharing().off();
  return qos;
}
}  // namespace qos_detail

/// A sample beyond this does not fit one datagram and is sent in fragments by a thread of DDS.
inline constexpr std::size_t kLargestUnfragmented_bytes = 60000;

/// An instant of the cell: whoever misses one gets the next.
inline dds::DataWriterQos state_writer_qos(const Participant& participant, std::size_t sample_bytes) {
  auto qos = qos_detail::writer(participant, dds::BEST_EFFORT_RELIABILITY_QOS, 1);
  if (sample_bytes > kLargestUnfragmented_bytes) qos.publish_mode().kind = dds::ASYNCHRONOUS_PUBLISH_MODE;
  return qos;
}
/// Of standard types: says in the ROS 2 way which definition is meant.
template <typename Qos>
Qos with_type_hash(Qos qos, std::string_view hash) {
  const std::string text = "typehash=" + std::string(hash) + ";";
  qos.user_data().data_vec(std::vector<rtps::octet>(text.begin(), text.end()));
  return qos;
}
/// ROS 2 nodes read these reliably by default; keep last still never waits for them.
inline dds::DataWriterQos ros_writer_qos(const Participant& participant, int depth, std::string_view hash) {
  return with_type_hash(qos_detail::writer(participant, dds::RELIABLE_RELIABILITY_QOS, depth), hash);
}
inline dds::DataWriterQos event_writer_qos(const Participant& participant) {
  return qos_detail::writer(participant, dds::RELIABLE_RELIABILITY_QOS, 1000);
}
/// Late joiners get the newest sample at once. `large`: samples of megabytes.
inline dds::DataWriterQos latched_writer_qos(const Participant& participant, bool large) {
  auto qos = qos_detail::writer(participant, dds::RELIABLE_RELIABILITY_QOS, 1);
  qos.durability().kind = dds::TRANSIENT_LOCAL_DURABILITY_QOS;
  if (large) qos.publish_mode().kind = dds::ASYNCHRONOUS_PUBLISH_MODE;
  return qos;
}
inline dds::DataWriterQos control_writer_qos(const Participant& participant) {
  return qos_detail::writer(participant, dds::RELIABLE_RELIABILITY_QOS, 100);
}
inline dds::DataReaderQos control_reader_qos(const Participant& participant) {
  return qos_detail::reader(participant, 100);
}

/// Every command topic has two readers, since DDS matches only ends of the same ownership kind: EXCLUSIVE for
/// takt's own clients, SHARED for stock ROS 2 publishers. No lease is asked for: in 2.9.1 a lease that runs
/// out is not noticed while another sender is alive (Fast-DDS #4373; measured). A sender that dies without a
/// word is noticed when the lease of its participant runs out (5 s for takt's clients), and then the next one
/// is heard.
inline dds::DataReaderQos command_reader_qos(const Participant& participant, bool exclusive) {
  auto qos = qos_detail::reader(participant, 1);
  if (exclusive) qos.ownership().kind = dds::EXCLUSIVE_OWNERSHIP_QOS;
  return qos;
}

}  // namespace takt
