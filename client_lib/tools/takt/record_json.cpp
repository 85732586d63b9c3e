#include "client_lib/tools/takt/record_json.h"

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <thread>
#include <vector>

#include "client_lib/recording/json_text.h"
#include "client_lib/tools/takt/interruption.h"
#include "client_lib/tools/takt/sample_json.h"

namespace takt::tool {
namespace {

using nlohmann::json;

/// How long a stream that is silent waits before it looks whether the recording is over.
constexpr Seconds kWait{0.1};

template <typename Sample>
json line_of(const char* kind, const Sample& sample) {
  json line = json_of(sample);
  line["kind"] = kind;
  return line;
}

struct Count {
  std::uint64_t written = 0, missed = 0;
};

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
    threads.emplace_back([this] {
      follow([&] {
        next_sample<State>("state", states_, [&](const auto& p) { return cell_.wait_for_state(p, kWait); });
      });
    });
    threads.emplace_back([this] {
      follow([&] {
        next_sample<Contacts>("contacts", contacts_,
                              [&](const auto& p) { return cell_.wait_for_contacts(p, kWait); });
      });
    });
    threads.emplace_back([this] {
      follow([&] {
        next_sample<Power>("power", powers_, [&](const auto& p) { return cell_.wait_for_power(p, kWait); });
      });
    });
    threads.emplace_back([this] { follow([&] { next_event(); }); });
    for (std::thread& thread : threads) thread.join();
    const auto figures = [](const Count& count) {
      return json{{"written", count.written}, {"missed", count.missed}};
    };
    const json end{{"kind", "end"},
                   {"states", figures(states_.count)},
                   {"contacts", figures(contacts_.count)},
                   {"power", figures(powers_.count)},
                   {"events", figures(events_)}};
    write(end);
    std::fprintf(stderr,
                 "%llu states (%llu missed), %llu contacts (%llu), %llu power (%llu), %llu events (%llu).\n",
                 number(states_.count.written), number(states_.count.missed), number(contacts_.count.written),
                 number(contacts_.count.missed), number(powers_.count.written), number(powers_.count.missed),
                 number(events_.written), number(events_.missed));
    if (failure_) std::rethrow_exception(failure_);
    return 0;
  }

 private:
  struct Stream {
    std::uint64_t newest = 0;  ///< number of the sample; 0: none yet
    double time_s = -1.0;      ///< of that sample
    double due_s = -1.0;
    std::uint32_t epoch = 0;
    Count count;
  };
  static void close(std::FILE* file) {
    if (file != stdout) std::fclose(file);
  }
  static unsigned long long number(std::uint64_t value) { return value; }

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

  void wait_for_the_next_server() {
    if (!gone_.exchange(true)) say_that_the_cell_has_gone();
    if (cell_.wait_for_connection(kWait)) gone_.store(false);
  }

  template <typename Sample, typename Wait>
  void next_sample(const char* kind, Stream& stream, const Wait& wait) {
    const auto sample = wait([&](const Sample& s) { return s.sample_number > stream.newest; });
    if (!sample) return;
    if (stream.newest > 0) stream.count.missed += sample->sample_number - stream.newest - 1;
    stream.newest = sample->sample_number;
    // The server repeats an instant while it stands still.
    const bool at_end = sample->time >= end_s_ - 1e-9;
    const bool another =
        stream.count.written == 0 || sample->epoch != stream.epoch || sample->time < stream.time_s;
    stream.time_s = sample->time;
    if (another || sample->time >= stream.due_s - 1e-9) {
      stream.due_s = sample->time + options_.period_s;
      stream.epoch = sample->epoch;
      write(line_of(kind, *sample));
      ++stream.count.written;
    }
    if constexpr (std::is_same_v<Sample, State>) {
      if (at_end) over_.store(true);
    }
  }

  void next_event() {
    const auto event = cell_.next_event(kWait);
    if (!event) return;
    events_.missed += event->missed_before;
    ++events_.written;
    write(line_of("event", *event));
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
  std::atomic<bool> over_{false};
  std::atomic<bool> gone_{false};      ///< the server, and that it is waited for has been said
  Stream states_, contacts_, powers_;  // each of one thread
  Count events_;                       // of one thread
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
