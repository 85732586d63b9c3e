#include "client_lib/tools/takt/record_all.h"
#include "client_lib/tools/takt/vector_json.h"

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
#include "client_lib/tools/takt/signals_json.h"

namespace takt::tool {
namespace {

using client::Seconds;
using nlohmann::json;

/// How long a stream that is silent waits before it looks whether the recording is over.
constexpr Seconds kWait{0.1};

template <typename Sample>
json head(const char* kind, const Sample& sample) {
  return {{"kind", kind}, {"time", sample.time_s}, {"step", sample.step}, {"epoch", sample.epoch}};
}

json line_of(const client::State& state) {
  json line = head("state", state);
  line["state_hash"] = hash_text(state.state_hash);
  const client::CellInfo& info = *state.cell;
  for (std::size_t i = 0; i < state.components.size(); ++i) {
    const auto& c = state.components[i];
    if (info.components[i].type == client::ComponentType::ground) continue;
    line["components"][info.components[i].name] = {
        {"position", c.position_m},
        {"orientation", {c.orientation.x, c.orientation.y, c.orientation.z, c.orientation.w}},
        {"linear_velocity", c.linear_velocity},
        {"angular_velocity", c.angular_velocity},
        {"force", c.force_N},
        {"torque", c.torque_Nm},
        {"state", to_string(c.state)},
        {"partner", state.partner_of(info.components[i].name)}};
  }
  for (std::size_t i = 0; i < state.robots.size(); ++i)
    line["robots"][info.robots[i].name] = {{"position", state.robots[i].position},
                                           {"velocity", state.robots[i].velocity},
                                           {"effort", state.robots[i].effort}};
  for (std::size_t i = 0; i < state.grippers.size(); ++i)
    line["grippers"][info.grippers[i].name] = {{"width", state.grippers[i].width_m},
                                               {"force", state.grippers[i].force_N},
                                               {"closed", state.grippers[i].closed},
                                               {"moving", state.grippers[i].moving},
                                               {"in_position", state.grippers[i].in_position},
                                               {"part_present", state.part_present(info.grippers[i].name)}};
  for (std::size_t i = 0; i < state.devices.size(); ++i)
    line["devices"][info.devices[i].name]["signals"] = signals_json(info.devices[i], state.devices[i]);
  return line;
}

json line_of(const client::Contacts& contacts) {
  json line = head("contacts", contacts);
  line["omitted"] = contacts.omitted;
  line["contacts"] = json::array();
  for (const auto& c : contacts.contacts)
    line["contacts"].push_back({{"base", c.base},
                                {"target", c.target},
                                {"force", c.force_N},
                                {"torque", c.torque_Nm},
                                {"center_of_pressure", c.center_of_pressure_m},
                                {"area", c.area_m2},
                                {"normal_force", c.normal_force_N},
                                {"friction_force", c.friction_force_N},
                                {"largest_pressure", c.largest_pressure_Pa},
                                {"largest_penetration", c.largest_penetration_m}});
  return line;
}

json line_of(const client::Power& power) {
  json line = head("power", power);
  for (const auto& c : power.consumers)
    line["consumers"][c.name] = {{"mechanical_power", c.mechanical_W},
                                 {"electrical_power", c.electrical_W},
                                 {"mechanical_energy", c.mechanical_energy_J},
                                 {"electrical_energy", c.electrical_energy_J}};
  return line;
}

json line_of(const client::Event& event) {
  json line = head("event", event);
  line["sequence_number"] = event.sequence_number;
  line["severity"] = to_string(event.severity);
  line["code"] = event.code;
  line["subject"] = event.subject;
  line["sender"] = event.sender;
  line["message"] = event.message;
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
        start_s_(cell_.state().time_s),
        file_(options.file == "-" ? stdout : std::fopen(options.file.c_str(), "w"), &close) {
    if (!file_) throw std::runtime_error("The file '" + options.file + "' cannot be written.");
  }

  int run() {
    end_s_ = options_.duration_s ? start_s_ + *options_.duration_s : 1.0e300;
    if (options_.until_s) end_s_ = std::min(end_s_, *options_.until_s);
    std::vector<std::thread> threads;
    threads.emplace_back([this] {
      follow([&] {
        next_sample<client::State>(states_, [&](const auto& p) { return cell_.wait_for_state(p, kWait); });
      });
    });
    threads.emplace_back([this] {
      follow([&] {
        next_sample<client::Contacts>(contacts_,
                                      [&](const auto& p) { return cell_.wait_for_contacts(p, kWait); });
      });
    });
    threads.emplace_back([this] {
      follow([&] {
        next_sample<client::Power>(powers_, [&](const auto& p) { return cell_.wait_for_power(p, kWait); });
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
  void next_sample(Stream& stream, const Wait& wait) {
    const auto sample = wait([&](const Sample& s) { return s.sample_number > stream.newest; });
    if (!sample) return;
    if (stream.newest > 0) stream.count.missed += sample->sample_number - stream.newest - 1;
    stream.newest = sample->sample_number;
    // The server repeats an instant while it stands still.
    const bool at_end = sample->time_s >= end_s_ - 1e-9;
    const bool another =
        stream.count.written == 0 || sample->epoch != stream.epoch || sample->time_s < stream.time_s;
    stream.time_s = sample->time_s;
    if (another || sample->time_s >= stream.due_s - 1e-9) {
      stream.due_s = sample->time_s + options_.period_s;
      stream.epoch = sample->epoch;
      write(line_of(*sample));
      ++stream.count.written;
    }
    if constexpr (std::is_same_v<Sample, client::State>) {
      if (at_end) over_.store(true);
    }
  }

  void next_event() {
    const auto event = cell_.next_event(kWait);
    if (!event) return;
    events_.missed += event->missed_before;
    ++events_.written;
    write(line_of(*event));
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

int record_all(const Common& common, const RecordOptions& options) {
  Recording recording(common, options);
  note_interruptions();
  return recording.run();
}

}  // namespace takt::tool
