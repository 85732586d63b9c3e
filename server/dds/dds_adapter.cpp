#include "server/dds/dds_adapter.h"

#include <algorithm>
#include <cstdio>
#include <limits>

#include "idl/common/utf8.h"
#include "server/dds/topic_names.h"
#include "server/messages/description_message.h"
#include "takt_topics.h"

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

const std::string& plain(const std::string& name, const char* what) {
  if (validate_utf8(name)) return name;
  throw DdsError(std::string(what) + " '" + utf8_sanitize(name, 60) +
                 "' is no text; over DDS it must be UTF-8 without control characters.");
}

}  // namespace

DdsAdapter::DdsAdapter(CellHost& host, ParticipantOptions options, bool namespaced_clock_and_tf)
    : host_(host),
      topics_(checked(host.cell(), "The cell's name"), namespaced_clock_and_tf),
      commands_(host.outbound().events, senders_, topics_),
      control_(host),
      services_(host),
      actions_(host) {
  participant_ = std::make_unique<Participant>(options, *this);
  {
    const std::lock_guard lock(own_mutex_);
    own_ = participant_->guid();
  }
  if (UdpReceiver* receiver = participant_->receiver()) receiver_.emplace(*receiver);
  commands_.listen_for(participant_->guard(), participant_->guid());
  publisher_ = std::make_unique<StatePublisher>(host, *participant_, topics_, senders_, commands_, control_,
                                                services_, actions_);
  control_.listen(*participant_, topics_);
  services_.serve(*participant_, host.cell());
  actions_.serve(*participant_);
  host.set_listener(this);
  io_.emplace(host, *publisher_, commands_, participant_->guard());
}

DdsAdapter::~DdsAdapter() {
  stop();
}

void DdsAdapter::stop() {
  if (io_) io_->stop();
  receive_in(nullptr);
  commands_.close();
  actions_.close();
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
  try {
    (void)to_message(cell, TAKT_VERSION);
  } catch (const MessageError& error) {
    throw DdsError(error.what());
  }
}

void DdsAdapter::opened(RunLoop& loop) {
  publisher_->open(loop);
  commands_.open(*participant_, loop);
  actions_.open(loop);
  receive_in(&loop);
}

void DdsAdapter::closed(RunLoop&) {
  receive_in(nullptr);
  commands_.close();
  actions_.close();
  publisher_->close();
}

void DdsAdapter::idle(const CellDescription& cell) {
  commands_.close();  // removes the remains of a failure
  actions_.close();
  publisher_->close();
  publisher_->describe(cell);
}

void DdsAdapter::receive_in(RunLoop* loop) {
  if (loop_ != nullptr) loop_->receive_with(nullptr);
  loop_ = receiver_ ? loop : nullptr;
  if (loop_ != nullptr) loop_->receive_with(&*receiver_);
}

bool DdsAdapter::is_own(const DdsGuid& writer) {
  const std::lock_guard lock(own_mutex_);
  return own_ && own_->guidPrefix == writer.guidPrefix;
}

template <typename Type>
void DdsAdapter::report(const Type& event, const DdsGuid& writer) {
  DiagnosticEvent text = diagnostic(event, host_.cell(), text_of(writer));
  std::fprintf(stderr, "takt-server: %s\n", text.message.c_str());
  host_.outbound().events.post(std::move(text));
}

void DdsAdapter::on_writer(const DiscoveredWriter& writer) {
  using News = DiscoveredWriter::News;
  if (writer.topic == topics_.of(topics::status)) {
    if (writer.news != News::appeared || is_own(writer.guid)) return;
    return report(events::CellNameTaken{host_.cell()}, writer.guid);
  }
  // Frames come from many nodes; time has one source.
  if (writer.topic == topics_.of(topics::clock) && !topics_.clock_is_own()) {
    if (writer.news == News::appeared && !is_own(writer.guid)) report_shared_clock(writer.guid);
    return;
  }
  if (writer.news == News::appeared)
    commands_.writer_discovered(
        writer.guid, {writer.topic, writer.type, writer.ownership_strength, lease_s(writer.lease)});
  else if (writer.news == News::gone)
    commands_.writer_removed(writer.guid);
}

/// Once for each participant: its writer is discovered again with every scenario.
void DdsAdapter::report_shared_clock(const DdsGuid& writer) {
  constexpr std::size_t kRemembered = 256;
  {
    const std::lock_guard lock(own_mutex_);
    const auto same = [&](const DdsGuid& other) { return other.guidPrefix == writer.guidPrefix; };
    if (std::any_of(other_clocks_.begin(), other_clocks_.end(), same)) return;
    if (other_clocks_.size() == kRemembered) other_clocks_.erase(other_clocks_.begin());
    other_clocks_.push_back(writer);
  }
  report(events::ClockShared{}, writer);
}

}  // namespace takt
