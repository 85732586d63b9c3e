#include "server/runtime/recording/log_recorder.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>
#include <variant>

#include "server/runtime/monotonic_clock.h"
#include "server/simulation/model/model_hash.h"
#include "server/simulation/step/simulation.h"

namespace takt {
namespace {
constexpr std::int64_t kWriteEvery_ns = 100'000'000;
constexpr std::size_t kMaxUnwritten = 1U << 20U;  // framed but unwritten bytes
}  // namespace

template <typename Record>
void LogRecorder::frame(const Record& record) {
  if (failed_.load(std::memory_order_relaxed)) return;
  struct Sink {
    std::vector<std::byte> bytes;
    void append(const void* from, std::size_t size) {
      const auto* begin = static_cast<const std::byte*>(from);
      bytes.insert(bytes.end(), begin, begin + size);
    }
  } content;
  encode(content, 0, record);
  framing_.append(out_, content.bytes);
}

LogRecorder::LogRecorder(std::filesystem::path file, RecorderOptions options)
    : file_(std::move(file)), options_(std::move(options)), ring_(options_.ring) {
  options_.checkpoint_every = std::clamp<std::size_t>(options_.checkpoint_every, 1, kMaxTrail);
  fd_ = ::open(file_.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | (options_.replace ? O_TRUNC : O_EXCL), 0644);
  if (fd_ < 0) {
    throw LogError("the log '" + file_.string() + "' cannot be written: " + std::strerror(errno));
  }
  out_ = LogFraming::file_head();
  frame(LogBegin{options_.version, options_.cell});
  checkpoint_.trail.reserve(kMaxTrail);
  thread_ = std::thread([this] { run(); });
}

LogRecorder::~LogRecorder() {
  stop_.store(true);
  news_.post();
  thread_.join();
  ::close(fd_);
}

std::string LogRecorder::failure() const {
  const std::lock_guard lock(mutex_);
  return failure_;
}

void LogRecorder::flush() {
  const std::uint64_t wanted = flushes_wanted_.fetch_add(1) + 1;
  news_.post();
  for (std::uint64_t done = flushes_done_.load(); done < wanted; done = flushes_done_.load())
    flushes_done_.wait(done);
}

void LogRecorder::commit() {
  if (failed_.load(std::memory_order_relaxed) || overflowed_.load(std::memory_order_relaxed)) return;
  if (!ring_.commit()) {
    overflowed_.store(true, std::memory_order_release);
    news_.post();
    return;
  }
  records_.fetch_add(1, std::memory_order_relaxed);
  if (ring_.filled() > ring_.capacity() / 4) news_.post();
}

std::string LogRecorder::begin_scenario(LogScenario logged, Simulation& simulation, bool at_its_beginning) {
  checkpoint_.trail.clear();
  deadlines_watched_ = -1;
  logged.scenario = simulation.description().scenario;
  logged.model = model_hash(simulation.model());
  if (!at_its_beginning) {
    std::vector<std::byte> state;
    if (std::string why = simulation.save_state(state); !why.empty()) return why;
    logged.state = keep_state(state);
  }
  note(simulation.step_index(), logged);
  checkpoint(simulation);
  return {};
}

void LogRecorder::deadlines(const Simulation& simulation, bool count) {
  if (std::exchange(deadlines_watched_, count ? 1 : 0) == (count ? 1 : 0)) return;
  note(simulation.step_index(), LogDeadlines{count});
}

void LogRecorder::commands(const Simulation& simulation, std::span<const Command> batch) {
  for (const Command& command : batch)
    std::visit([&](const auto& c) { note(simulation.step_index(), c); }, command);
}

void LogRecorder::stepped(const Simulation& simulation) {
  checkpoint_.trail.push_back(static_cast<LogTrail>(simulation.state_hash()));
  if (checkpoint_.trail.size() == kMaxTrail || simulation.step_index() % options_.checkpoint_every == 0)
    checkpoint(simulation);
}

void LogRecorder::checkpoint(const Simulation& simulation) {
  checkpoint_.hash = simulation.state_hash();
  note(simulation.step_index(), checkpoint_);
  checkpoint_.trail.clear();
}

void LogRecorder::restored(std::uint64_t step, std::span<const std::byte> state) {
  note(step, LogRestored{keep_state(state)});
}

void LogRecorder::end_scenario(const Simulation& simulation) {
  checkpoint(simulation);
  note(simulation.step_index(), LogScenarioEnd{});
}

std::uint64_t LogRecorder::keep_state(std::span<const std::byte> state) {
  const std::uint64_t number = ++states_;
  if (failed_.load(std::memory_order_relaxed)) return number;
  const std::lock_guard lock(mutex_);
  waiting_states_.push_back({number, {state.begin(), state.end()}});
  return number;
}

void LogRecorder::run() {
  std::int64_t due_ns = 0;
  for (bool last = false; !last;) {
    if (!stop_.load()) news_.wait_until_ns(due_ns);
    last = stop_.load();
    const std::uint64_t flushes = flushes_wanted_.load();
    write_waiting();
    due_ns = monotonic_now_ns() + kWriteEvery_ns;
    flushes_done_.store(flushes);
    flushes_done_.notify_all();
  }
  if (!failed_.load()) {
    frame(LogEnd{});
    write_out();
  }
}

void LogRecorder::write_waiting() {
  // States are stored ahead of the records that name them, so those of all records up to here exist.
  const bool overflowed = overflowed_.load(std::memory_order_acquire);
  const std::uint64_t to = ring_.complete_to();
  std::vector<LogState> states;
  {
    const std::lock_guard lock(mutex_);
    states.swap(waiting_states_);
  }
  for (const LogState& state : states) frame(state);
  while (ring_.take(record_, to)) {
    if (!failed_.load(std::memory_order_relaxed)) framing_.append(out_, record_);
    if (out_.size() > kMaxUnwritten) write_out();
  }
  write_out();
  if (overflowed && !failed_.load()) {
    frame(LogLost{});
    write_out();
    fail("the disk was too slow, and records were lost");
  }
}

void LogRecorder::write_out() {
  const std::byte* at = out_.data();
  std::size_t left = failed_.load(std::memory_order_relaxed) ? 0 : out_.size();
  while (left > 0) {
    const ssize_t n = ::write(fd_, at, left);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) {
      fail(n == 0 ? "nothing more is taken" : std::strerror(errno));
      break;
    }
    at += n;
    left -= static_cast<std::size_t>(n);
    written_.fetch_add(static_cast<std::uint64_t>(n), std::memory_order_relaxed);
  }
  out_.clear();
}

void LogRecorder::fail(const std::string& why) {
  const std::string sentence = "The log '" + file_.string() + "' ends here, after " +
                               std::to_string(written_bytes()) + " bytes: " + why + ".";
  {
    const std::lock_guard lock(mutex_);
    failure_ = sentence;
    waiting_states_.clear();
  }
  failed_.store(true, std::memory_order_release);
  if (options_.on_failure) options_.on_failure(sentence);
}

}  // namespace takt
