#pragma once
// The Fast DDS headers this room uses, under short names, and everything that differs between the majors of
// Fast DDS. Written against 2.9.1 (Debian 12).
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastdds/rtps/transport/shared_mem/SharedMemTransportDescriptor.h>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/publisher/qos/DataWriterQos.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/subscriber/qos/DataReaderQos.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>

#include <sstream>
#include <string>

namespace takt {

namespace dds = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;

using DdsReturnCode = eprosima::fastrtps::types::ReturnCode_t;
using DdsDuration = eprosima::fastrtps::Duration_t;
using DdsGuid = rtps::GUID_t;

inline bool is_ok(const DdsReturnCode& code) {
  return code == DdsReturnCode::RETCODE_OK;
}

inline DdsGuid guid_of(const dds::InstanceHandle_t& handle) {
  return rtps::iHandle2GUID(handle);
}

inline std::string text_of(const DdsGuid& guid) {
  std::ostringstream text;
  text << guid;
  return text.str();
}

inline constexpr auto kGrowingMemory = rtps::DYNAMIC_REUSABLE_MEMORY_MODE;

}  // namespace takt
