#pragma once
// The inside of takt::Client: what was received, under one mutex, and one condition variable for every wait.
//
// The mutex is never held while an entity of DDS is called: within one process Fast DDS delivers a sample in
// the thread that writes it, so a call into DDS may end in one of the functions below.
#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <map>
#include <mutex>
#include <vector>

#include "client_lib/client.h"
#include "client_lib/discovery.h"
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

struct Client::Impl {
  using Clock = std::chrono::steady_clock;
  using GuidPrefix = client::GuidPrefix;

  /// The newest sample of a topic.
  template <typename Sample>
  struct Newest {
    std::shared_ptr<const Sample> sample;  ///< empty before the first
    std::uint64_t count = 0;               ///< samples received
    bool has_reader = false;               ///< of topics that are received on demand

    explicit operator bool() const { return sample != nullptr; }
    const Sample* operator->() const { return sample.get(); }
    void set(std::shared_ptr<Sample> received) {
      received->sample_number = ++count;
      sample = std::move(received);
    }
    void reset() { sample.reset(); }
  };

  explicit Impl(ClientOptions options);

  /// A writer of commands or requests, and its readers.
  struct Sender {
    std::unique_ptr<client::WriterListener> listener;
    dds::DataWriter* writer = nullptr;
    int readers = 0;
    int incompatible_policy = 0;
  };

  void connect();
  /// Makes the reader of a topic on first use: a client that does not ask is spared a sample with every state.
  template <typename Wire, typename Sample>
  void listen_to(const Topic<Wire>& topic, Newest<Sample>& newest);
  void listen_to_power() { listen_to(topics::power, power); }
  void listen_to_contacts() { listen_to(topics::contacts, contacts); }
  void open_control(Clock::time_point deadline);
  Reply call(const std::string& name, const Arguments& arguments, Seconds timeout);
  std::uint64_t write_request(const std::string& name, const Arguments& arguments);
  using MakeType = dds::TypeSupport (*)();
  /// The sender for a topic, made on first use. Returns when a reader is matched.
  Sender& sender_for(const TopicInfo& info, const std::string& element, MakeType type);
  void write(Sender& sender, void* sample, const std::string& what);
  /// To a robot, gripper or device.
  template <typename Sample>
  void send(const Topic<Sample>& topic, const std::string& target, Sample& sample) {
    write(sender_for(topic, target, [] { return dds::TypeSupport(new MessageType<Sample>()); }), &sample,
          "a command for '" + target + "'");
  }

  // From threads of DDS.
  void on_description(const takt_msgs::msg::CellDescription& sample, const GuidPrefix& from);
  void on_status(const takt_msgs::msg::Status& sample, const GuidPrefix& from);
  void on_status_match(const GuidPrefix& from, bool matched);
  /// A sample of an instant. Older ones, and those that do not fit the description, are refused.
  template <typename Wire, typename Sample>
  void on_instant(Newest<Sample>& newest, const Wire& wire, const GuidPrefix& from);
  void on_event(const takt_msgs::msg::Event& sample, const GuidPrefix& from);
  void on_reply(const takt_msgs::msg::ControlReply& sample);

  // With the mutex held.
  /// Drops received samples that are older than the instant in the reply.
  void apply_reply_causality(std::unique_lock<std::mutex>& lock, const std::string& request,
                             const Arguments& values, std::uint32_t generation_before,
                             Clock::time_point deadline);
  template <typename Sample>
  static std::pair<std::uint32_t, std::uint64_t> instant_of(const Sample& sample) {
    return {sample.epoch, sample.step};
  }
  template <typename Sample>
  void drop_if_older_than_known(Newest<Sample>& newest) const {
    if (newest && instant_of(*newest.sample) < known) newest.reset();
  }
  bool from_this_server(const GuidPrefix& from);
  void keep(Event event);
  /// DDS does not survive fork(): of its threads there is none in the new process. Throws there.
  void require_own_process() const {
    if (link.is_of_this_process()) return;
    throw ClientError(ClientError::Kind::invalid,
                      "This client was made before fork(); the new process needs one of its own.");
  }
  bool silent(Clock::time_point now) const { return now > heard + to_clock(options.liveliness_timeout); }
  template <typename Ready>
  bool wait(std::unique_lock<std::mutex>& lock, Clock::time_point deadline, Ready ready) const;

  /// Without the mutex. The first of the samples that the predicate accepts; nothing when the time is over.
  template <typename Sample>
  std::optional<Sample> wait_for_sample(const Newest<Sample>& newest,
                                        const std::function<bool(const Sample&)>& predicate,
                                        Seconds timeout) const;

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
  mutable std::condition_variable changed;
  std::optional<GuidPrefix> server;  ///< participant of the server whose description is the newest
  bool gone = false;                 ///< DDS has announced the end of that server's status
  Clock::time_point heard = Clock::now();
  std::shared_ptr<const CellInfo> cell;
  Newest<State> state;
  Newest<Status> status;
  Newest<Power> power;
  Newest<Contacts> contacts;
  /// Epoch and step of the newest instant that a reply has named, in the present scenario.
  std::pair<std::uint32_t, std::uint64_t> known{0, 0};
  std::optional<std::pair<GuidPrefix, std::shared_ptr<Status>>>
      early_status;                                        ///< of a server whose description is still to come
  std::vector<std::pair<GuidPrefix, Event>> early_events;  ///< likewise
  std::deque<Event> events;
  std::uint64_t newest_event = 0;  ///< sequence number
  std::uint64_t next_sequence = 1;
  std::map<std::uint64_t, std::optional<takt_msgs::msg::ControlReply>> replies;
  int reply_writers = 0;
  bool control_is_open = false;

  std::mutex senders_mutex;  ///< for making senders, and readers on demand
  std::map<std::string, std::unique_ptr<Sender>> senders;

  // Listeners before the link: what is declared first is destroyed last.
  std::vector<std::unique_ptr<dds::DataReaderListener>> listeners;
  client::CellWatch watch;
  client::Link link;
};

/// Waits until ready() or the deadline; false when the deadline passed. Throws when the server is gone or has
/// been silent too long. A stopped process (SIGSTOP, a suspended machine) receives nothing, so the server's
/// silence proves nothing when the process continues. The wait then allows `emptying` for samples that are
/// still in the sockets and, after a long stop, `rediscovery` for DDS to discover the server again.
template <typename Ready>
bool Client::Impl::wait(std::unique_lock<std::mutex>& lock, Clock::time_point deadline, Ready ready) const {
  constexpr std::chrono::milliseconds late{300}, emptying{1000}, rediscovery{10000};
  require_own_process();
  // Of all the waits of a thread: those for one sample after the other are short each.
  thread_local Clock::time_point looked = Clock::now();
  auto doubtful_until = Clock::now() + late;
  for (;;) {
    if (ready()) return true;
    const auto now = Clock::now();
    const auto found_until = link.returned() + rediscovery;
    if (gone && now > found_until) throw ClientError(ClientError::Kind::lost, where() + " has gone away.");
    doubtful_until = std::max(doubtful_until, found_until);
    if (silent(now) && now > doubtful_until)
      throw ClientError(
          ClientError::Kind::lost,
          where() + " has been silent for " +
              std::to_string(std::chrono::duration_cast<std::chrono::seconds>(now - heard).count()) +
              " s (killed, stopped, or the machine is overloaded).");
    if (now >= deadline) return false;
    auto wake = std::min(deadline, std::max(heard + to_clock(options.liveliness_timeout), doubtful_until));
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

template <typename Sample>
std::optional<Sample> Client::Impl::wait_for_sample(const Newest<Sample>& newest,
                                                    const std::function<bool(const Sample&)>& predicate,
                                                    Seconds timeout) const {
  const auto deadline = deadline_after(timeout);
  std::uint64_t seen = 0;
  std::unique_lock lock(mutex);
  while (wait(lock, deadline, [&] { return newest && newest->sample_number != seen; })) {
    const std::shared_ptr<const Sample> held = newest.sample;
    seen = held->sample_number;
    lock.unlock();  // the predicate may use this client
    if (predicate(*held)) return *held;
    lock.lock();
  }
  return std::nullopt;
}

}  // namespace takt
