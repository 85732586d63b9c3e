#pragma once
// The service's DDS end: one participant, commands in, samples out. Joined to a RunLoop by server_main.
#include <memory>
#include <string>

#include "server/dds/adapter_events.h"
#include "server/dds/command_subscriber.h"
#include "server/dds/control_service.h"
#include "server/dds/participant.h"
#include "server/dds/senders.h"
#include "server/dds/state_publisher.h"
#include "server/runtime/run_loop.h"

namespace takt {

class DdsAdapter final : public dds::DomainParticipantListener {
 public:
  /// Make it before the loop starts, so that the loop's first instant is sent. The loop must outlive it.
  /// Throws DdsError, also when a robot's or gripper's name cannot be part of a topic.
  DdsAdapter(RunLoop& loop, ParticipantOptions options);
  ~DdsAdapter() override;

  /// Sends what is left, then leaves the domain. Stop the loop first.
  void stop();

  const StatePublisher& publisher() const { return *publisher_; }
  /// What the guard in front of the transports has let through and dropped; null without one or after stop().
  const PacketGuard* guard() const { return participant_ ? participant_->guard() : nullptr; }

 private:
  void on_publisher_discovery(dds::DomainParticipant* participant, rtps::WriterDiscoveryInfo&& info) override;

  Senders senders_;
  AdapterEvents events_;
  CommandSubscriber commands_;
  ControlService control_;
  std::unique_ptr<Participant> participant_;
  std::unique_ptr<StatePublisher> publisher_;
};

}  // namespace takt
