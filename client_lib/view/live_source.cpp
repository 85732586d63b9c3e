#include "client_lib/view/live_source.h"

#include <chrono>
#include <cstdio>

#include "client_lib/recording/message_types.h"
#include "takt_topics.h"

namespace takt::view {
namespace {

/// These topics are received all the time, so that every viewer gets them at once. All other topics are received
/// while a viewer subscribes to them.
bool always_open(const client::RawTopic& topic) {
  for (const TopicInfo* open :
       {static_cast<const TopicInfo*>(&topics::description), static_cast<const TopicInfo*>(&topics::status),
        static_cast<const TopicInfo*>(&topics::event), static_cast<const TopicInfo*>(&topics::program),
        static_cast<const TopicInfo*>(&topics::program_steps)})
    if (topic.type == open->type->name) return true;
  return false;
}

std::uint64_t wall_ns() {
  return static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::nanoseconds>(
                                        std::chrono::system_clock::now().time_since_epoch())
                                        .count());
}

}  // namespace

LiveSource::LiveSource(const ClientOptions& options, Stream& stream)
    : options_(options), stream_(stream), pendant_(options) {
  stream_.on_wanted(this, [this](const Channel& channel, bool wanted) {
    const std::lock_guard lock(mutex_);
    want(channel.topic, wanted);
  });
  topics_ = std::make_unique<client::RawTopics>(
      options, [this](const client::RawTopic& topic) { add(topic); },
      [this](const client::RawTopic& topic, std::string_view sample) {
        std::uint32_t channel = 0;
        {
          const std::lock_guard lock(mutex_);
          const auto found = channels_.find(topic.name);
          if (found == channels_.end()) return;
          channel = found->second;
        }
        stream_.push(channel, wall_ns(), sample);
      });
  thread_ = std::thread([this] { run(); });
}

LiveSource::~LiveSource() {
  stream_.forget(this);
  {
    const std::lock_guard lock(mutex_);
    over_ = true;
    changed_.notify_all();
  }
  thread_.join();
  topics_.reset();
}

void LiveSource::add(const client::RawTopic& topic) {
  const auto& types = recording::known_types();
  if (types.find(topic.type) == nullptr) return;
  Channel channel;
  channel.topic = topic.name;
  channel.encoding = "cdr";
  channel.type = topic.type;
  channel.schema_encoding = "ros2msg";
  channel.schema = types.ros2msg(topic.type);
  channel.each_counts = topic.type == topics::event.type->name;
  const std::lock_guard lock(mutex_);
  channels_[topic.name] = stream_.add_channel(std::move(channel));
  if (always_open(topic)) want(topic.name, true);
}

/// With the lock.
void LiveSource::want(const std::string& topic, bool wanted) {
  wanted_[topic].by += wanted ? 1 : -1;
  to_follow_.insert(topic);
  changed_.notify_all();
}

/// Opens and closes topics: that calls DDS, which may take its time.
void LiveSource::run() {
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [&] { return over_ || !to_follow_.empty(); });
    if (over_) return;
    const std::string topic = to_follow_.extract(to_follow_.begin()).value();
    const bool open = wanted_[topic].by > 0;
    if (open == wanted_[topic].open) continue;
    wanted_[topic].open = open;
    lock.unlock();
    try {
      if (open)
        topics_->open(topic,
                      topic == "/" + topics::event.name(options_.cell) ? qos_of(topics::event).depth : 1);
      else
        topics_->close(topic);
    } catch (const ClientError& error) {  // all other topics can be shown
      std::fprintf(stderr, "takt: note: '%s' cannot be shown: %s\n", topic.c_str(), error.what());
      lock.lock();
      wanted_[topic].open = false;  // the next subscription tries again
      continue;
    }
    lock.lock();
  }
}

void LiveSource::reach(std::unique_ptr<Client>& client) {
  constexpr Seconds patience{3.0};
  if (!client) {
    ClientOptions options = options_;
    options.while_waiting = [this] {
      if (ending_) throw ClientError(ClientError::Kind::timeout, "takt view ends; the server goes on.");
    };
    client = std::make_unique<Client>(options);
  }
  const auto begun = std::chrono::steady_clock::now();
  for (;;) {
    try {
      client->get_state();
      return;
    } catch (const ClientError& error) {
      const Seconds waited = std::chrono::steady_clock::now() - begun;
      if (error.kind() != ClientError::Kind::lost || waited >= patience ||
          !client->wait_for_connection(patience - waited))
        throw;
    }
  }
}

Answer LiveSource::request(const std::string& name, const Arguments& arguments) {
  // A scenario takes as long as its meshes need. A server that is silent or gone ends the wait.
  constexpr Seconds forever = Seconds::max();
  const bool by_host = is_for_host(name);
  std::unique_ptr<Client>& client = by_host ? to_host_ : usual_;
  try {
    if (!by_host)
      if (auto answer = pendant_.request(name, arguments)) return *std::move(answer);
    reach(client);
    Reply reply = client->request(name, arguments, by_host ? forever : options_.timeout);
    return {ControlResult::ok, std::move(reply.message), std::move(reply.values)};
  } catch (const ClientError& error) {
    if (error.kind() == ClientError::Kind::lost) client.reset();  // the next request connects again
    return {error.result().value_or(ControlResult::failed), error.what(), {}};
  }
}

}  // namespace takt::view
