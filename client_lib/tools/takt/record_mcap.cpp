// takt record FILE.mcap: the samples of a cell as they come, and takt replay: sends them again.
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <map>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <utility>

#include "client_lib/raw_topics.h"
#include "client_lib/recording/mcap_reader.h"
#include "client_lib/recording/mcap_writer.h"
#include "client_lib/tools/takt/commands.h"
#include "client_lib/tools/takt/instant_watch.h"
#include "client_lib/tools/takt/interruption.h"
#include "idl/common/cdr.h"
#include "idl/common/stamp.h"
#include "takt_topics.h"

namespace takt::tool {
namespace {

using client::RawTopic;
using recording::RecordingError;
using std::chrono::milliseconds;

constexpr milliseconds kLook{100};
/// Bounds the loss by a crash of the recorder.
constexpr int kLooksBetweenFlushes = 10;
/// A server from which no status came for so long counts as gone; it sends ten a second.
constexpr std::chrono::seconds kSilenceLimit{5};
/// Each renewal needs a participant of its own for a moment.
constexpr Seconds kRenewal{300.0};
/// Samples that may wait while a chunk is compressed and written.
constexpr int kDepth = 1000;

std::uint64_t wall_ns() {
  return static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::nanoseconds>(
                                        std::chrono::system_clock::now().time_since_epoch())
                                        .count());
}

/// Whether samples of a type begin with their stamp.
bool begins_with_stamp(const std::string& type) {
  const auto* known = recording::known_types().find(type);
  if (known == nullptr || known->fields.empty()) return false;
  const std::string& first = known->fields.front().message;
  return first == "builtin_interfaces/msg/Time" || first == "std_msgs/msg/Header";
}

std::uint64_t stamp_ns(std::string_view sample) {
  cdr::Reader reader(sample);
  const builtin_interfaces::msg::Time stamp{reader.number<std::int32_t>(), reader.number<std::uint32_t>()};
  if (!reader.ok()) throw recording::RecordingError("A sample ends before its last member.");
  return static_cast<std::uint64_t>(std::max<std::int64_t>(nanoseconds_of(stamp), 0));
}

class McapRecorder {
 public:
  McapRecorder(const Common& common, const RecordOptions& options, std::optional<double> period_s)
      : common_(common),
        options_(options),
        period_s_(period_s),
        end_s_(options.until_s),
        asked_(options.pressures.empty()),
        instants_(Seconds{period_s.value_or(0.0)}, Seconds{0.0}, kRenewal),
        heard_(std::chrono::steady_clock::now() + time_to_find_it(common)),
        writer_(options.file, std::string("takt ") + TAKT_VERSION,
                recording::compression_named(options.compression).value_or(recording::Compression::zstd)),
        topics_(
            common.client, [this](const RawTopic& topic) { add(topic); },
            [this](const RawTopic& topic, std::string_view sample) { take(topic, sample); }) {}

  int run() {
    int looks = 0;
    std::unique_lock lock(mutex_);
    while (!over_ && failure_.empty() && !interrupted()) {
      changed_.wait_for(lock, kLook);
      if (!over_ && note_silence()) break;
      if (std::exchange(new_description_, false)) instants_.restart();
      if (described_ && (instants_.due() || !asked_)) {
        lock.unlock();
        ask();
        lock.lock();
      }
      if (++looks % kLooksBetweenFlushes == 0) writer_.flush();
      if (isatty(STDERR_FILENO) != 0 && looks % kLooksBetweenFlushes == 0) progress();
    }
    const bool lost = gone_ && bounded() && !over_;
    over_ = true;
    if (!failure_.empty()) throw std::runtime_error(failure_);
    writer_.close();
    if (isatty(STDERR_FILENO) != 0) std::fputs("\r\033[K", stderr);
    if (lost)
      throw ClientError(ClientError::Kind::lost, "Cell '" + common_.client.cell +
                                                     "' has gone away; what came before is in '" +
                                                     options_.file + "'.");
    if (common_.json)
      print_json(nlohmann::json{{"file", options_.file},
                                {"samples", writer_.message_count()},
                                {"topics", channels_.size()},
                                {"time", time_s_}});
    else
      std::fprintf(stderr, "%llu samples of %zu topics, up to %.3f s of simulated time: %s\n",
                   static_cast<unsigned long long>(writer_.message_count()), channels_.size(), time_s_,
                   options_.file.c_str());
    return kOk;
  }

 private:
  struct Channel {
    std::uint16_t number = 0;
    bool stamped = false, thinned = false;
    double due_s = -1.0e300, newest_s = 0.0;
  };

  static std::chrono::steady_clock::duration time_to_find_it(const Common& common) {
    constexpr double kMost_s = 3.0e9;  // the clock must not overflow
    return std::chrono::duration_cast<std::chrono::steady_clock::duration>(
        Seconds{std::min(common.timeout_s, kMost_s)});
  }

  bool bounded() const { return options_.until_s || options_.duration_s; }

  /// Whether the recording ends because the server has gone; one without an end waits for the next server.
  bool note_silence() {
    if (std::chrono::steady_clock::now() - heard_ < kSilenceLimit) return false;
    if (bounded()) return gone_ = true;
    if (!gone_) say_that_the_cell_has_gone();
    gone_ = true;
    described_ = false;
    asked_ = options_.pressures.empty();  // the next server has not been asked
    return false;
  }

  /// For instants of lockstep and for pressures. The requests may outlast the recording: the server sends only what has a
  /// reader.
  void ask() {
    constexpr double kLongest_s = 86400.0;
    ClientOptions options = common_.client;
    options.timeout = Seconds{2.0};
    try {
      Client cell(options);
      instants_.renew(cell);
      if (!asked_) cell.call(requests::WatchPressures{options_.pressures, kLongest_s});
      asked_ = true;
    } catch (const ClientError& error) {
      if (error.kind() == ClientError::Kind::refused || error.kind() == ClientError::Kind::invalid) throw;
      instants_.postpone(InstantWatch::kRenewal);  // note_silence() ends a recording
    }
  }

  void progress() const {
    std::string left;
    if (end_s_ && first_s_ && time_s_ > *first_s_) {
      char text[64];
      std::snprintf(text, sizeof text, ", %3.0f %%",
                    100.0 * (time_s_ - *first_s_) / std::max(*end_s_ - *first_s_, 1e-9));
      left = text;
    }
    std::fprintf(stderr, "\r\033[K%.1f s, %llu samples%s", time_s_,
                 static_cast<unsigned long long>(writer_.message_count()), left.c_str());
    std::fflush(stderr);
  }

  void add(const RawTopic& topic) {
    if (recording::known_types().find(topic.type) == nullptr) {
      if (unknown_types_.insert(topic.type).second)
        std::fprintf(stderr,
                     "takt: note: %s is not recorded, as any topic of its type %s: the type is not known.\n",
                     topic.name.c_str(), topic.type.c_str());
      return;
    }
    try {
      {
        const std::lock_guard lock(mutex_);
        Channel& channel = channels_[topic.name];
        channel.number = writer_.add_channel(topic.name, recording::known_types(), topic.type,
                                             {topic.reliable, topic.latched});
        channel.stamped = begins_with_stamp(topic.type);
        channel.thinned = period_s_ && channel.stamped && topic.type != topics::status.type->name;
      }
      topics_.open(topic.name, topic.latched ? 1 : kDepth);
    } catch (const std::exception& error) {
      fail(error.what());
    }
  }

  void take(const RawTopic& topic, std::string_view sample) {
    const std::lock_guard lock(mutex_);
    if (over_ || !failure_.empty()) return;
    const auto found = channels_.find(topic.name);
    if (found == channels_.end()) return;
    Channel& channel = found->second;
    const std::uint64_t now_ns = wall_ns();
    try {
      std::uint64_t publish_ns = now_ns;
      if (channel.stamped) {
        publish_ns = stamp_ns(sample);
        const double time_s = 1e-9 * static_cast<double>(publish_ns);
        if (channel.thinned && !due(channel, time_s)) return;
        if (topic.type == topics::state.type->name) note_time(time_s);
      }
      if (topic.type == topics::description.type->name) described_ = new_description_ = true;
      if (topic.type == topics::status.type->name) {
        heard_ = std::chrono::steady_clock::now();
        gone_ = false;
      }
      writer_.write(channel.number, now_ns, publish_ns, sample);
      if (at_end_) {
        over_ = true;
        changed_.notify_all();
      }
    } catch (const RecordingError& error) {
      failure_ = error.what();
      changed_.notify_all();
    }
  }

  /// True once per period of simulated time. After a reset (time goes back) the next sample is due.
  bool due(Channel& channel, double time_s) const {
    if (time_s < channel.newest_s) channel.due_s = -1.0e300;
    channel.newest_s = time_s;
    if (time_s < channel.due_s - 1e-9) return false;
    channel.due_s = time_s + *period_s_;
    return true;
  }

  void note_time(double time_s) {
    if (!first_s_) {
      first_s_ = time_s;
      if (options_.duration_s) {
        const double end_s = time_s + *options_.duration_s;
        end_s_ = end_s_ ? std::min(*end_s_, end_s) : end_s;
      }
    }
    time_s_ = time_s;
    at_end_ = end_s_ && time_s >= *end_s_ - 1e-9;
  }

  void fail(const std::string& sentence) {
    const std::lock_guard lock(mutex_);
    failure_ = sentence;
    changed_.notify_all();
  }

  Common common_;
  RecordOptions options_;
  std::optional<double> period_s_, end_s_, first_s_;
  bool asked_;                                   ///< for pressures, or there is nothing to ask for
  InstantWatch instants_;                        ///< asked for by run()
  std::chrono::steady_clock::time_point heard_;  ///< when the newest status came
  double time_s_ = 0.0;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool over_ = false, described_ = false, new_description_ = false, at_end_ = false, gone_ = false;
  std::string failure_;
  std::map<std::string, Channel> channels_;
  std::set<std::string> unknown_types_;  ///< noted
  recording::McapWriter writer_;
  client::RawTopics topics_;
};

}  // namespace

int record_mcap(const Common& common, const RecordOptions& options, std::optional<double> period_s) {
  { const Session cell(common); }  // a file that is there is replaced only when there is something to record
  note_interruptions();
  return McapRecorder(common, options, period_s).run();
}

namespace {

/// QoS of the recorded writer from the file; without it, the QoS that a server offers.
recording::OfferedQos qos_of(const recording::McapChannel& channel) {
  const auto profiles = channel.metadata.find(std::string(recording::kOfferedQosProfiles));
  if (profiles == channel.metadata.end() || profiles->second.empty())
    return recording::qos_of_server(channel.topic);
  if (const auto qos = recording::read_offered_qos(profiles->second)) return *qos;
  std::fprintf(stderr, "takt: note: the QoS profiles of %s cannot be read; it is sent as a server would.\n",
               channel.topic.c_str());
  return recording::qos_of_server(channel.topic);
}

}  // namespace

int replay(const Common& common, const ReplayOptions& options) {
  note_interruptions();
  recording::McapReader file(options.file);
  if (!file.cut_off().empty()) std::fprintf(stderr, "takt: note: %s\n", file.cut_off().c_str());
  client::RawPublisher publisher(common.client);
  std::size_t added = 0;
  const auto is_command = [](const std::string& topic) {
    return std::any_of(std::begin(topics::kAll), std::end(topics::kAll), [&](const TopicInfo* one) {
      return one->qos == TopicQos::command && topic.ends_with("/" + std::string(one->last_level()));
    });
  };
  for (const auto& [number, channel] : file.channels()) {
    if (channel.encoding != "cdr" || (is_command(channel.topic) && !options.commands)) continue;
    const recording::OfferedQos qos = qos_of(channel);
    publisher.add({channel.topic, channel.type, qos.latched, qos.reliable});
    ++added;
  }
  if (added == 0) throw std::runtime_error("'" + options.file + "' has no samples that DDS could send.");
  std::uint64_t sent = 0, refused = 0;
  const bool show = isatty(STDERR_FILENO) != 0;
  const double length_s = 1e-9 * static_cast<double>(file.last_ns() - file.first_ns()) / options.rate;
  auto shown_next = std::chrono::steady_clock::now();
  const auto begin = std::chrono::steady_clock::now();
  file.read([&](const recording::McapMessage& message) {
    const double offset_s = 1e-9 * static_cast<double>(message.log_time_ns - file.first_ns()) / options.rate;
    const auto due = begin + std::chrono::duration_cast<std::chrono::steady_clock::duration>(
                                 std::chrono::duration<double>(offset_s));
    while (!interrupted() && std::chrono::steady_clock::now() < due)
      std::this_thread::sleep_until(std::min(due, std::chrono::steady_clock::now() + kLook));
    if (interrupted()) return false;
    if (show && std::chrono::steady_clock::now() >= shown_next) {
      shown_next = std::chrono::steady_clock::now() + kLook;
      std::fprintf(stderr, "\r\033[K%.1f of %.1f s", offset_s, length_s);
      std::fflush(stderr);
    }
    if (is_command(message.channel->topic) && !options.commands) return true;
    publisher.write(message.channel->topic, message.sample) ? ++sent : ++refused;
    return true;
  });
  if (show) std::fputs("\r\033[K", stderr);
  if (common.json)
    std::printf("{\"sent\": %llu, \"refused\": %llu}\n", static_cast<unsigned long long>(sent),
                static_cast<unsigned long long>(refused));
  else
    std::fprintf(stderr, "%llu samples sent again, %llu refused by DDS.\n",
                 static_cast<unsigned long long>(sent), static_cast<unsigned long long>(refused));
  return refused == 0 ? kOk : kFailed;
}

}  // namespace takt::tool
