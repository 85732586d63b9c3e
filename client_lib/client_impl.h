#pragma once
// The inside of takt::Client: what was received, under one mutex, and one place for every wait.
//
// The mutex is never held while an entity of DDS is called: Fast DDS calls the functions below with locks of its own
// held, for which such a call may wait.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <map>
#include <mutex>
#include <vector>

#include "client_lib/client.h"
#include "client_lib/discovery.h"
#include "client_lib/outvoting.h"
#include "idl/common/text.h"
#include "takt_topics.h"

namespace takt {

/// Index by name; throws ClientError (not_found) with the names there are.
template <typename Described>
std::size_t require_by_name(const char* kind, const std::vector<Described>& items, std::string_view name) {
  for (std::size_t i = 0; i < items.size(); ++i)
    if (items[i].name == name) return i;
  throw ClientError(ClientError::Kind::not_found, std::string("The cell has no ") + kind + " '" +
                                                      std::string(name) + "'; it has " + list_names(items) +
                                                      ".");
}

/// What the waits of a client wait for. A thread that waits receives the samples itself, if no other one does.
class Arrivals {
 public:
  /// Ahead of the first wait.
  void receive_with(UdpReceiver& receiver) { receiver_ = &receiver; }
  void notify_all() {
    ++count_;
    changed_.notify_all();
    if (UdpReceiver* receiver = receiver_) receiver->interrupt();
  }
  /// Returns after a notification, at the deadline, or sooner. `lock` is of the mutex that notifiers hold.
  void wait_until(std::unique_lock<std::mutex>& lock, UdpReceiver::Clock::time_point deadline) {
    const std::uint64_t seen = count_;
    lock.unlock();
    const bool led = receiver_.load()->lead(deadline, [&] { return count_ != seen; });
    lock.lock();
    if (led || count_ != seen) return;
    const UdpReceiver::Follower follower(*receiver_);
    changed_.wait_until(lock, deadline);
  }

 private:
  std::condition_variable changed_;
  std::atomic<std::uint64_t> count_{0};
  std::atomic<UdpReceiver*> receiver_{nullptr};
};

struct Client::Impl {
  using GuidPrefix = client::GuidPrefix;

  struct Reader;
  template <Message Type>
  struct ReaderOf;

  explicit Impl(ClientOptions options);

  /// A writer of commands or requests, and its readers.
  struct Sender {
    std::unique_ptr<client::WriterListener> listener;
    dds::DataWriter* writer = nullptr;
    std::vector<GuidPrefix> readers;  ///< participants of the matched ones: the server, recorders
    int incompatible_policy = 0;
  };

  /// Throws at the deadline; false when the server's participant was there for `patience`, and did not answer.
  bool connect(Clock::time_point deadline, Clock::duration patience);
  /// The reader of a topic, made on first use: a client that does not ask is spared its samples. Throws ClientError
  /// as Client::wait_for does.
  Reader& reader_of(const TopicInfo& topic, const std::string& element);
  template <Message Type>
  ReaderOf<Type>& make_reader(const Topic<Type>& topic, const std::string& name,
                              typename client::ReaderListener<Type>::OnMatch on_match = {});
  void open_control(Clock::time_point deadline);
  Reply call(const std::string& name, const Arguments& arguments, Seconds timeout);
  std::uint64_t write_request(const std::string& name, const Arguments& arguments);
  using MakeType = dds::TypeSupport (*)();
  /// The sender for a topic, made on first use, with or without readers.
  Sender& open_sender(const TopicInfo& info, const std::string& element, MakeType type);
  /// The same. Returns when the server's reader is matched; recorders have readers too.
  Sender& sender_for(const TopicInfo& info, const std::string& element, MakeType type);
  void write(Sender& sender, void* sample, const std::string& what);
  /// To a robot, gripper or device.
  template <typename Sample>
  void send(const Topic<Sample>& topic, const std::string& target, Sample& sample) {
    write(sender_for(topic, target, [] { return dds::TypeSupport(new MessageType<Sample>()); }), &sample,
          "a command for '" + target + "'");
  }
  /// To the present readers, and to later ones of a latched topic.
  template <typename Sample>
  void publish(const Topic<Sample>& topic, const std::string& element, Sample sample) {
    write(open_sender(topic, element, [] { return dds::TypeSupport(new MessageType<Sample>()); }), &sample,
          "'" + std::string(topic.id) + "'");
  }
  class CommandBatch;
  /// To a robot, gripper or device, or into the batch of this thread.
  template <typename Sample>
  void command(const Topic<Sample>& topic, const std::string& target, Sample&& sample);

  // From threads of DDS.
  void on_description(ReaderOf<takt_msgs::msg::CellDescription>& of,
                      const takt_msgs::msg::CellDescription& sample, const GuidPrefix& from);
  void on_status_match(const GuidPrefix& from, bool matched);
  void on_reply(const takt_msgs::msg::ControlReply& sample);

  // With the mutex held.
  /// Drops received samples that are older than the instant in the reply.
  void apply_reply_causality(std::unique_lock<std::mutex>& lock, const std::string& request,
                             const Arguments& values, std::uint32_t generation_before,
                             Clock::time_point deadline);
  bool from_this_server(const GuidPrefix& from);
  /// Samples of the server go on that do not fit the description, but the one before it: the newest was forged.
  void restore_description();
  /// DDS does not survive fork(): of its threads there is none in the new process. Throws there.
  void require_own_process() const {
    if (link.is_of_this_process()) return;
    throw ClientError(ClientError::Kind::invalid,
                      "This client was made before fork(); the new process needs one of its own.");
  }
  bool silent(Clock::time_point now) const { return now > heard + to_clock(options.liveliness_timeout); }
  template <typename Ready>
  bool wait(std::unique_lock<std::mutex>& lock, Clock::time_point deadline, Ready ready) const;

  static Clock::duration to_clock(Seconds duration) {
    // Longer than a century means forever; it must not overflow the clock.
    return std::chrono::duration_cast<Clock::duration>(std::min(duration, Seconds{3.0e9}));
  }
  static Clock::time_point deadline_after(Seconds timeout) { return Clock::now() + to_clock(timeout); }
  std::string where() const {
    return "Cell '" + options.cell + "' on domain " + std::to_string(options.domain);
  }

  const ClientOptions options;
  const std::string id;

  mutable std::mutex mutex;
  mutable Arrivals changed;
  std::optional<GuidPrefix> server;  ///< participant of the server whose description is the newest
  bool gone = false;                 ///< DDS has announced the end of that server's status
  Clock::time_point heard = Clock::now();
  std::shared_ptr<const CellInfo> cell;
  std::shared_ptr<const CellInfo> cell_before;  ///< the description of this server that `cell` has replaced
  ReaderOf<takt_msgs::msg::CellDescription>* description = nullptr;
  /// Epoch and step of the newest instant that a reply has named, in the present scenario.
  std::pair<std::uint32_t, std::uint64_t> known{0, 0};
  std::uint64_t next_sequence = 1;
  std::map<std::uint64_t, std::optional<takt_msgs::msg::ControlReply>> replies;
  int reply_writers = 0;
  bool control_is_open = false;

  std::mutex senders_mutex;  ///< for making senders, and readers on demand
  std::map<std::string, std::unique_ptr<Sender>> senders;

  // Listeners before the link: what is declared first is destroyed last.
  std::map<std::string, std::unique_ptr<Reader>> topic_readers;  ///< by the name of the topic
  ReaderOf<takt_msgs::msg::CellState>* state = nullptr;          ///< as `status`, from connect() on
  ReaderOf<takt_msgs::msg::Status>* status = nullptr;
  std::unique_ptr<client::ReaderListener<takt_msgs::msg::ControlReply>> reply_listener;
  client::CellWatch watch;
  client::Link link;
};

/// Waits until ready() or the deadline; false when the deadline passed. Throws when the server is gone or has
/// been silent too long. A stopped process (SIGSTOP, a suspended machine) receives nothing, so the server's
/// silence proves nothing when the process continues. The wait then allows `emptying` for samples that are
/// still in the sockets and, after a long stop, `rediscovery` for DDS to discover the server again.
template <typename Ready>
bool Client::Impl::wait(std::unique_lock<std::mutex>& lock, Clock::time_point deadline, Ready ready) const {
  constexpr std::chrono::milliseconds late{300}, emptying{1000}, rediscovery{15000};
  require_own_process();
  // Of all the waits of a thread: those for one sample after the other are short each.
  thread_local Clock::time_point looked = Clock::now();
  auto doubtful_until = Clock::now() + late;
  // A last reply may come by another socket than the news that its sender has gone.
  auto gone_since = Clock::time_point::max();
  for (;;) {
    if (ready()) return true;
    const auto now = Clock::now();
    const auto found_until = link.returned() + rediscovery;
    gone_since = gone ? std::min(gone_since, now) : Clock::time_point::max();
    const auto heard_until = std::max(found_until, std::min(gone_since, now) + late);
    if (gone && now > heard_until) throw ClientError(ClientError::Kind::lost, where() + " has gone away.");
    doubtful_until = std::max(doubtful_until, found_until);
    if (silent(now) && now > doubtful_until)
      throw ClientError(
          ClientError::Kind::lost,
          where() + " has been silent for " +
              std::to_string(std::chrono::duration_cast<std::chrono::seconds>(now - heard).count()) +
              " s (killed, stopped, or the machine is overloaded).");
    if (now >= deadline) return false;
    auto wake = std::min(deadline, std::max(heard + to_clock(options.liveliness_timeout), doubtful_until));
    if (gone) wake = std::min(wake, heard_until);
    if (options.while_waiting) wake = std::min(wake, now + std::chrono::milliseconds{200});
    changed.wait_until(lock, wake + std::chrono::milliseconds{1});
    if (const auto awake = Clock::now(); awake > wake + late) doubtful_until = awake + emptying;
    if (options.while_waiting && Clock::now() >= looked + std::chrono::milliseconds{200}) {
      lock.unlock();
      options.while_waiting();
      lock.lock();
      looked = Clock::now();
    }
  }
}

/// Collects the commands that a thread sends through one client.
class Client::Impl::CommandBatch {
 public:
  explicit CommandBatch(Impl& client) : client_(client), outer_(std::exchange(of_thread_, this)) {}
  ~CommandBatch() { of_thread_ = outer_; }
  CommandBatch(const CommandBatch&) = delete;
  CommandBatch& operator=(const CommandBatch&) = delete;

  /// nullptr: commands through this client are sent at once.
  static CommandBatch* of_thread(const Impl& client) {
    return of_thread_ != nullptr && &of_thread_->client_ == &client ? of_thread_ : nullptr;
  }
  void add(const std::string& robot, sensor_msgs::msg::JointState&& command) {
    make_room(collected_.robots, field_info<takt_msgs::msg::Commands>("robots"));
    collected_.robots.push_back({robot, std::move(command)});
  }
  void add(const std::string& gripper, const takt_msgs::msg::GripperCommand& command) {
    make_room(collected_.grippers, field_info<takt_msgs::msg::Commands>("grippers"));
    collected_.grippers.push_back({gripper, command});
  }
  void add(const std::string& device, takt_msgs::msg::DeviceCommand&& command) {
    make_room(collected_.devices, field_info<takt_msgs::msg::Commands>("devices"));
    collected_.devices.push_back({device, std::move(command)});
  }
  void send() {
    if (collected_.robots.empty() && collected_.grippers.empty() && collected_.devices.empty()) return;
    client_.write(
        client_.sender_for(topics::commands, {},
                           [] { return dds::TypeSupport(new MessageType<takt_msgs::msg::Commands>()); }),
        &collected_, "commands");
    collected_.robots.clear();
    collected_.grippers.clear();
    collected_.devices.clear();
  }

 private:
  /// Commands beyond the bound of a list go into another sample.
  template <typename List>
  void make_room(const List& list, const FieldInfo& field) {
    if (list.size() == field.bound) send();
  }
  static inline thread_local CommandBatch* of_thread_ = nullptr;
  Impl& client_;
  CommandBatch* outer_;
  takt_msgs::msg::Commands collected_;
};

template <typename Sample>
void Client::Impl::command(const Topic<Sample>& topic, const std::string& target, Sample&& sample) {
  if (CommandBatch* batch = CommandBatch::of_thread(*this)) return batch->add(target, std::move(sample));
  send(topic, target, sample);
}

/// What was received of a topic. Functions and members are used with the mutex held.
struct Client::Impl::Reader {
  virtual ~Reader() = default;
  /// The client has another description.
  virtual void on_description(bool other_server, bool other_scenario) = 0;
  /// Drops what is older than the newest instant that a reply has named.
  virtual void drop_older_than_known() = 0;

  bool has_another(std::uint64_t seen) const { return !samples.empty() && samples.back().number != seen; }
  Received hand_out() {
    Received first = samples.front();
    if (each_counts) samples.pop_front();
    return first;
  }

  bool each_counts = false;      ///< TopicQos::event
  std::uint64_t count = 0;       ///< samples received
  std::deque<Received> samples;  ///< the newest; where each counts, those that were not handed out
};

template <Message Type>
struct Client::Impl::ReaderOf final : Reader {
  using Sample = SampleOf<Type>;
  using Kept = std::conditional_t<std::is_same_v<Sample, CellInfo>, Type, Sample>;
  static constexpr bool kHasInstant = requires(const Type& one) {
    one.epoch;
    one.step;
  };
  static constexpr bool kHasScenario = requires(const Type& one) { one.scenario_generation; };

  ReaderOf(Impl& owner, const Topic<Type>& topic, typename client::ReaderListener<Type>::OnMatch on_match)
      : client(owner),
        latched(qos_of(topic).latched),
        listener(
            pool_of(topic),
            [this](std::shared_ptr<Kept> sample, const GuidPrefix& from) {
              on_sample(std::move(sample), from);
            },
            std::move(on_match)) {
    each_counts = topic.qos == TopicQos::event;
  }

  /// Of a stream one sample is read, one is the newest, and one is looked at; a latched one is rare and may be large.
  static client::SamplePool<Type, Kept> pool_of(const Topic<Type>& topic) {
    constexpr std::size_t kOfStream = 4;
    return client::SamplePool<Type, Kept>(qos_of(topic).latched ? 0 : kOfStream, [](Kept& sample) {
      if constexpr (!std::is_same_v<Kept, Type>) static_cast<Sample&>(sample).cell = nullptr;
      if constexpr (requires { sample.missed_before; }) sample.missed_before = 0;
    });
  }

  /// nullptr before the first.
  const Sample* newest() const {
    return samples.empty() ? nullptr : static_cast<const Sample*>(samples.back().sample.get());
  }

  /// From a thread of DDS, without the mutex.
  void on_sample(std::shared_ptr<Kept> received, const GuidPrefix& from) {
    if constexpr (std::is_same_v<Sample, CellInfo>) {
      client.on_description(*this, *received, from);
    } else {
      const std::lock_guard lock(client.mutex);
      take(std::move(received), from);
      client.changed.notify_all();
    }
  }

  /// Keeps a sample, unless it is older than what is known or does not fit the description. One of another server or
  /// of a later scenario waits for the description.
  void take(std::shared_ptr<Sample> received, const GuidPrefix& from) {
    bool is_later = !client.from_this_server(from) || client.cell == nullptr;
    if constexpr (kHasScenario)
      is_later = is_later || received->scenario_generation > client.cell->scenario_generation;
    if (is_later) {
      constexpr std::size_t kMost = 100;
      if (!each_counts) early.clear();
      if (client.from_this_server(from) && client.cell != nullptr && outvotes_description(*received)) {
        client.restore_description();
        return take(std::move(received), from);
      }
      if (early.size() < kMost) early.emplace_back(from, std::move(received));
      return;
    }
    if (!fits_description(*received, client.cell.get())) {
      if (!outvotes_description(*received)) return;
      client.restore_description();
    }
    description_votes.in_order();
    if constexpr (kHasInstant) {
      const auto instant = instant_of(*received);
      if (!each_counts && (instant < client.known || (newest() && instant < instant_of(*newest())))) {
        if (!votes.older(instant, Clock::now())) return;
        client.known = std::min(client.known, instant);
      } else if (!each_counts && newest() && !is_confirmed(received)) {
        return;
      }
      votes.in_order();
    }
    received->cell = client.cell;
    keep(std::move(received));
  }

  /// False for a sample far ahead of the newest one, which waits for the next to confirm it: no simulation gets there
  /// meanwhile, and a sample lost between two resets is rare.
  bool is_confirmed(const std::shared_ptr<Sample>& received) {
    const auto now = Clock::now();
    const Seconds since = now - std::exchange(heard, now);
    const auto leap = std::exchange(unconfirmed, nullptr);
    if (leap && !client::leaps(*leap, *received, since)) return true;
    if (!client::leaps(*newest(), *received, since)) return true;
    unconfirmed = received;
    return false;
  }
  static bool fits_description(const Type& sample, const CellInfo* cell) {
    if constexpr (kHasScenario)
      if (sample.scenario_generation != cell->scenario_generation) return false;
    return fits<Type>(sample, cell->lists, cell->lists);
  }
  bool outvotes_description(const Type& sample) {
    if constexpr (kHasScenario) {
      if (client.cell_before == nullptr || !fits_description(sample, client.cell_before.get())) return false;
      return description_votes.older({sample.scenario_generation, 0}, Clock::now());
    }
    return false;
  }

  void keep(std::shared_ptr<Sample> received) {
    constexpr std::size_t kMost = 10000;
    if constexpr (requires { received->missed_before; }) {
      if (received->sequence_number <= newest_sequence) {
        // A number from the past may come late. Two that follow each other outvote one far ahead.
        const auto before = std::exchange(older, received);
        if (!before || before->sequence_number + 1 != received->sequence_number) return;
        older = nullptr;
        newest_sequence = 0;
        keep(std::move(before));
      }
      // Those before the first one received belong to the time before this client.
      if (newest_sequence != 0) received->missed_before = received->sequence_number - newest_sequence - 1;
      newest_sequence = received->sequence_number;
    }
    received->sample_number = ++count;
    if (!each_counts) samples.clear();
    samples.push_back({std::move(received), count});
    if (samples.size() <= kMost) return;
    const Received dropped = std::move(samples.front());
    samples.pop_front();
    if constexpr (requires(Sample one) { one.missed_before; })
      static_cast<Sample*>(samples.front().sample.get())->missed_before +=
          static_cast<const Sample*>(dropped.sample.get())->missed_before + 1;
  }

  void on_description(bool other_server, bool other_scenario) override {
    // A latched sample that does not name its scenario is not sent again.
    const bool stays = each_counts || (latched && !kHasScenario);
    if (other_server ? !each_counts : other_scenario && !stays) samples.clear();
    if (other_server) newest_sequence = 0;
    if constexpr (!std::is_same_v<Sample, CellInfo>)
      for (auto& [from, sample] : std::exchange(early, {}))
        if (from == *client.server) take(std::move(sample), from);
  }

  void drop_older_than_known() override {
    if constexpr (kHasInstant)
      if (!each_counts && newest() != nullptr && instant_of(*newest()) < client.known) samples.clear();
  }

  static std::pair<std::uint32_t, std::uint64_t> instant_of(const Type& sample) {
    return {sample.epoch, sample.step};
  }

  Impl& client;
  const bool latched;
  client::Outvoting votes, description_votes;
  std::shared_ptr<Sample> unconfirmed;  ///< far ahead of the newest
  Clock::time_point heard{};            ///< the last one in order
  std::shared_ptr<Sample> older;        ///< the last one, where its number was from the past
  std::uint64_t newest_sequence = 0;
  std::vector<std::pair<GuidPrefix, std::shared_ptr<Sample>>> early;  ///< wait for their description
  client::KeptSampleListener<Type, Kept> listener;
};

}  // namespace takt
