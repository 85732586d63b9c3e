#include "server/dds/dds_adapter.h"

#include "server/dds/topic_names.h"

namespace takt {
namespace {

void check_name(const std::string& name, const char* what) {
  if (is_topic_level(name)) return;
  throw DdsError(
      std::string(what) + " '" + name +
      "' cannot be part of a topic name; allowed are letters, digits and underscores, no digit first.");
}

}  // namespace

DdsAdapter::DdsAdapter(RunLoop& loop, ParticipantOptions options)
    : events_(loop.outbox().news), commands_(loop, events_, senders_), control_(loop) {
  const CellDescription& cell = loop.cell();
  check_name(cell.cell, "The cell's name");
  for (const auto& robot : cell.robots) check_name(robot.name, "The robot's name");
  for (const auto& gripper : cell.grippers) check_name(gripper.name, "The gripper's name");
  const TopicNames topics(cell.cell);
  participant_ = std::make_unique<Participant>(options, this);
  publisher_ =
      std::make_unique<StatePublisher>(loop, *participant_, topics, events_, senders_, commands_, control_);
  control_.listen(*participant_, topics);
  commands_.listen(*participant_, topics);
  publisher_->start();
}

DdsAdapter::~DdsAdapter() {
  stop();
}

void DdsAdapter::stop() {
  if (publisher_) publisher_->stop();
  participant_.reset();
}

void DdsAdapter::on_publisher_discovery(dds::DomainParticipant*, rtps::WriterDiscoveryInfo&& info) {
  using Info = rtps::WriterDiscoveryInfo;
  if (info.status == Info::DISCOVERED_WRITER) {
    commands_.writer_discovered(info.info.guid(), info.info.topicName().to_string(),
                                info.info.m_qos.m_ownershipStrength.value);
  } else if (info.status == Info::REMOVED_WRITER) {
    commands_.writer_removed(info.info.guid());
  }
}

}  // namespace takt
