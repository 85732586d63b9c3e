#include "server/dds/command_subscriber.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <optional>
#include <utility>

#include "idl/common/text.h"
#include "server/dds/convert.h"
#include "server/dds/qos.h"
#include "server/dds/wire_shapes.h"
#include "server/runtime/monotonic_clock.h"

namespace takt {
namespace {

LivelinessTracker::Prefix prefix_of(const DdsGuid& guid) {
  LivelinessTracker::Prefix prefix{};
  std::copy_n(guid.guidPrefix.value, prefix.size(), prefix.begin());
  return prefix;
}

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

/// A type as people know it: std_msgs/msg/String for std_msgs::msg::dds_::String_. Another one as it is.
std::string ros_name(const std::string& type) {
  constexpr std::string_view kMark = "::dds_::";
  const auto mark = type.find(kMark);
  if (mark == std::string::npos || !type.ends_with('_')) return "'" + type + "'";
  std::string name = type.substr(0, mark);
  if (const auto colons = name.find("::"); colons != std::string::npos) name.replace(colons, 2, "/");
  const std::size_t last = mark + kMark.size();
  return name + "/" + type.substr(last, type.size() - last - 1);
}

}  // namespace

/// Listens to one topic with one kind of ownership.
class CommandSubscriber::Reader final : public dds::DataReaderListener {
 public:
  Reader(CommandSubscriber& owner, int target, Kind kind, bool exclusive)
      : owner_(owner), target_(target), kind_(kind), exclusive_(exclusive) {}

  void on_data_available(dds::DataReader* reader) override {
    switch (kind_) {
      case Kind::joints:
        return take<sensor_msgs::msg::JointState>(reader);
      case Kind::trajectory:
        return take<trajectory_msgs::msg::JointTrajectory>(reader);
      case Kind::gripper:
        return take<takt_msgs::msg::GripperCommand>(reader);
      case Kind::device:
        return take<takt_msgs::msg::DeviceCommand>(reader);
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
  const Kind kind_;
  const bool exclusive_;
  std::uint32_t of_other_kind_ =
      0;  ///< senders refused for their kind of ownership; told by one thread of DDS
};

CommandSubscriber::CommandSubscriber(EventQueue& events, SenderRegistry& senders, TopicNames topics)
    : events_(events), senders_(senders), topics_(std::move(topics)) {}

CommandSubscriber::~CommandSubscriber() = default;

void CommandSubscriber::listen_for(const PacketGuard* guard, const DdsGuid& own) {
  const std::lock_guard lock(mutex_);
  heard_ = guard != nullptr ? &guard->heard() : nullptr;
  own_ = own;
  for (auto& [guid, writer] : writers_) watch(guid, writer);
}

void CommandSubscriber::watch(const DdsGuid& guid, Writer& writer) {
  if (heard_ == nullptr || own_.is_on_same_process_as(guid))
    writer.lease_s = std::numeric_limits<double>::infinity();
  if (std::isfinite(writer.lease_s)) heard_->watch(prefix_of(guid));
}

void CommandSubscriber::open(Participant& participant, RunLoop& loop) {
  const CellDescription& cell = loop.cell();
  const int targets = target_count(cell);
  std::vector<DiagnosticEvent> news;
  {
    const std::lock_guard lock(mutex_);
    loop_ = &loop;
    participant_ = &participant;
    arbiters_.assign(static_cast<std::size_t>(targets), {});
    silent_owners_.clear();
    gone_.clear();
    for (auto& [guid, writer] : writers_) {
      if (auto event = diagnose_unmatched_writer(guid, writer, cell)) news.push_back(std::move(*event));
    }
  }
  for (DiagnosticEvent& event : news) events_.post(std::move(event));
  const std::lock_guard making(readers_mutex_);
  const auto robots = static_cast<int>(cell.robots.size());
  const auto grippers = static_cast<int>(cell.grippers.size());
  for (int target = 0; target < targets; ++target) {
    if (target < robots) {
      listen(target, Kind::joints);
      listen(target, Kind::trajectory);
    } else {
      listen(target, target < robots + grippers ? Kind::gripper : Kind::device);
    }
  }
}

void CommandSubscriber::listen(int target, Kind kind) {
  const std::string topic = topics_.of(target_name(loop_->cell(), target), topic_of(kind));
  for (const bool exclusive : {true, false}) {
    Listening& made = readers_.emplace_back();
    made.target = target;
    made.kind = kind;
    made.exclusive = exclusive;
    made.listener = std::make_unique<Reader>(*this, target, kind, exclusive);
    made.reader = make_reader(topic, made);
  }
}

dds::DataReader* CommandSubscriber::make_reader(const std::string& topic, const Listening& made) {
  auto qos = command_reader_qos(*participant_, made.exclusive);
  if (made.kind == Kind::joints) qos = with_type_hash(std::move(qos), ros_type_hash::kJointState);
  if (made.kind == Kind::trajectory) qos = with_type_hash(std::move(qos), ros_type_hash::kJointTrajectory);
  auto* const listener = made.listener.get();
  switch (made.kind) {
    case Kind::joints:
      return participant_->create_reader<sensor_msgs::msg::JointStatePubSubType>(topic, qos, listener);
    case Kind::trajectory:
      return participant_->create_reader<trajectory_msgs::msg::JointTrajectoryPubSubType>(topic, qos,
                                                                                          listener);
    case Kind::gripper:
      return participant_->create_reader<takt_msgs::msg::GripperCommandPubSubType>(topic, qos, listener);
    case Kind::device:
      break;
  }
  return participant_->create_reader<takt_msgs::msg::DeviceCommandPubSubType>(topic, qos, listener);
}

const std::string& CommandSubscriber::type_of(Kind kind) {
  static const std::string joints =
      dds::TypeSupport(new sensor_msgs::msg::JointStatePubSubType).get_type_name();
  static const std::string trajectory =
      dds::TypeSupport(new trajectory_msgs::msg::JointTrajectoryPubSubType).get_type_name();
  static const std::string gripper =
      dds::TypeSupport(new takt_msgs::msg::GripperCommandPubSubType).get_type_name();
  static const std::string device =
      dds::TypeSupport(new takt_msgs::msg::DeviceCommandPubSubType).get_type_name();
  switch (kind) {
    case Kind::joints:
      return joints;
    case Kind::trajectory:
      return trajectory;
    case Kind::gripper:
      return gripper;
    case Kind::device:
      break;
  }
  return device;
}

std::string_view CommandSubscriber::topic_of(Kind kind) {
  if (kind == Kind::joints) return kJointCommands;
  return kind == Kind::trajectory ? kJointTrajectory : kCommand;
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

void CommandSubscriber::writer_discovered(const Discovered& discovered) {
  const std::string& topic = discovered.topic;
  if (topics_.name_in(topic, kJointCommands).empty() && topics_.name_in(topic, kJointTrajectory).empty() &&
      topics_.name_in(topic, kCommand).empty())
    return;
  std::optional<DiagnosticEvent> event;
  {
    const std::lock_guard lock(mutex_);
    Writer& writer = writers_[discovered.guid] = {
        topic, discovered.type, discovered.strength, discovered.lease_s, false, false};
    if (heard_ != nullptr) watch(discovered.guid, writer);
    if (loop_ != nullptr) event = diagnose_unmatched_writer(discovered.guid, writer, loop_->cell());
  }
  if (event) events_.post(std::move(*event));
}

std::optional<DiagnosticEvent> CommandSubscriber::diagnose_unmatched_writer(
    const DdsGuid& guid, Writer& writer, const CellDescription& cell) const {
  const std::string& topic = writer.topic;
  std::string robot = topics_.name_in(topic, kJointCommands);
  Kind kind = Kind::joints;
  if (robot.empty()) {
    robot = topics_.name_in(topic, kJointTrajectory);
    kind = Kind::trajectory;
  }
  const std::string other = topics_.name_in(topic, kCommand);
  const auto event = [&](const char* code, const std::string& name, const std::string& sentence) {
    return DiagnosticEvent{Severity::warning, code, name, text_of(guid), sentence};
  };
  const std::string nobody = "Nobody listens to the topic " + topic + ": ";
  // Validation knows best what is there and how to say what is not.
  if (!robot.empty() && cell.find_robot(robot) < 0) {
    const auto verdict = validate(cell, RawJointCommand{robot, -1.0, {}, {}, {}, {}});
    return event("unknown_robot", robot, nobody + std::get<Rejection>(verdict).message + ".");
  }
  if (!other.empty()) {
    kind = cell.find_gripper(other) < 0 ? Kind::device : Kind::gripper;
    if (kind == Kind::device && cell.find_device(other) < 0) {
      const bool for_device = writer.type == type_of(Kind::device);
      return event(for_device ? "unknown_device" : "unknown_gripper", other,
                   nobody + "there is no gripper or device '" + other + "' in this cell; grippers: " +
                       list_names(cell.grippers) + "; devices: " + list_names(cell.devices) + ".");
    }
  }
  if (writer.type_told || writer.type == type_of(kind)) return std::nullopt;
  writer.type_told = true;
  const std::string& name = other.empty() ? robot : other;
  return event("wrong_type", name,
               "Nothing that this sender writes for " + name + " is heard: its type is " +
                   ros_name(writer.type) + ", but the topic " + topic + " takes " + ros_name(type_of(kind)) +
                   ".");
}

void CommandSubscriber::writer_removed(const DdsGuid& guid) {
  const std::lock_guard lock(mutex_);
  writers_.erase(guid);
  gone_.erase(guid);
  const auto same = [&](const auto& other) { return other.first.guidPrefix == guid.guidPrefix; };
  if (heard_ != nullptr && std::none_of(writers_.begin(), writers_.end(), same))
    heard_->forget(prefix_of(guid));
}

void CommandSubscriber::expire_liveliness_leases() {
  if (heard_ == nullptr) return;
  std::vector<DiagnosticEvent> news;
  std::set<int> freed;  // targets whose exclusive readers still listen to the silent one alone
  {
    const std::lock_guard lock(mutex_);
    if (loop_ == nullptr) return;
    for (auto& [guid, writer] : writers_) {
      if (!std::isfinite(writer.lease_s)) continue;
      const double time_since_last_packet_s = heard_->time_since_last_packet_s(prefix_of(guid));
      if (writer.silent) {
        if (time_since_last_packet_s < writer.lease_s)
          writer.silent = false;  // it takes part again with its next command
        continue;
      }
      if (time_since_last_packet_s < writer.lease_s) continue;
      writer.silent = true;
      const int target = target_of_topic(writer.topic);
      if (target < 0) continue;
      CommandArbiter& arbiter = arbiters_[static_cast<std::size_t>(target)];
      const std::uint64_t sender = senders_.id(guid);
      if (arbiter.owns(sender)) silent_owners_[target] = guid;
      arbiter.vanished(sender);
    }
    revoke_expired_ownership(freed, news);
  }
  if (!freed.empty()) renew_readers(freed);
  for (DiagnosticEvent& event : news) events_.post(std::move(event));
}

// Of an owner that is silent its target is freed when somebody else is there who may have it, now or later:
// one that is alone and comes back, or is forgotten by DDS, goes on as ever.
void CommandSubscriber::revoke_expired_ownership(std::set<int>& freed, std::vector<DiagnosticEvent>& news) {
  std::erase_if(silent_owners_, [&](const auto& owner) {
    const int target = owner.first;
    const auto& guid = owner.second;
    const auto found = writers_.find(guid);
    if (found == writers_.end() || !found->second.silent) return true;
    const bool wanted = std::any_of(writers_.begin(), writers_.end(), [&](const auto& other) {
      return !other.second.silent && other.first.guidPrefix != guid.guidPrefix &&
             target_of_topic(other.second.topic) == target;
    });
    if (!wanted) return false;
    freed.insert(target);
    const std::string name(target_name(loop_->cell(), target));
    char silence[32];
    std::snprintf(silence, sizeof(silence), "%.1f s", heard_->time_since_last_packet_s(prefix_of(guid)));
    news.push_back({Severity::warning, "owner_silent", name, text_of(guid),
                    "Nothing was heard of this sender of commands for " + name + " for " + silence +
                        "; another one may command it now."});
    return true;
  });
}

// In DDS an exclusive reader keeps to its strongest sender for as long as that one's participant is
// remembered. A new reader has none until the first command comes in, and that is not from one who is silent.
void CommandSubscriber::renew_readers(const std::set<int>& targets) {
  const std::lock_guard making(readers_mutex_);
  for (Listening& listening : readers_) {
    if (!listening.exclusive || !targets.contains(listening.target)) continue;
    participant_->remove(listening.reader);
    listening.reader = nullptr;
    try {
      listening.reader = make_reader(
          topics_.of(target_name(loop_->cell(), listening.target), topic_of(listening.kind)), listening);
    } catch (const DdsError& error) {
      events_.post({Severity::error, "no_reader", std::string(target_name(loop_->cell(), listening.target)),
                    "", error.what()});
    }
  }
}

int CommandSubscriber::target_of_topic(const std::string& topic) const {
  for (const std::string_view last : {kJointCommands, kJointTrajectory, kCommand}) {
    const std::string name = topics_.name_in(topic, last);
    if (!name.empty()) return find_target(loop_->cell(), name);
  }
  return -1;
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
  if (writer != writers_.end()) {
    if (writer->second.silent) return std::nullopt;
    sender.strength = writer->second.strength;
    sender.topic = topics_.name_in(writer->second.topic, kJointTrajectory).empty() ? 0 : 1;
  }
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
    const auto writer = writers_.find(guid);
    if (writer != writers_.end()) writer->second.silent = false;  // here it is
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
