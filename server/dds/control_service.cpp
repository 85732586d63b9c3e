#include "server/dds/control_service.h"

#include <functional>
#include <string>
#include <utility>

#include "idl/common/utf8.h"
#include "server/runtime/requests/request_text.h"
#include "takt_topics.h"

namespace takt {
namespace {

constexpr std::size_t kMaxOfMessage = field_info<takt_msgs::msg::ControlReply>("message").string_bound;

std::size_t bytes_of(const ControlReply& reply) {
  std::size_t bytes = sizeof(reply) + reply.message.size();
  for (const auto& argument : reply.values) bytes += cdr::size(argument);
  return bytes;
}

/// Hash of the request's content: equal for a repetition.
std::size_t content_of(takt_msgs::msg::ControlRequest message) {
  message.client_id.clear();
  message.sequence_number = 0;
  std::string bytes;
  cdr::write(message, bytes);
  return std::hash<std::string>{}(bytes);
}

}  // namespace

void ControlService::listen(Participant& participant, const TopicNames& names) {
  writer_ = participant.create_writer(topics::control_reply, names.of(topics::control_reply));
  participant.create_reader<takt_msgs::msg::ControlRequest>(
      names.of(topics::control_request),
      service_reader_qos(participant.default_reader_qos(), qos_of(topics::control_request)), this);
}

void ControlService::on_data_available(dds::DataReader* reader) {
  takt_msgs::msg::ControlRequest message;
  dds::SampleInfo info;
  while (is_ok(reader->take_next_sample(&message, &info))) {
    if (info.valid_data) received(message);
  }
}

void ControlService::received(const takt_msgs::msg::ControlRequest& message) {
  ControlRequest request;
  {
    const std::lock_guard lock(mutex_);
    const Key key(message.client_id, message.sequence_number);
    const auto refuse = [&](const char* why) {
      if (asked_again_.size() < kRemembered)
        asked_again_.push_back({{utf8_sanitize(key.first), key.second}, {0, ControlResult::failed, why}});
      host_.outbound().news.post();
    };
    if (!validate_utf8(key.first))
      return refuse("The client_id is no text; it must be UTF-8 without control characters.");
    if (key.first.empty())
      return refuse("The request has no client_id; each run of a client needs one of its own.");
    const std::size_t content = content_of(message);
    const auto [place, is_new] = requests_.try_emplace(key);
    if (!is_new) {
      if (place->second.content != content)
        return refuse(
            "Another request came with this client_id and sequence_number; each request needs a number of "
            "its "
            "own, and each run of a client an id of its own.");
      if (place->second.reply) asked_again_.push_back({key, *place->second.reply});
      host_.outbound().news.post();
      return;
    }
    place->second.content = content;
    request.id = ++newest_id_;
    place->second.id = request.id;
    keys_[request.id] = key;
    order_.push_back(key);
    forget_old();
  }
  request.request = message.request;
  request.arguments = message.arguments;
  if (std::string fault = find_text_fault(request); !fault.empty())
    return host_.outbound().add_reply({request.id, ControlResult::failed, std::move(fault)});
  host_.submit(request);
}

void ControlService::forget_old() {
  while (order_.size() > 1 && (order_.size() > kRemembered || reply_bytes_ > kMaxReplyBytes)) {
    const auto oldest = requests_.find(order_.front());
    if (oldest->second.reply) reply_bytes_ -= bytes_of(*oldest->second.reply);
    keys_.erase(oldest->second.id);
    requests_.erase(oldest);
    order_.pop_front();
  }
}

void ControlService::finish() {
  wait_for_acknowledgments(*writer_);
}

void ControlService::write_replies(std::span<const ControlReply> replies) {
  std::vector<Answer> answers;
  {
    const std::lock_guard lock(mutex_);
    answers.swap(asked_again_);
    for (const ControlReply& reply : replies) {
      const auto key = keys_.find(reply.id);
      if (key == keys_.end()) continue;  // of a service, or forgotten: a thousand requests ago
      answers.push_back({key->second, reply});
      auto& answered = requests_[key->second].reply;
      if (answered) reply_bytes_ -= bytes_of(*answered);
      answered = reply;
      reply_bytes_ += bytes_of(reply);
    }
    forget_old();
  }
  takt_msgs::msg::ControlReply message;
  for (const auto& [key, answer] : answers) {
    ControlReply reply = sanitize(answer, kMaxOfMessage);
    message.client_id = key.first;
    message.sequence_number = key.second;
    message.result = static_cast<std::int32_t>(reply.result);
    message.message = std::move(reply.message);
    message.values = std::move(reply.values);
    if (cdr::size(message) > cdr::max_bytes<takt_msgs::msg::ControlReply>()) {
      message.result = static_cast<std::int32_t>(ControlResult::failed);
      message.message = "The answer does not fit into one reply; ask for less.";
      message.values.clear();
    }
    // A reply that DDS refuses is sent again when the client repeats the request.
    (void)written(*writer_, message);
  }
}

}  // namespace takt
