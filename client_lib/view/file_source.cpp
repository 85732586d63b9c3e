#include "client_lib/view/file_source.h"

#include <algorithm>
#include <chrono>
#include <nlohmann/json.hpp>
#include <optional>

#include "client_lib/recording/json_text.h"
#include "idl/common/parse.h"
#include "idl/common/text.h"
#include "takt_request_table.h"
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

std::string argument(const Arguments& arguments, const char* name) {
  for (const auto& [key, value] : arguments)
    if (key == name) return value;
  return {};
}

}  // namespace

FileSource::FileSource(const std::filesystem::path& file, Stream& stream) : stream_(stream), reader_(file) {
  for (const auto& [id, channel] : reader_.channels())
    channels_[id] = stream_.add_channel({0, channel.topic, channel.encoding, channel.type,
                                         channel.schema_encoding, channel.schema, is_event(channel)});
  playback_channel_ = stream_.add_channel(
      {0, "/takt/playback", "json", "takt.Playback", "jsonschema", R"({"type": "object"})", false});
  look_through();
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
  const auto seconds = [](std::uint64_t ns) { return 1e-9 * static_cast<double>(ns); };
  const nlohmann::json document{{"position", seconds(position_ns_ - reader_.first_ns())},
                                {"duration", seconds(reader_.last_ns() - reader_.first_ns())},
                                {"playing", playing_},
                                {"rate", rate_},
                                {"problem", problem_}};
  stream_.push(playback_channel_, position_ns_, recording::json_text(document));
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
  const auto changed = [&](const std::string& message) {
    ++changes_;
    changed_.notify_all();
    return Answer{1, message, {}};
  };
  const auto seek = [&](double position_s) {
    const double length_s = 1e-9 * static_cast<double>(reader_.last_ns() - reader_.first_ns());
    position_ns_ = reader_.first_ns() +
                   static_cast<std::uint64_t>(std::llround(1e9 * std::clamp(position_s, 0.0, length_s)));
    sought_ = true;
  };
  const auto is = [&]<Request Type>(const Type&) { return name == request_info<Type>().name; };
  const std::string state = is(requests::SetState{}) ? argument(arguments, "state") : "";
  if (name == "play" || state == to_string(SimulationState::playing)) {
    if (position_ns_ >= reader_.last_ns()) seek(0.0);
    playing_ = true;
    return changed("The recording is played.");
  }
  if (name == "pause" || state == to_string(SimulationState::paused) ||
      state == to_string(SimulationState::stopped)) {
    playing_ = false;
    return changed("The recording is paused.");
  }
  if (is(requests::Reset{})) {
    seek(0.0);
    return changed("Back to the begin of the recording.");
  }
  if (name == "seek") {
    const auto position = finite_number(argument(arguments, "position"));
    if (!position) return {4, "seek needs 'position', in seconds from the begin of the recording.", {}};
    seek(*position);
    return changed("The recording is at another place.");
  }
  if (name == "rate" || is(requests::SetPace{})) {
    const auto factor = finite_number(argument(arguments, "factor"));
    if (!factor || !(*factor > 0.0)) return {4, "'factor' must be a number above 0.", {}};
    rate_ = *factor;
    return changed("The recording is played " + argument(arguments, "factor") + " times as fast.");
  }
  return {0, "A recording can be played, paused, sought through; '" + name + "' is for a running cell.", {}};
}

}  // namespace takt::view
