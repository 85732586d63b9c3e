#include "server/dds/state_publisher.h"

#include "ros2_msgsPubSubTypes.h"
#include "server/dds/convert.h"
#include "server/dds/qos.h"
#include "server/runtime/monotonic_clock.h"
#include "takt_msgsPubSubTypes.h"

namespace takt {
namespace {

// While the simulation stands, its instant is repeated: the state is sent best effort, and who has lost it or
// has only just come would get none. Often at first, for the controller that lockstep waits for.
constexpr std::int64_t kRepeat_ns = 20'000'000;
constexpr std::int64_t kRepeatLater_ns = 100'000'000;
constexpr std::int64_t kLater_ns = 2'000'000'000;

bool somebody_reads(dds::DataWriter* writer) {
  dds::PublicationMatchedStatus status;
  return is_ok(writer->get_publication_matched_status(status)) && status.current_count > 0;
}

}  // namespace

StatePublisher::StatePublisher(RunLoop& loop, Participant& participant, const TopicNames& topics,
                               AdapterEvents& events, const Senders& senders,
                               const CommandSubscriber& commands, ControlService& control)
    : loop_(loop),
      guard_(participant.guard()),
      events_(events),
      senders_(senders),
      commands_(commands),
      control_(control),
      state_message_(make_state_message(loop.cell())),
      power_message_(make_power_message(loop.cell())),
      contacts_message_(make_contacts_message(loop.contact_room())) {
  const CellDescription& cell = loop.cell();
  namespace msg = takt_msgs::msg;
  event_writer_ = participant.create_writer<msg::EventPubSubType>(topics.of_cell("events"),
                                                                  event_writer_qos(participant));
  status_writer_ = participant.create_writer<msg::StatusPubSubType>(topics.of_cell("status"),
                                                                    latched_writer_qos(participant, false));
  const std::size_t state_bytes = msg::CellState::getCdrSerializedSize(state_message_);
  state_writer_ = participant.create_writer<msg::CellStatePubSubType>(
      topics.of_cell("state"), state_writer_qos(participant, state_bytes));
  power_writer_ = participant.create_writer<msg::PowerPubSubType>(topics.of_cell("power"),
                                                                  state_writer_qos(participant, 0));
  const std::size_t contacts_bytes = msg::Contacts::getCdrSerializedSize(contacts_message_);
  contacts_writer_ = participant.create_writer<msg::ContactsPubSubType>(
      topics.of_cell("contacts"), state_writer_qos(participant, contacts_bytes));
  clock_writer_ = participant.create_writer<rosgraph_msgs::msg::ClockPubSubType>(
      TopicNames::clock(), ros_writer_qos(participant, 1));
  for (const RobotDescription& robot : cell.robots) {
    joint_writers_.push_back(participant.create_writer<sensor_msgs::msg::JointStatePubSubType>(
        topics.of(robot.name, "joint_states"), ros_writer_qos(participant, 10)));
    joint_messages_.push_back(make_joint_states_message(robot));
    auto* writer = participant.create_writer<std_msgs::msg::StringPubSubType>(
        topics.of(robot.name, "robot_description"), latched_writer_qos(participant, true));
    std_msgs::msg::String urdf;
    urdf.data(robot.urdf);
    if (!writer->write(&urdf)) throw DdsError("DDS refused to send the URDF of '" + robot.name + "'.");
  }
  auto* description_writer = participant.create_writer<msg::CellDescriptionPubSubType>(
      topics.of_cell("description"), latched_writer_qos(participant, true));
  msg::CellDescription description = to_message(cell, TAKT_VERSION);
  if (!description_writer->write(&description)) {
    throw DdsError("DDS refused to send the description of the cell (" +
                   std::to_string(msg::CellDescription::getCdrSerializedSize(description)) + " bytes).");
  }
  loop_.outbox().writer_attached.store(true);
}

StatePublisher::~StatePublisher() {
  stop();
}

void StatePublisher::start() {
  thread_ = std::thread([this] { run(); });
}

void StatePublisher::stop() {
  stop_.store(true);
  loop_.outbox().news.post();
  if (thread_.joinable()) thread_.join();
  loop_.outbox().writer_attached.store(false);
}

void StatePublisher::run() {
  while (!stop_.load(std::memory_order_relaxed)) {
    loop_.outbox().news.wait_until_ns(monotonic_now_ns() + kRepeat_ns);
    write_news();
    repeat_instant_if_due();
    guard_watch_.look(guard_, monotonic_now_ns(), loop_.cell().cell, events_);
  }
  write_news();
  // A client that waits for a reply or an event should have it before the server is gone.
  (void)event_writer_->wait_for_acknowledgments(DdsDuration(0, 200'000'000));
}

void StatePublisher::write_news() {
  Outbox& outbox = loop_.outbox();
  write_events();
  if (const auto* published = outbox.snapshots.take()) {
    write_instant(*published);
    loop_.snapshot_written(published->number);
  }
  if (const auto* status = outbox.status.take()) {
    takt_msgs::msg::Status message = to_message(*status, loop_.cell());
    message.commands_rejected(message.commands_rejected() + commands_.rejected());
    check(status_writer_->write(&message, dds::HANDLE_NIL));
  }
  control_.write_replies();
}

void StatePublisher::write_instant(const PublishedSnapshot& published) {
  const std::int64_t began = monotonic_now_ns();
  const Snapshot& snapshot = published.snapshot;
  fill(state_message_, loop_.cell(), snapshot);
  check(state_writer_->write(&state_message_, dds::HANDLE_NIL));
  power_known_ = fill(power_message_, loop_.cell(), snapshot) || power_known_;
  if (power_known_) check(power_writer_->write(&power_message_, dds::HANDLE_NIL));
  contacts_known_ = fill(contacts_message_, snapshot) || contacts_known_;
  if (contacts_known_) check(contacts_writer_->write(&contacts_message_, dds::HANDLE_NIL));
  for (std::size_t robot = 0; robot < joint_writers_.size(); ++robot) {
    if (!somebody_reads(joint_writers_[robot])) continue;
    fill(joint_messages_[robot], snapshot, robot);
    check(joint_writers_[robot]->write(&joint_messages_[robot], dds::HANDLE_NIL));
  }
  if (somebody_reads(clock_writer_)) {
    clock_message_.clock(to_time(snapshot.time_s));
    check(clock_writer_->write(&clock_message_, dds::HANDLE_NIL));
  }
  present_time_s_ = snapshot.time_s;
  present_step_ = snapshot.step;
  present_epoch_ = snapshot.epoch;
  instant_written_ = true;
  instant_new_ns_ = instant_written_ns_ = monotonic_now_ns();
  write_time_.record_ns(instant_written_ns_ - began);
}

void StatePublisher::repeat_instant_if_due() {
  if (!instant_written_ || !loop_.outbox().standing_at_boundary.load(std::memory_order_relaxed)) return;
  const std::int64_t now = monotonic_now_ns();
  const std::int64_t interval = now - instant_new_ns_ < kLater_ns ? kRepeat_ns : kRepeatLater_ns;
  if (now - instant_written_ns_ < interval) return;
  check(state_writer_->write(&state_message_, dds::HANDLE_NIL));
  if (power_known_) check(power_writer_->write(&power_message_, dds::HANDLE_NIL));
  if (contacts_known_) check(contacts_writer_->write(&contacts_message_, dds::HANDLE_NIL));
  instant_written_ns_ = now;
}

void StatePublisher::write_events() {
  EventRecord record;
  while (loop_.outbox().events.pop(record)) {
    takt_msgs::msg::Event message = to_message(record, loop_.cell());
    message.sender(senders_.text(record.sender));
    write_event(message);
  }
  const AdapterEvents::Taken taken = events_.take();
  const auto write_own = [&](const AdapterEvent& event) {
    takt_msgs::msg::Event message;
    message.stamp(to_time(present_time_s_));
    message.step(present_step_);
    message.epoch(present_epoch_);
    message.severity(static_cast<std::uint8_t>(event.severity));
    message.code(event.code);
    message.subject(event.subject);
    message.sender(event.sender);
    message.message(event.message);
    write_event(message);
  };
  for (const AdapterEvent& event : taken.events) write_own(event);
  if (taken.lost > 0) {
    write_own({Severity::warning, std::string(to_string(EventCode::events_lost)), loop_.cell().cell, "",
               std::to_string(taken.lost) + " events were lost: more came than could be sent."});
  }
  if (refused_writes_ > 0) {
    const std::uint64_t refused = std::exchange(refused_writes_, 0);
    write_own({Severity::warning, "write_refused", loop_.cell().cell, "",
               "DDS refused to send " + std::to_string(refused) + " samples."});
  }
}

void StatePublisher::write_event(takt_msgs::msg::Event& event) {
  event.sequence_number(++event_number_);
  check(event_writer_->write(&event, dds::HANDLE_NIL));
}

void StatePublisher::check(const DdsReturnCode& result) {
  if (!is_ok(result)) ++refused_writes_;
}

}  // namespace takt
