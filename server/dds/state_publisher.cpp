#include "server/dds/state_publisher.h"

#include <utility>

#include "idl/common/stamp.h"
#include "idl/common/utf8.h"
#include "idl/transport/rtps_guard/packet_cork.h"
#include "server/messages/description_message.h"
#include "server/messages/status_messages.h"
#include "server/runtime/monotonic_clock.h"
#include "takt_topics.h"

namespace takt {
namespace {

constexpr std::int64_t kIdleStatus_ns = 100'000'000;
constexpr std::int64_t kAnnounced_ns = 15'000'000'000;
// Of the type of an event (idl/takt_msgs.idl).
std::string fitting(std::string_view text, const FieldInfo& field) {
  return utf8_sanitize(text, field.string_bound);
}

}  // namespace

StatePublisher::StatePublisher(CellHost& host, Participant& participant, const TopicNames& topics,
                               const SenderRegistry& senders, const CommandSubscriber& commands,
                               ControlService& control, RosServices& services, ActionServers& actions)
    : host_(host),
      participant_(participant),
      topics_(topics),
      senders_(senders),
      commands_(commands),
      control_(control),
      services_(services),
      actions_(actions),
      event_readers_([this](int change) {
        host_.outbound().instant_readers.change(change);  // an event has the instant of the newest state
        host_.outbound().news.post();
      }) {
  namespace msg = takt_msgs::msg;
  empty_cell_.cell = host.cell();
  empty_cell_.scenario_generation = 0;
  host.outbound().instant_readers.begin_to_count();
  event_writer_ = participant.create_writer(topics::event, topics.of(topics::event), &event_readers_);
  status_writer_ = participant.create_writer(topics::status, topics.of(topics::status));
  description_writer_ = participant.create_writer(topics::description, topics.of(topics::description));
}

void StatePublisher::open(RunLoop& loop) {
  auto made = std::make_unique<CellPublisher>(loop, participant_, topics_);
  describe(loop.cell());
  {
    const std::lock_guard lock(mutex_);
    publisher_ = std::move(made);
  }
  loop.output().instant_writer.set(this);
}

void StatePublisher::close() {
  detach();
  std::unique_ptr<CellPublisher> closed;
  {
    const std::lock_guard lock(mutex_);
    if (!publisher_) return;
    write_news(false);
    publisher_->finish();
    closed = std::move(publisher_);
    empty_cell_.scenario.clear();
    empty_cell_.scenario_generation = closed->cell().scenario_generation;
    idle_status_ns_ = 0;
  }
}

void StatePublisher::describe(const CellDescription& cell) {
  takt_msgs::msg::CellDescription description = to_message(cell, TAKT_VERSION);
  if (!written(*description_writer_, description)) {
    throw DdsError("DDS refused to send the description of the cell (" +
                   std::to_string(cdr::size(description)) + " bytes).");
  }
  const std::lock_guard lock(mutex_);
  if (cell.scenario.empty()) empty_cell_ = cell;
}

void StatePublisher::write() {
  std::uint64_t step = 0;
  {
    const std::lock_guard lock(mutex_);
    write_news(true);
    const PacketCork cork;
    if (publisher_) {
      publisher_->repeat_if_due();
      step = publisher_->present_step();
    } else {
      write_idle_status();
    }
  }
  services_.submit_following();
  actions_.write(step);
}

std::int64_t StatePublisher::longest_sleep_ns() {
  constexpr std::int64_t kReply_ns = 2'000'000;  // until a caller's reader is synchronised
  if (services_.replies_wait() || actions_.replies_wait()) return kReply_ns;
  constexpr std::int64_t kOften_ns = 20'000'000;  // so that standing instants and frames are repeated
  return host_.outbound().instant_readers.any() ? kOften_ns : kIdleStatus_ns;
}

void StatePublisher::finish() {
  detach();
  {
    const std::lock_guard lock(mutex_);
    write_news(true);
    if (publisher_) publisher_->finish();
  }
  // A client that waits for a reply or an event should receive it before the server exits.
  control_.finish();
  wait_for_acknowledgments(*event_writer_);
}

void StatePublisher::write_instant() {
  const std::lock_guard lock(mutex_);
  const PacketCork cork;
  write_events();
  write_newest();
}

void StatePublisher::detach() {
  RunLoop* loop = nullptr;
  {
    const std::lock_guard lock(mutex_);
    if (publisher_) loop = &publisher_->loop();
  }
  if (loop != nullptr) loop->output().instant_writer.set(nullptr);
}

void StatePublisher::write_newest() {
  if (!publisher_) return;
  if (const Snapshot* snapshot = publisher_->loop().output().snapshots.take()) {
    const std::int64_t began = monotonic_now_ns();
    publisher_->write(*snapshot);
    write_time_.record_ns(monotonic_now_ns() - began);
  }
}

void StatePublisher::write_news(bool with_status) {
  {
    const PacketCork cork;
    write_events();
    write_newest();
  }
  const PacketCork cork;  // the instant does not wait for these
  if (publisher_ && with_status) {
    if (const LoopStatus* status = publisher_->loop().output().status.take())
      write_status(*status, publisher_->cell());
  }
  const std::vector<ControlReply> replies = host_.outbound().take_replies();
  control_.write_replies(replies);
  const Snapshot* newest = publisher_ ? publisher_->newest() : nullptr;
  const ros::Instant now = newest != nullptr ? ros::Instant{&publisher_->cell(), newest} : ros::Instant{};
  services_.write_replies(replies, publisher_ && newest == nullptr ? nullptr : &now);
  actions_.take_replies(replies);
}

void StatePublisher::write_status(const LoopStatus& status, const CellDescription& cell) {
  takt_msgs::msg::Status message = to_message(status, cell);
  message.commands_rejected += commands_.rejected();
  message.owners = commands_.owners();
  static_assert(field_info<takt_msgs::msg::Status>("gateways").bound == Gateways::kMost);
  const auto gateways = host_.gateways();
  message.gateways.assign(gateways.begin(), gateways.end());
  check(status_writer_->write(&message, dds::HANDLE_NIL));
}

void StatePublisher::write_idle_status() {
  const auto status = host_.idle_status();
  const std::int64_t now = monotonic_now_ns();
  if (!status || (now - idle_status_ns_ < kIdleStatus_ns && status->state == idle_state_)) return;
  idle_status_ns_ = now;
  idle_state_ = status->state;
  write_status(*status, empty_cell_);
}

void StatePublisher::write_events() {
  write_announcement();
  EventRecord record;
  while (publisher_ && publisher_->loop().output().events.pop(record)) {
    takt_msgs::msg::Event message = to_message(record, publisher_->cell());
    message.sender = senders_.text(record.sender);
    write_event(message);
  }
  const EventQueue::Taken taken = host_.outbound().events.take();
  for (const DiagnosticEvent& event : taken.events) write_event(event);
  if (taken.lost > 0) write_event(diagnostic(events::EventsLost{taken.lost}, host_.cell()));
  if (publisher_) refused_writes_ += publisher_->take_refused();
  if (refused_writes_ > 0)
    write_event(diagnostic(events::WriteRefused{std::exchange(refused_writes_, 0)}, host_.cell()));
}

/// Late readers get no old events, and after a restart all readers are late.
void StatePublisher::write_announcement() {
  const OutboundQueue& outbound = host_.outbound();
  if (!host_.announces() || monotonic_now_ns() - outbound.began_ns > kAnnounced_ns) return;
  const int readers = event_readers_.arrivals();
  if (readers == std::exchange(announced_to_, readers)) return;
  write_event(*outbound.announcement);
}

void StatePublisher::write_event(const DiagnosticEvent& event) {
  takt_msgs::msg::Event message;
  message.stamp = to_time(publisher_ ? publisher_->present_time_s() : 0.0);
  message.step = publisher_ ? publisher_->present_step() : 0;
  message.epoch = publisher_ ? publisher_->present_epoch() : 0;
  message.severity = event.severity;
  message.code = fitting(event.code, field_info<takt_msgs::msg::Event>("code"));
  message.subject = fitting(event.subject, field_info<takt_msgs::msg::Event>("subject"));
  message.sender = fitting(event.sender, field_info<takt_msgs::msg::Event>("sender"));
  message.message = fitting(event.message, field_info<takt_msgs::msg::Event>("message"));
  write_event(message);
}

void StatePublisher::write_event(takt_msgs::msg::Event& event) {
  event.sequence_number = ++event_number_;
  check(event_writer_->write(&event, dds::HANDLE_NIL));
}

void StatePublisher::check(const DdsReturnCode& result) {
  if (!is_ok(result)) ++refused_writes_;
}

}  // namespace takt
