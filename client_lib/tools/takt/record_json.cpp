#include <algorithm>
#include <atomic>
#include <cstdio>
#include <exception>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <thread>
#include <type_traits>
#include <utility>
#include <vector>

#include "client_lib/tools/takt/commands.h"
#include "client_lib/tools/takt/instant_watch.h"
#include "client_lib/tools/takt/interruption.h"
#include "client_lib/tools/takt/sample_json.h"

namespace takt::tool {
namespace {

using nlohmann::json;

/// How long a stream that is silent waits before it looks whether the recording is over.
constexpr Seconds kWait{0.1};

/// Of each there is a stream in the recording: of instants a sample per period, of events all.
bool is_recorded(const TopicInfo& topic) {
  return topic.is_for_clients() && (topic.qos == TopicQos::instant || topic.qos == TopicQos::event);
}

class Recording {
 public:
  Recording(const Common& common, const RecordOptions& options)
      : session_(common),
        options_(options),
        bounded_(options.until_s || options.duration_s),
        start_s_(cell_.state().time),
        file_(options.file == "-" ? stdout : std::fopen(options.file.c_str(), "w"), &close) {
    if (!file_) throw std::runtime_error("The file '" + options.file + "' cannot be written.");
  }

  int run() {
    end_s_ = options_.duration_s ? start_s_ + *options_.duration_s : 1.0e300;
    if (options_.until_s) end_s_ = std::min(end_s_, *options_.until_s);
    std::vector<std::thread> threads;
    topics::for_each([&](const auto& topic) {
      if (!is_recorded(topic)) return;
      Stream& stream = streams_[std::string(topic.id)];
      threads.emplace_back([this, &topic, &stream] {
        follow([&] { next_sample(topic, stream); });
        if (topic.qos == TopicQos::event) complete(topic, stream);
      });
    });
    for (std::thread& thread : threads) thread.join();
    json end{{"kind", "end"}};
    std::string counts;
    for (const auto& [kind, stream] : streams_) {
      end[kind] = {{"written", stream.written}, {"missed", stream.missed}};
      counts += (counts.empty() ? "" : ", ") + kind + ": " + std::to_string(stream.written) + " (" +
                std::to_string(stream.missed) + " missed)";
    }
    write(end);
    std::fprintf(stderr, "%s.\n", counts.c_str());
    if (failure_) std::rethrow_exception(failure_);
    return 0;
  }

 private:
  struct Stream {
    std::uint64_t newest = 0;  ///< number of the sample; 0: none yet
    double time_s = -1.0;      ///< of that sample
    double due_s = -1.0;
    std::uint32_t epoch = 0;
    std::uint64_t written = 0, missed = 0;
  };
  static void close(std::FILE* file) {
    if (file != stdout) std::fclose(file);
  }

  /// Until the recording is over, in a thread of its own.
  void follow(const std::function<void()>& once) {
    try {
      while (!over_.load()) {
        if (interrupted()) over_.store(true);
        try {
          once();
        } catch (const ClientError& error) {
          if (error.kind() != ClientError::Kind::lost || bounded_) throw;
          wait_for_the_next_server();
        }
      }
    } catch (const std::exception&) {
      const std::lock_guard lock(mutex_);
      if (!failure_) failure_ = std::current_exception();
      over_.store(true);
    }
  }

  /// Writes the events that came before the end and wait for this thread; each counts.
  template <Message Type>
  void complete(const Topic<Type>& topic, Stream& stream) {
    try {
      for (int i = 0; i < qos_of(topic.qos).depth && next_sample(topic, stream); ++i) {
      }
    } catch (const ClientError&) {  // follow() has said what ends the recording
    }
  }

  void wait_for_the_next_server() {
    if (!gone_.exchange(true)) say_that_the_cell_has_gone();
    if (!cell_.wait_for_connection(kWait)) return;
    gone_.store(false);
  }

  /// False if none comes within kWait.
  template <Message Type>
  bool next_sample(const Topic<Type>& topic, Stream& stream) {
    if (topic.id == topics::state.id) watch_.renew(cell_);
    const auto sample = cell_.wait_for(
        topic, [&](const auto& one) { return one.sample_number > stream.newest; }, kWait);
    if (!sample) return false;
    bool wanted = true;
    if constexpr (requires { sample->missed_before; })
      stream.missed += sample->missed_before;
    else if (stream.newest > 0)
      stream.missed += sample->sample_number - stream.newest - 1;
    stream.newest = sample->sample_number;
    if constexpr (requires {
                    sample->epoch;
                    sample->time;
                  }) {
      // The server repeats an instant while it stands still.
      const bool another =
          stream.written == 0 || sample->epoch != stream.epoch || sample->time < stream.time_s;
      wanted = another || topic.qos == TopicQos::event || sample->time >= stream.due_s - 1e-9;
      stream.time_s = sample->time;
      if constexpr (std::is_same_v<Type, takt_msgs::msg::CellState>)
        if (std::exchange(asked_, sample->cell) != sample->cell) watch_.restart();
      if (wanted) {
        stream.due_s = sample->time + options_.period_s;
        stream.epoch = sample->epoch;
      }
      if (topic.id == topics::state.id && sample->time >= end_s_ - 1e-9) over_.store(true);
    }
    if (wanted) {
      json line = json_of(*sample);
      line["kind"] = topic.id;
      write(line);
      ++stream.written;
    }
    return true;
  }

  void write(const json& line) {
    const std::string text = recording::json_text(line) + '\n';
    const std::lock_guard lock(mutex_);
    if (broken_) return;
    if (std::fputs(text.c_str(), file_.get()) < 0 || std::fflush(file_.get()) != 0) {
      broken_ = true;
      over_.store(true);
      failure_ = std::make_exception_ptr(
          std::runtime_error("The file '" + options_.file + "' cannot be written on."));
    }
  }

  Session session_;
  Client& cell_ = *session_;
  RecordOptions options_;
  const bool bounded_;
  const double start_s_;
  std::unique_ptr<std::FILE, void (*)(std::FILE*)> file_;
  double end_s_ = 0.0;
  // Of the thread of states:
  InstantWatch watch_{Seconds{options_.period_s}, Seconds{start_s_}};
  std::shared_ptr<const CellInfo> asked_;  ///< the scenario that was asked
  std::atomic<bool> over_{false};
  std::atomic<bool> gone_{false};          ///< the server, and that it is waited for has been said
  std::map<std::string, Stream> streams_;  // by the id of the topic; each is of one thread
  std::mutex mutex_;
  bool broken_ = false;         // guarded by mutex_
  std::exception_ptr failure_;  // guarded by mutex_
};

}  // namespace

int record_json(const Common& common, const RecordOptions& options) {
  Recording recording(common, options);
  note_interruptions();
  return recording.run();
}

}  // namespace takt::tool
