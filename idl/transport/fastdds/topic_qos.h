#pragma once
// QoS of idl/common/topic.h as Fast DDS settings. Memory grows with the samples, since the largest possible
// sample is far larger than any real one; no data sharing, which gives no benefit at these sizes and excludes
// security.
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
  qos.ownership().kind = policy.exclusive ? dds::EXCLUSIVE_OWNERSHIP_QOS : dds::SHARED_OWNERSHIP_QOS;
  qos.history().kind = dds::KEEP_LAST_HISTORY_QOS;
  qos.history().depth = policy.depth;
  qos.resource_limits().allocated_samples = policy.depth < 16 ? policy.depth : 16;
  qos.endpoint().history_memory_policy = kGrowingMemory;
  qos.data_sharing().off();
  return qos;
}
}  // namespace qos_detail

/// Of a standard type: announces the definition in the ROS 2 way.
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
  // A sample of several datagrams is sent by the writing thread, too: the asynchronous thread of Fast DDS spins for the
  // writer's lock, up to a millisecond where it has displaced the thread that holds it.
  qos.publish_mode().kind = policy.large ? dds::ASYNCHRONOUS_PUBLISH_MODE : dds::SYNCHRONOUS_PUBLISH_MODE;
  if (policy.lease_s > 0.0) {
    qos.liveliness().kind = dds::AUTOMATIC_LIVELINESS_QOS;
    qos.liveliness().lease_duration = DdsDuration(policy.lease_s);
    qos.liveliness().announcement_period = DdsDuration(0.25 * policy.lease_s);
  }
  beat_soon(qos, policy.heartbeat_period_s);
  return qos;
}
inline dds::DataReaderQos reader_qos(const dds::DataReaderQos& defaults, const QosPolicy& policy) {
  return qos_detail::with_policy(defaults, policy);
}

/// For a reader with many writers that must not miss a sample: samples are taken as they arrive, and only
/// those behind a missing one wait. With keep last, 2.9.1 loses memory for each sample older than all waiting
/// ones (DataReaderHistory.cpp, received_change_keep_last), and receives no samples after the loss of
/// max_samples. Keep all refuses samples beyond its capacity.
inline dds::DataReaderQos service_reader_qos(const dds::DataReaderQos& defaults, const QosPolicy& policy) {
  constexpr int kMaxWaiting = 1000;  // samples of all senders together that wait for a missing one
  auto qos = reader_qos(defaults, policy);
  qos.history().kind = dds::KEEP_ALL_HISTORY_QOS;
  qos.resource_limits().max_samples = kMaxWaiting;
  qos.resource_limits().max_samples_per_instance = kMaxWaiting;
  return qos;
}

}  // namespace takt
