#pragma once
// QoS of idl/common/topic.h as Fast DDS takes it. Memory grows with the samples, since the largest possible sample is far
// larger than any real one; no data sharing, which brings nothing at these sizes and does not go with security.
#include <cstddef>
#include <string>
#include <vector>

#include "idl/common/topic.h"
#include "idl/transport/fastdds/fastdds.h"

namespace takt {

namespace qos_detail {
template <typename Qos>
Qos with_policy(Qos qos, const QosPolicy& policy) {
  qos.reliability().kind = policy.reliable ? dds::RELIABLE_RELIABILITY_QOS : dds::BEST_EFFORT_RELIABILITY_QOS;
  qos.durability().kind = policy.latched ? dds::TRANSIENT_LOCAL_DURABILITY_QOS : dds::VOLATILE_DURABILITY_QOS;
  qos.history().kind = dds::KEEP_LAST_HISTORY_QOS;
  qos.history().depth = policy.depth;
  qos.resource_limits().allocated_samples = policy.depth < 16 ? policy.depth : 16;
  qos.endpoint().history_memory_policy = kGrowingMemory;
  qos.data_sharing().off();
  return qos;
}
}  // namespace qos_detail

/// A sample beyond this does not fit one datagram and is sent in fragments by a thread of DDS.
inline constexpr std::size_t kLargestUnfragmented_bytes = 60000;

/// Of a standard type: says in the ROS 2 way which definition is meant.
template <typename Qos>
Qos with_type_hash(Qos qos, const MessageInfo& type) {
  const std::string_view hash = annotation(type.annotations, "type_hash");
  if (hash.empty()) return qos;
  const std::string text = "typehash=" + std::string(hash) + ";";
  qos.user_data().data_vec(std::vector<rtps::octet>(text.begin(), text.end()));
  return qos;
}

inline dds::DataWriterQos writer_qos(const dds::DataWriterQos& defaults, const QosPolicy& policy) {
  auto qos = qos_detail::with_policy(defaults, policy);
  qos.publish_mode().kind = policy.large ? dds::ASYNCHRONOUS_PUBLISH_MODE : dds::SYNCHRONOUS_PUBLISH_MODE;
  beat_soon(qos);
  return qos;
}
inline dds::DataReaderQos reader_qos(const dds::DataReaderQos& defaults, const QosPolicy& policy) {
  return qos_detail::with_policy(defaults, policy);
}

/// Of a reader that many write to, each sample of which counts: samples are taken as they come, and only those behind a
/// missing one wait. Of keep last, 2.9.1 loses memory for each sample that is older than all that wait
/// (DataReaderHistory.cpp, received_change_keep_last), and hears nobody any more once max_samples are lost. Keep all
/// refuses what does not fit.
inline dds::DataReaderQos service_reader_qos(const dds::DataReaderQos& defaults, const QosPolicy& policy) {
  constexpr int kMaxWaiting = 1000;  // samples of all senders together that wait for a missing one
  auto qos = reader_qos(defaults, policy);
  qos.history().kind = dds::KEEP_ALL_HISTORY_QOS;
  qos.resource_limits().max_samples = kMaxWaiting;
  qos.resource_limits().max_samples_per_instance = kMaxWaiting;
  return qos;
}

}  // namespace takt
