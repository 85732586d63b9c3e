#include "server/dds/dds_adapter.h"

#include <cstdio>
#include <limits>

#include "server/dds/convert.h"
#include "server/dds/topic_names.h"

#include "server/runtime/plain_text.h"
namespace takt {
namespace {

double lease_s(const DdsDuration& lease) {
  return is_infinite(lease) ? std::numeric_limits<double>::infinity()
                            : static_cast<double>(lease.seconds) + 1e-9 * static_cast<double>(lease.nanosec);
}

const std::string& checked(const std::string& name, const char* what) {
  if (is_topic_level(name)) return name;
  throw DdsError(
      std::string(what) + " '" + name +
      "' cannot be part of a topic name; allowed are letters, digits and underscores, no digit first.");
}

}  // namespace
const std::string& plain(const std::string& name, const char* what) {
  if (is_plain(name)) return name;
  throw DdsError(std::string(what) + " '" + plain_text(name, 60) +
                 "' is no text; over DDS it must be UTF-8 without control characters.");
}


DdsAdapter::DdsAdapter(CellHost& host, ParticipantOptions options)
    : host_(host),
      commands_(host.mail().events, senders_, TopicNames(checked(host.cell(), "The cell's name"))),
      control_(host),
      services_(host) {
  const TopicNames topics(host.cell());
  participant_ = std::make_unique<Participant>(options, this);
  {
    const std::lock_guard lock(own_mutex_);
    own_ = participant_->guid();
  }
  commands_.listen_for(participant_->guard(), participant_->guid());
  publisher_ =
      std::make_unique<StatePublisher>(host, *participant_, topics, senders_, commands_, control_, services_);
  control_.listen(*participant_, topics);
  services_.serve(*participant_, host.cell());
  host.set_observer(this);
  publisher_->start();
}

DdsAdapter::~DdsAdapter() {
  stop();
}

void DdsAdapter::stop() {
  if (publisher_) publisher_->stop();
  commands_.close();
  if (publisher_) publisher_->close();
  participant_.reset();
}

void DdsAdapter::check(const CellDescription& cell) {
  for (const auto& robot : cell.robots) {
    (void)checked(robot.name, "The robot's name");
    for (const auto& link : robot.links) (void)plain(link.name, "The link's name");
  }
  for (const auto& gripper : cell.grippers) (void)checked(gripper.name, "The gripper's name");
  for (const auto& device : cell.devices) (void)checked(device.name, "The device's name");
  (void)to_message(cell, TAKT_VERSION);
}

void DdsAdapter::opened(RunLoop& loop) {
  publisher_->open(loop);
  commands_.open(*participant_, loop);
}

void DdsAdapter::closed(RunLoop&) {
  commands_.close();
  publisher_->close();
}

void DdsAdapter::idle(const CellDescription& cell) {
  commands_.close();  // what was left half open by a failure
  publisher_->close();
  publisher_->describe(cell);
}

void DdsAdapter::on_writer(const DiscoveredWriter& writer) {
  using News = DiscoveredWriter::News;
  if (writer.topic == TopicNames(host_.cell()).of_cell("status")) {
    {
      const std::lock_guard lock(own_mutex_);
      if (writer.news != News::appeared || (own_ && own_->guidPrefix == writer.guid.guidPrefix)) return;
    }
    const std::string sentence = "Another server on this domain is called '" + host_.cell() +
                                 "' too: clients hear now the one, now the other. Give one of them another "
                                 "name (--cell), or another domain.";
    std::fprintf(stderr, "takt-server: %s\n", sentence.c_str());
    host_.mail().events.post(
        {Severity::error, "cell_name_taken", host_.cell(), text_of(writer.guid), sentence});
    return;
  }
  if (writer.news == News::appeared)
    commands_.writer_discovered(writer.guid, writer.topic, writer.ownership_strength, lease_s(writer.lease));
  else if (writer.news == News::gone)
    commands_.writer_removed(writer.guid);
}

}  // namespace takt
