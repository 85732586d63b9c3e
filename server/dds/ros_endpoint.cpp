#include "server/dds/ros_endpoint.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "idl/common/cdr.h"
#include "idl/transport/rtps_guard/rtps_submessage.h"

namespace takt {
namespace {

constexpr std::size_t kHeader_bytes = 16;

/// Identity of a request for rmw_fastrtps: its own sequence number, and the reader that waits for the reply.
rtps::SampleIdentity identity_of(const dds::SampleInfo& info) {
  rtps::SampleIdentity caller = info.sample_identity;
  const DdsGuid& reader = info.related_sample_identity.writer_guid();
  if (reader != DdsGuid::unknown()) caller.writer_guid(reader);
  return caller;
}

std::span<const std::uint8_t> bytes_of(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

}  // namespace

std::optional<std::string> without_header(std::span<const std::uint8_t> sample,
                                          RosEndpoint::PayloadHeader& header) {
  cdr::Reader reader(sample);
  header.guid = reader.number<std::uint64_t>();
  header.number = reader.number<std::int64_t>();
  if (!reader.ok()) return std::nullopt;
  const auto* bytes = reinterpret_cast<const char*>(sample.data());
  std::string rest(bytes, cdr::kEncapsulation_bytes);
  rest.append(bytes + cdr::kEncapsulation_bytes + kHeader_bytes,
              sample.size() - cdr::kEncapsulation_bytes - kHeader_bytes);
  return rest;
}

std::string with_header(const RosEndpoint::PayloadHeader& header, const std::string& sample) {
  char bytes[kHeader_bytes];
  std::memcpy(bytes, &header.guid, sizeof(header.guid));
  std::memcpy(bytes + sizeof(header.guid), &header.number, sizeof(header.number));
  std::string result = sample;
  result.insert(cdr::kEncapsulation_bytes, bytes, kHeader_bytes);
  return result;
}

RosEndpoint::RosEndpoint(Participant& participant, const std::string& name, const MessageInfo& request,
                         const MessageInfo& response, OnRequest on_request, std::function<void()> on_match)
    : on_request_(std::move(on_request)), on_match_(std::move(on_match)) {
  guard_ = participant.guard();
  constexpr QosPolicy policy = qos_of(TopicQos::control);
  writer_ = participant.create_bytes_writer("rr/" + name + "Reply", response,
                                            writer_qos(participant.default_writer_qos(), policy), this);
  reader_ = participant.create_bytes_reader(
      "rq/" + name + "Request", request, service_reader_qos(participant.default_reader_qos(), policy), this);
}

void RosEndpoint::remove(Participant& participant) {
  participant.remove(std::exchange(reader_, nullptr));
  participant.remove(std::exchange(writer_, nullptr));
}

bool RosEndpoint::reaches(const Caller& caller) {
  const DdsGuid& wanted = caller.identity.writer_guid();
  {
    const std::lock_guard lock(mutex_);
    const auto reader = std::find_if(readers_.begin(), readers_.end(), [&](const DdsGuid& one) {
      return one == wanted || one.guidPrefix == wanted.guidPrefix;
    });
    if (reader == readers_.end()) return false;
    if (!caller.header || guard_ == nullptr ||
        guard_->is_synchronised(wanted.guidPrefix, writer_->guid().entityId))
      return true;
    if (!primed_.insert(*reader).second) return false;
  }
  constexpr std::size_t kEmptyMessage_bytes = 64;
  std::string nothing(cdr::kEncapsulation_bytes + kEmptyMessage_bytes, '\0');
  nothing[1] = 1;  // little endian
  nothing = with_header({}, nothing);
  (void)written(*writer_, nothing);
  return false;
}

void RosEndpoint::write(const Caller& caller, std::string sample) {
  if (caller.header) sample = with_header(*caller.header, sample);
  rtps::WriteParams params;
  params.related_sample_identity(caller.identity);
  (void)written(*writer_, sample, params);
}

void RosEndpoint::wait_for_acknowledgments() {
  takt::wait_for_acknowledgments(*writer_);
}

void RosEndpoint::on_data_available(dds::DataReader* reader) {
  std::string sample;
  dds::SampleInfo info;
  while (is_ok(reader->take_next_sample(&sample, &info))) {
    if (!info.valid_data) continue;
    Caller caller{identity_of(info), std::nullopt};
    if (is_cyclone(guid_of(info.publication_handle).guidPrefix.value)) {
      PayloadHeader header;
      const auto request = without_header(bytes_of(sample), header);
      if (!request) continue;
      caller.header = header;
      on_request_(caller, bytes_of(*request));
    } else {
      on_request_(caller, bytes_of(sample));
    }
  }
}

void RosEndpoint::on_publication_matched(dds::DataWriter*, const dds::PublicationMatchedStatus& status) {
  const DdsGuid reader = guid_of(status.last_subscription_handle);
  {
    const std::lock_guard lock(mutex_);
    if (status.current_count_change > 0) {
      readers_.insert(reader);
    } else {
      readers_.erase(reader);
      primed_.erase(reader);
    }
  }
  if (status.current_count_change > 0) on_match_();
}

}  // namespace takt
