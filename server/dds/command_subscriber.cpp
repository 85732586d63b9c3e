#include "server/dds/command_subscriber.h"

#include <utility>

#include "idl/common/text.h"
#include "idl/common/utf8.h"
#include "server/dds/convert_commands.h"
#include "server/runtime/monotonic_clock.h"
#include "takt_topics.h"

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
  Reader(CommandSubscriber& owner, int of_target, CommandKind of_kind, bool is_exclusive)
      : target(of_target), kind(of_kind), exclusive(is_exclusive), owner_(owner) {}

  const int target;
  const CommandKind kind;
  const bool exclusive;

  void on_data_available(dds::DataReader* reader) override {
    switch (kind) {
      case CommandKind::joints:
        return take<sensor_msgs::msg::JointState>(reader);
      case CommandKind::trajectory:
        return take<trajectory_msgs::msg::JointTrajectory>(reader);
      case CommandKind::gripper:
        return take<takt_msgs::msg::GripperCommand>(reader);
      case CommandKind::device:
        return take<takt_msgs::msg::DeviceCommand>(reader);
      case CommandKind::several:
        return take<takt_msgs::msg::Commands>(reader);
    }
  }
  void on_subscription_matched(dds::DataReader*, const dds::SubscriptionMatchedStatus& status) override {
    const DdsGuid guid = guid_of(status.last_publication_handle);
    if (status.current_count_change > 0) {
      owner_.matched(target, guid, exclusive);
    } else {
      owner_.unmatched(target, guid);
    }
  }
  void on_requested_incompatible_qos(dds::DataReader*,
                                     const dds::RequestedIncompatibleQosStatus& status) override {
    // A sender of the other kind of ownership belongs to the other reader.
    const std::uint32_t of_other_kind = status.policies[dds::OWNERSHIP_QOS_POLICY_ID].count;
    if (std::exchange(of_other_kind_, of_other_kind) != of_other_kind) return;
    owner_.events_.post(events::IncompatibleQos{owner_.name_of(target), policy_name(status.last_policy_id)});
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
      if constexpr (std::is_same_v<Message, takt_msgs::msg::Commands>)
        owner_.received_several(std::move(message), guid, received_ns);
      else
        owner_.received(target, exclusive, std::move(message), guid, received_ns);
    }
  }

  CommandSubscriber& owner_;
  std::uint32_t of_other_kind_ = 0;  ///< senders refused for their kind of ownership; one thread of DDS
};

template <typename Message>
void CommandSubscriber::received(int target, bool exclusive, Message&& message, const DdsGuid& guid,
                                 std::int64_t received_ns) {
  const CellDescription& cell = loop_->cell();
  const auto raw = from_message(cell, target, std::forward<Message>(message));
  if (const auto* malformed = std::get_if<Rejection>(&raw)) return reject(*malformed, guid);
  const auto validated = validate(cell, target, std::get<0>(raw));
  if (const auto* rejection = std::get_if<Rejection>(&validated)) return reject(*rejection, guid);
  deliver(target, exclusive, Command(std::get<0>(validated)), guid, received_ns);
}

void CommandSubscriber::received_several(takt_msgs::msg::Commands&& message, const DdsGuid& guid,
                                         std::int64_t received_ns) {
  const CellDescription& cell = loop_->cell();
  const auto robots = static_cast<int>(cell.robots.size()), grippers = static_cast<int>(cell.grippers.size());
  const auto each = [&](int index, int first, auto& command) {
    if (index >= 0) received(first + index, true, std::move(command), guid, received_ns);
    return index >= 0;
  };
  const auto unknown = [&](RejectionCode code, const std::string& name, const auto& known) {
    const std::string called = utf8_sanitize(name, 60);
    reject({code, called, "the cell has no '" + called + "' of this kind; it has " + list_names(known)},
           guid);
  };
  for (auto& [name, command] : message.robots)
    if (!each(cell.find_robot(name), 0, command)) unknown(RejectionCode::unknown_robot, name, cell.robots);
  for (auto& [name, command] : message.grippers)
    if (!each(cell.find_gripper(name), robots, command))
      unknown(RejectionCode::unknown_gripper, name, cell.grippers);
  for (auto& [name, command] : message.devices)
    if (!each(cell.find_device(name), robots + grippers, command))
      unknown(RejectionCode::unknown_device, name, cell.devices);
}

CommandSubscriber::CommandSubscriber(EventQueue& events, SenderRegistry& senders, TopicNames topics)
    : events_(events), senders_(senders), topics_(std::move(topics)), ownership_(senders) {}

CommandSubscriber::~CommandSubscriber() = default;

void CommandSubscriber::listen_for(const PacketGuard* guard, const DdsGuid& own) {
  const std::lock_guard lock(mutex_);
  ownership_.listen_for(guard != nullptr ? &guard->heard() : nullptr, own);
}

void CommandSubscriber::open(Participant& participant, RunLoop& loop) {
  const CellDescription& cell = loop.cell();
  const int targets = target_count(cell);
  {
    const std::lock_guard lock(mutex_);
    loop_ = &loop;
    participant_ = &participant;
    ownership_.restart(static_cast<std::size_t>(targets));
    for (auto& [guid, writer] : ownership_.writers()) diagnose(guid, writer);
  }
  const std::lock_guard making(readers_mutex_);
  const auto robots = static_cast<int>(cell.robots.size());
  const auto grippers = static_cast<int>(cell.grippers.size());
  const auto listen = [this](int target, CommandKind kind, bool exclusive) {
    Listening& made = readers_.emplace_back();
    made.listener = std::make_unique<Reader>(*this, target, kind, exclusive);
    made.reader = make_reader(*made.listener);
  };
  listen(-1, CommandKind::several, false);
  for (int target = 0; target < targets; ++target) {
    std::vector<CommandKind> kinds{CommandKind::joints, CommandKind::trajectory};
    if (target >= robots) kinds = {target < robots + grippers ? CommandKind::gripper : CommandKind::device};
    for (const CommandKind kind : kinds) {
      for (const bool exclusive : {true, false}) listen(target, kind, exclusive);
    }
  }
}

dds::DataReader* CommandSubscriber::make_reader(Reader& listener) {
  const TopicInfo& info = topic_of(listener.kind);
  const std::string topic = topics_.of(
      info, listener.target < 0 ? std::string_view() : target_name(loop_->cell(), listener.target));
  QosPolicy policy = qos_of(info);
  policy.exclusive = listener.exclusive;
  const auto qos = with_type_hash(service_reader_qos(participant_->default_reader_qos(), policy), *info.type);
  switch (listener.kind) {
    case CommandKind::joints:
      return participant_->create_reader<sensor_msgs::msg::JointState>(topic, qos, &listener);
    case CommandKind::trajectory:
      return participant_->create_reader<trajectory_msgs::msg::JointTrajectory>(topic, qos, &listener);
    case CommandKind::gripper:
      return participant_->create_reader<takt_msgs::msg::GripperCommand>(topic, qos, &listener);
    case CommandKind::several:
      return participant_->create_reader<takt_msgs::msg::Commands>(topic, qos, &listener);
    case CommandKind::device:
      break;
  }
  return participant_->create_reader<takt_msgs::msg::DeviceCommand>(topic, qos, &listener);
}

void CommandSubscriber::close() {
  {
    const std::lock_guard making(readers_mutex_);
    for (const Listening& listening : readers_) participant_->remove(listening.reader);
    readers_.clear();
  }
  const std::lock_guard lock(mutex_);
  loop_ = nullptr;
}

void CommandSubscriber::writer_discovered(const DdsGuid& guid, CommandWriter writer) {
  const auto command = command_topic(topics_, writer.topic, CellDescription{});
  if (!command) return;
  const std::lock_guard lock(mutex_);
  CommandWriter& added = ownership_.add(guid, std::move(writer));
  added.command = *command;
  if (loop_ != nullptr) diagnose(guid, added);
}

void CommandSubscriber::diagnose(const DdsGuid& guid, CommandWriter& writer) {
  writer.command = *command_topic(topics_, writer.topic, loop_->cell());
  auto event = diagnose_writer(writer.command, writer.topic, writer.type, text_of(guid), loop_->cell());
  // A wrong type stays wrong in every cell.
  const bool of_type = writer.command.target >= 0 || writer.command.kind == CommandKind::several;
  if (!event || (of_type && std::exchange(writer.wrong_type_reported, true))) return;
  events_.post(std::move(*event));
}

void CommandSubscriber::writer_removed(const DdsGuid& guid) {
  const std::lock_guard lock(mutex_);
  ownership_.remove(guid);
}

void CommandSubscriber::expire_liveliness_leases() {
  std::vector<CommandOwnership::Revoked> revoked;
  {
    const std::lock_guard lock(mutex_);
    if (loop_ != nullptr && ownership_.listens()) revoked = ownership_.expire();
  }
  if (revoked.empty()) return;
  std::set<int> targets;
  for (const auto& each : revoked) targets.insert(each.target);
  renew_exclusive_readers(targets);
  for (const auto& [target, owner, silence_s] : revoked)
    events_.post(events::OwnerSilent{name_of(target), silence_s}, text_of(owner));
}

void CommandSubscriber::renew_exclusive_readers(const std::set<int>& targets) {
  const std::lock_guard making(readers_mutex_);
  for (Listening& listening : readers_) {
    const int target = listening.listener->target;
    if (!listening.listener->exclusive || !targets.contains(target)) continue;
    participant_->remove(listening.reader);
    listening.reader = nullptr;
    try {
      listening.reader = make_reader(*listening.listener);
    } catch (const DdsError& error) {
      events_.post(events::NoReader{name_of(target), error.what()});
    }
  }
}

void CommandSubscriber::matched(int target, const DdsGuid& guid, bool exclusive) {
  std::optional<std::uint64_t> loser;
  {
    const std::lock_guard lock(mutex_);
    loser = ownership_.matched(target, guid, exclusive);
  }
  if (loser) events_.post(events::NotOwner{name_of(target)}, senders_.text(*loser));
}

void CommandSubscriber::unmatched(int target, const DdsGuid& guid) {
  const std::lock_guard lock(mutex_);
  ownership_.unmatched(target, guid);
}

void CommandSubscriber::deliver(int target, bool exclusive, const Command& command, const DdsGuid& guid,
                                std::int64_t received_ns) {
  std::optional<CommandArbiter::Verdict> verdict;
  std::optional<std::uint64_t> loser;
  {
    const std::lock_guard lock(mutex_);
    verdict = ownership_.on_command(target, guid, exclusive, received_ns, loser);
  }
  if (loser) events_.post(events::NotOwner{name_of(target)}, senders_.text(*loser));
  if (!verdict) return;
  if (verdict->heard) {
    if (const auto rejection = loop_->append(command, senders_.id(guid), received_ns))
      reject(*rejection, guid);
    return;
  }
  rejected_.fetch_add(1, std::memory_order_relaxed);
  if (verdict->report && loser != senders_.id(guid))
    events_.post(events::OwnedByAnother{name_of(target), senders_.text(verdict->owner)}, text_of(guid));
}

std::vector<takt_msgs::msg::TargetOwner> CommandSubscriber::owners() const {
  constexpr std::size_t kLongestName = 128;
  std::vector<takt_msgs::msg::TargetOwner> owners;
  const std::lock_guard lock(mutex_);
  if (loop_ == nullptr) return owners;
  const std::vector<std::uint64_t> of_targets = ownership_.owners();
  for (std::size_t target = 0; target < of_targets.size(); ++target)
    if (of_targets[target] != 0)
      owners.push_back({name_of(static_cast<int>(target)),
                        utf8_sanitize(senders_.name(of_targets[target]), kLongestName)});
  return owners;
}

void CommandSubscriber::reject(const Rejection& rejection, const DdsGuid& guid) {
  rejected_.fetch_add(1, std::memory_order_relaxed);
  events_.post(events::CommandRejected{rejection.subject, rejection.code, rejection.message}, text_of(guid));
}

}  // namespace takt
