#include "server/dds/control_service.h"

#include "server/dds/bounded_request.h"

#include <utility>

#include "server/dds/qos.h"
#include "takt_msgsPubSubTypes.h"

namespace takt {

void ControlService::listen(Participant& participant, const TopicNames& topics) {
  writer_ = participant.create_writer<takt_msgs::msg::ControlReplyPubSubType>(
      topics.of_cell("control/reply"), control_writer_qos(participant));
  participant.create_reader<BoundedControlRequest>(topics.of_cell("control/request"),
                                                   control_reader_qos(participant), this);
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
    const Key key(message.client_id().to_string(), message.sequence_number());
    const auto [place, is_new] = requests_.try_emplace(key);
    if (!is_new) {
      if (place->second.reply) asked_again_.push_back(*place->second.reply);
      host_.mail().news.post();
      return;
    }
    request.id = ++newest_id_;
    place->second.id = request.id;
    keys_[request.id] = key;
    order_.push_back(key);
    if (order_.size() > kRemembered) {
      const auto oldest = requests_.find(order_.front());
      keys_.erase(oldest->second.id);
      requests_.erase(oldest);
      order_.pop_front();
    }
  }
  request.request = message.request().to_string();
  for (const auto& argument : message.arguments()) {
    request.arguments.emplace_back(argument.name().to_string(), argument.value().to_string());
  }
  host_.submit(request);
}

void ControlService::write_replies(std::span<const ControlReply> replies) {
  std::vector<takt_msgs::msg::ControlReply> messages;
  {
    const std::lock_guard lock(mutex_);
    messages.swap(asked_again_);
    for (const ControlReply& reply : replies) {
      const auto key = keys_.find(reply.id);
      if (key == keys_.end()) continue;  // of a service, or forgotten: a thousand requests ago
      takt_msgs::msg::ControlReply message;
      message.client_id(key->second.first);
      message.sequence_number(key->second.second);
      message.result(static_cast<std::int32_t>(reply.result));
      message.message(reply.message);
      for (const auto& [name, value] : reply.values) {
        takt_msgs::msg::Argument argument;
        argument.name(name);
        argument.value(value);
        message.values().push_back(argument);
      }
      requests_[key->second].reply = message;
      messages.push_back(message);
    }
  }
  for (auto& message : messages) {
    // A reply that DDS refuses now is sent again when the client asks again.
    (void)written(*writer_, message);
  }
}

}  // namespace takt
