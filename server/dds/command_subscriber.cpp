#include "server/dds/command_subscriber.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "ros2_msgsPubSubTypes.h"
#include "server/dds/convert.h"
#include "server/dds/qos.h"
#include "server/runtime/monotonic_clock.h"
#include "takt_msgsPubSubTypes.h"

namespace takt {
namespace {

std::string policy_name(dds::QosPolicyId_t policy) {
  switch (policy) {
    case dds::LIVELINESS_QOS_POLICY_ID:
      return "liveliness";
    case dds::RELIABILITY_QOS_POLICY_ID:
      return "reliability (commands must be sent reliably)";
    case dds::DURABILITY_QOS_POLICY_ID:
      return "durability";
    case dds::DEADLINE_QOS_POLICY_ID:
      return "deadline";
    default:
      return "policy number " + std::to_string(static_cast<int>(policy));
  }
}

}  // namespace

/// Listens to one topic with one kind of ownership.
class CommandSubscriber::Reader final : public dds::DataReaderListener {
 public:
  Reader(CommandSubscriber& owner, int target, bool exclusive)
      : owner_(owner), target_(target), exclusive_(exclusive) {}

  void on_data_available(dds::DataReader* reader) override {
    if (target_ < static_cast<int>(owner_.loop_->cell().robots.size())) {
      take<sensor_msgs::msg::JointState>(reader);
    } else {
      take<takt_msgs::msg::GripperCommand>(reader);
    }
  }
  void on_subscription_matched(dds::DataReader*, const dds::SubscriptionMatchedStatus& status) override {
    const DdsGuid guid = guid_of(status.last_publication_handle);
    if (status.current_count_change > 0) {
      owner_.matched(target_, guid, exclusive_);
    } else {
      owner_.unmatched(target_, guid);
    }
  }
  void on_requested_incompatible_qos(dds::DataReader*,
                                     const dds::RequestedIncompatibleQosStatus& status) override {
    // A sender of the other kind of ownership is what the other reader is there for.
    const std::uint32_t of_other_kind = status.policies[dds::OWNERSHIP_QOS_POLICY_ID].count;
    if (std::exchange(of_other_kind_, of_other_kind) != of_other_kind) return;
    owner_.incompatible(target_, policy_name(status.last_policy_id));
  }

 private:
  template <typename Message>
  void take(dds::DataReader* reader) {
    Message message;
    dds::SampleInfo info;
    while (is_ok(reader->take_next_sample(&message, &info))) {
      if (!info.valid_data) continue;
      const std::int64_t received_ns = monotonic_now_ns();
      const DdsGuid guid = guid_of(info.publication_handle);
      const CellDescription& cell = owner_.loop_->cell();
      const auto raw = from_message(std::string(target_name(cell, target_)), message);
      if (const auto* malformed = std::get_if<Rejection>(&raw)) {
        owner_.reject(*malformed, guid);
        continue;
      }
      std::visit(
          [&](const auto& content) {
            if constexpr (!std::is_same_v<std::decay_t<decltype(content)>, Rejection>) {
              const auto validated = validate(cell, content);
              if (const auto* rejection = std::get_if<Rejection>(&validated)) {
                owner_.reject(*rejection, guid);
              } else {
                owner_.deliver(target_, exclusive_, Command(std::get<0>(validated)), guid, received_ns);
              }
            }
          },
          raw);
    }
  }

  CommandSubscriber& owner_;
  const int target_;
  const bool exclusive_;
  std::uint32_t of_other_kind_ =
      0;  ///< senders refused for their kind of ownership; told by one thread of DDS
};

CommandSubscriber::CommandSubscriber(AdapterEvents& events, Senders& senders, TopicNames topics)
    : events_(events), senders_(senders), topics_(std::move(topics)) {}

CommandSubscriber::~CommandSubscriber() = default;

void CommandSubscriber::open(Participant& participant, RunLoop& loop) {
  const CellDescription& cell = loop.cell();
  const auto targets = static_cast<int>(cell.robots.size() + cell.grippers.size());
  std::vector<AdapterEvent> news;
  {
    const std::lock_guard lock(mutex_);
    loop_ = &loop;
    participant_ = &participant;
    arbiters_.assign(static_cast<std::size_t>(targets), {});
    gone_.clear();
    for (const auto& [guid, writer] : writers_) {
      if (auto event = unheard(guid, writer.topic, cell)) news.push_back(std::move(*event));
    }
  }
  for (AdapterEvent& event : news) events_.post(std::move(event));
  for (int target = 0; target < targets; ++target) {
    const bool robot = target < static_cast<int>(cell.robots.size());
    const std::string topic = topics_.of(target_name(cell, target), robot ? kJointCommands : kGripperCommand);
    for (const bool exclusive : {true, false}) {
      Listening& made = readers_.emplace_back();
      made.listener = std::make_unique<Reader>(*this, target, exclusive);
      const auto qos = command_reader_qos(participant, exclusive);
      made.reader = robot ? participant.create_reader<sensor_msgs::msg::JointStatePubSubType>(
                                topic, qos, made.listener.get())
                          : participant.create_reader<takt_msgs::msg::GripperCommandPubSubType>(
                                topic, qos, made.listener.get());
    }
  }
}

void CommandSubscriber::close() {
  for (const Listening& listening : readers_) participant_->remove(listening.reader);
  readers_.clear();
  const std::lock_guard lock(mutex_);
  loop_ = nullptr;
}

void CommandSubscriber::writer_discovered(const DdsGuid& guid, const std::string& topic,
                                          std::uint32_t strength) {
  if (topics_.name_in(topic, kJointCommands).empty() && topics_.name_in(topic, kGripperCommand).empty())
    return;
  std::optional<AdapterEvent> event;
  {
    const std::lock_guard lock(mutex_);
    writers_[guid] = {topic, strength};
    if (loop_ != nullptr) event = unheard(guid, topic, loop_->cell());
  }
  if (event) events_.post(std::move(*event));
}

std::optional<AdapterEvent> CommandSubscriber::unheard(const DdsGuid& guid, const std::string& topic,
                                                       const CellDescription& cell) const {
  const std::string robot = topics_.name_in(topic, kJointCommands);
  const std::string gripper = topics_.name_in(topic, kGripperCommand);
  const auto event = [&](const char* code, const std::string& name, const Rejection& rejection) {
    return AdapterEvent{Severity::warning, code, name, text_of(guid),
                        "Nobody listens to the topic " + topic + ": " + rejection.message + "."};
  };
  // Validation knows best what is there and how to say what is not.
  if (!robot.empty() && cell.find_robot(robot) < 0) {
    const auto verdict = validate(cell, RawJointCommand{robot, -1.0, {}, {}, {}, {}});
    return event("unknown_robot", robot, std::get<Rejection>(verdict));
  }
  if (!gripper.empty() && cell.find_gripper(gripper) < 0) {
    const auto verdict = validate(cell, RawGripperCommand{gripper, -1.0, 0, 0.0, 0.0});
    return event("unknown_gripper", gripper, std::get<Rejection>(verdict));
  }
  return std::nullopt;
}

void CommandSubscriber::writer_removed(const DdsGuid& guid) {
  const std::lock_guard lock(mutex_);
  writers_.erase(guid);
  gone_.erase(guid);
}

std::optional<std::uint64_t> CommandSubscriber::appeared(int target, const DdsGuid& guid, bool exclusive) {
  CommandArbiter& arbiter = arbiters_[static_cast<std::size_t>(target)];
  CommandArbiter::Sender sender;
  sender.id = senders_.id(guid);
  if (arbiter.knows(sender.id)) return std::nullopt;
  sender.exclusive = exclusive;
  std::copy_n(guid.guidPrefix.value, 12, sender.identity.begin());
  std::copy_n(guid.entityId.value, 4, sender.identity.begin() + 12);
  const auto writer = writers_.find(guid);
  sender.strength = writer == writers_.end() ? 0 : writer->second.strength;
  return arbiter.appeared(sender);
}

void CommandSubscriber::matched(int target, const DdsGuid& guid, bool exclusive) {
  std::optional<std::uint64_t> loser;
  {
    const std::lock_guard lock(mutex_);
    gone_.erase(guid);
    loser = appeared(target, guid, exclusive);
  }
  if (!loser) return;
  const std::string name(target_name(loop_->cell(), target));
  events_.post({Severity::warning, "not_owner", name, senders_.text(*loser),
                "Several senders offer commands for " + name +
                    " exclusively; only the strongest is heard, and this one is weaker than another."});
}

void CommandSubscriber::unmatched(int target, const DdsGuid& guid) {
  const std::lock_guard lock(mutex_);
  arbiters_[static_cast<std::size_t>(target)].vanished(senders_.id(guid));
  gone_.insert(guid);
}

void CommandSubscriber::incompatible(int target, const std::string& policy) {
  const std::string name(target_name(loop_->cell(), target));
  events_.post({Severity::warning, "incompatible_qos", name, "",
                "A sender of commands for " + name +
                    " cannot be heard, because its QoS does not fit: " + policy + "."});
}

void CommandSubscriber::deliver(int target, bool exclusive, const Command& command, const DdsGuid& guid,
                                std::int64_t received_ns) {
  const std::uint64_t sender = senders_.id(guid);
  CommandArbiter::Verdict verdict;
  {
    const std::lock_guard lock(mutex_);
    if (gone_.contains(guid)) return;
    // DDS hands over samples and matches by different threads: a first command may come before its sender.
    (void)appeared(target, guid, exclusive);
    verdict = arbiters_[static_cast<std::size_t>(target)].offered(sender, received_ns);
  }
  if (!verdict.heard) {
    rejected_.fetch_add(1, std::memory_order_relaxed);
    if (!verdict.tell) return;
    const std::string name(target_name(loop_->cell(), target));
    events_.post({Severity::warning, std::string(to_string(RejectionCode::not_owner)), name, text_of(guid),
                  "Commands of this sender for " + name + " are not applied: " +
                      senders_.text(verdict.owner) + " commands it as long as it is there."});
    return;
  }
  if (const auto rejection = loop_->append(command, sender, received_ns)) reject(*rejection, guid);
}

void CommandSubscriber::reject(const Rejection& rejection, const DdsGuid& guid) {
  rejected_.fetch_add(1, std::memory_order_relaxed);
  events_.post({Severity::warning, "command_rejected", rejection.subject, text_of(guid),
                std::string(to_string(rejection.code)) + ": " + rejection.message});
}

}  // namespace takt
