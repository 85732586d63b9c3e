#include "client_lib/view/file_source.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "idl/common/cdr.h"
#include "idl/common/text.h"
#include "takt_topics.h"

namespace takt::view {

using recording::McapMessage;
using Clock = std::chrono::steady_clock;

namespace {

/// Before a place that was sought, how far back what was newest then is looked for.
constexpr std::uint64_t kWindow_ns = 2'000'000'000;
constexpr std::uint64_t kTell_ns = 50'000'000;
constexpr double kLongestWait_s =
    1e8;  ///< a rate may be as small as it likes, a time on the clock not as late

bool is_event(const recording::McapChannel& channel) {
  return channel.type == topics::event.type->name;
}
bool is_latched(const recording::McapChannel& channel) {
  return channel.type == topics::description.type->name ||
         channel.type == topics::robot_description.type->name ||
         channel.topic == "/" + topics::tf_static.name({});
}

}  // namespace

FileSource::FileSource(const std::filesystem::path& file, Stream& stream) : stream_(stream), reader_(file) {
  for (const auto& [id, channel] : reader_.channels())
    channels_[id] = stream_.add_channel({0, channel.topic, channel.encoding, channel.type,
                                         channel.schema_encoding, channel.schema, is_event(channel)});
  const MessageInfo& playback = message_info<takt_player::msg::Playback>();
  recording::MessageTypes types;
  types.add(playback);
  const std::string type(playback.name);
  playback_channel_ = stream_.add_channel({0, std::string(annotation(playback.annotations, "channel")), "cdr",
                                           type, "ros2msg", types.ros2msg(type), false});
  look_through();
  publish_events();
  position_ns_ = reader_.first_ns();
  thread_ = std::thread([this] { run(); });
}

FileSource::~FileSource() {
  {
    const std::lock_guard lock(mutex_);
    over_ = true;
    ++changes_;
    changed_.notify_all();
  }
  thread_.join();
}

void FileSource::look_through() {
  bool any = false;
  for (const auto& [id, channel] : reader_.channels()) any = any || is_event(channel) || is_latched(channel);
  if (!any) return;
  reader_.read([&](const McapMessage& message) {
    if (is_event(*message.channel) || is_latched(*message.channel))
      kept_[message.channel->number].push_back({message.log_time_ns, std::string(message.sample)});
    return true;
  });
}

/// The whole recording's events, for a timeline: on the cell's own channel they come as the playback reaches them.
void FileSource::publish_events() {
  for (const auto& [id, samples] : kept_) {
    const auto& channel = reader_.channels().at(id);
    if (!is_event(channel)) continue;
    const std::uint32_t all = stream_.add_channel({0, "/takt/recorded_events", channel.encoding, channel.type,
                                                   channel.schema_encoding, channel.schema, true});
    for (const Kept& sample : samples) stream_.push(all, sample.time_ns, sample.sample);
  }
}

/// Shows the newest sample of each channel at that position.
void FileSource::show_instant(std::uint64_t position_ns) {
  for (const auto& [id, samples] : kept_) {
    const auto& channel = reader_.channels().at(id);
    if (is_event(channel)) stream_.clear(channels_.at(id));
    const Kept* newest = nullptr;
    for (const Kept& sample : samples) {
      if (sample.time_ns > position_ns) break;
      newest = &sample;
      if (is_event(channel)) stream_.push(channels_.at(id), sample.time_ns, sample.sample);
    }
    if (newest != nullptr && !is_event(channel))
      stream_.push(channels_.at(id), newest->time_ns, newest->sample);
  }
  std::map<std::uint16_t, Kept> newest;
  const std::uint64_t from = position_ns > kWindow_ns ? position_ns - kWindow_ns : 0;
  reader_.read(
      [&](const McapMessage& message) {
        if (!kept_.contains(message.channel->number))
          newest[message.channel->number] = {message.log_time_ns, std::string(message.sample)};
        return true;
      },
      from, position_ns);
  for (const auto& [id, sample] : newest) stream_.push(channels_.at(id), sample.time_ns, sample.sample);
}

void FileSource::publish_position() {
  const double position_s = 1e-9 * static_cast<double>(position_ns_ - reader_.first_ns());
  std::string sample;
  cdr::write(takt_player::msg::Playback{position_s, duration_s(), playing_, rate_, problem_}, sample);
  stream_.push(playback_channel_, position_ns_, sample);
}

void FileSource::run() {
  std::unique_lock lock(mutex_);
  for (;;) {
    const std::uint64_t seen = changes_;
    try {
      show(lock, seen);
    } catch (const std::exception& error) {  // the file was changed under our hands, e.g. by a full disk
      if (!lock.owns_lock()) lock.lock();
      problem_ = error.what();
      playing_ = false;
      publish_position();
    }
    changed_.wait(lock, [&] { return over_ || changes_ != seen; });
    if (over_) return;
  }
}

/// Executes the latest request until the next one comes: `seen` is the number of the latest change.
void FileSource::show(std::unique_lock<std::mutex>& lock, std::uint64_t seen) {
  problem_.clear();
  if (sought_) {
    sought_ = false;
    const std::uint64_t position_ns = position_ns_;
    lock.unlock();
    show_instant(position_ns);
    lock.lock();
    if (changes_ != seen) return;
  }
  publish_position();
  if (playing_ && position_ns_ < reader_.last_ns()) play_on(lock);
  if (position_ns_ >= reader_.last_ns() && seen == changes_) {
    playing_ = false;
    publish_position();
  }
}

/// Plays from the present position to the end, or until the next request.
void FileSource::play_on(std::unique_lock<std::mutex>& lock) {
  const std::uint64_t seen = changes_, begin_ns = position_ns_;
  const double rate = rate_;
  const auto begin = Clock::now();
  std::uint64_t told_ns = begin_ns;
  lock.unlock();
  reader_.read(
      [&](const McapMessage& message) {
        const double wait_s = 1e-9 * static_cast<double>(message.log_time_ns - begin_ns) / rate;
        const auto due = begin + std::chrono::duration_cast<Clock::duration>(
                                     std::chrono::duration<double>(std::min(wait_s, kLongestWait_s)));
        std::unique_lock waiting(mutex_);
        if (changed_.wait_until(waiting, due, [&] { return changes_ != seen; })) return false;
        stream_.push(channels_.at(message.channel->number), message.log_time_ns, message.sample);
        position_ns_ = message.log_time_ns;
        if (position_ns_ - told_ns >= kTell_ns) {
          told_ns = position_ns_;
          publish_position();
        }
        return true;
      },
      begin_ns + 1);
  lock.lock();
}

Answer FileSource::request(const std::string& name, const Arguments& arguments) {
  const std::lock_guard lock(mutex_);
  return execute_one_of<requests::SetState, requests::SetPace, requests::Reset, player::Seek>(name,
                                                                                              arguments);
}

template <Request... Types>
Answer FileSource::execute_one_of(const std::string& name, const Arguments& arguments) {
  if (auto answer =
          answer_one_of<Types...>(name, arguments, [this](const auto& request) { return execute(request); }))
    return *std::move(answer);
  const std::string_view names[] = {request_info<Types>().name...};
  return {ControlResult::unsupported,
          "A recording has no request '" + name + "'; it has " + join(names, ", ") + ".",
          {}};
}

Answer FileSource::done(const std::string& sentence) {
  ++changes_;
  changed_.notify_all();
  return {ControlResult::ok, sentence, {}};
}

void FileSource::seek(double position_s) {
  position_ns_ = reader_.first_ns() +
                 static_cast<std::uint64_t>(std::llround(1e9 * std::clamp(position_s, 0.0, duration_s())));
  sought_ = true;
}

Answer FileSource::execute(const requests::SetState& request) {
  if (request.state == SimulationState::quitting)
    return {ControlResult::unsupported, "A recording is played or paused; Ctrl-C ends takt view.", {}};
  playing_ = request.state == SimulationState::playing;
  if (playing_ && position_ns_ >= reader_.last_ns()) seek(0.0);
  return done(playing_ ? "The recording is played." : "The recording is paused.");
}

Answer FileSource::execute(const requests::SetPace& request) {
  if (request.pace != Pace::realtime)
    return {ControlResult::unsupported, "A recording is played at the pace realtime, with a factor.", {}};
  rate_ = request.factor;
  return done("The recording is played " + number_text(rate_) + " times as fast.");
}

Answer FileSource::execute(const requests::Reset&) {
  seek(0.0);
  return done("The recording is at its beginning.");
}

Answer FileSource::execute(const player::Seek& request) {
  seek(request.position);
  return done("The recording is at another place.");
}

}  // namespace takt::view
