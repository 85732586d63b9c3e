#include "server/runtime/recording/log_recorder.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "plant_models/state_bytes.h"
#include "server/runtime/monotonic_clock.h"
#include "server/simulation/model/model_hash.h"
#include "server/simulation/step/simulation.h"

namespace takt {
namespace {
constexpr std::int64_t kWriteEvery_ns = 100'000'000;
constexpr std::size_t kMaxUnwritten = 1U << 20U;  // bytes framed before they are written
}  // namespace

LogRecorder::LogRecorder(std::filesystem::path file, RecorderOptions options)
    : file_(std::move(file)), options_(std::move(options)), ring_(options_.ring) {
  options_.checkpoint_every = std::clamp<std::size_t>(options_.checkpoint_every, 1, kMaxTrail);
  fd_ = ::open(file_.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | (options_.replace ? O_TRUNC : O_EXCL), 0644);
  if (fd_ < 0) {
    throw LogError("the log '" + file_.string() + "' cannot be written: " + std::strerror(errno));
  }
  out_ = LogFraming::file_head();
  std::vector<std::byte> content;
  StateWriter writer(content);
  writer.put(static_cast<std::uint8_t>(LogKind::begin));
  writer.put(std::uint64_t{0});
  writer.put(std::string_view(options_.version));
  writer.put(std::string_view(options_.cell));
  framing_.append(out_, content);
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

void LogRecorder::begin(LogKind kind, std::uint64_t step) {
  ring_.begin();
  ring_.put(static_cast<std::uint8_t>(kind));
  ring_.put(step);
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

template <typename... Values>
void LogRecorder::note(LogKind kind, std::uint64_t step, const Values&... values) {
  begin(kind, step);
  (ring_.put(values), ...);
  commit();
}

std::string LogRecorder::begin_scenario(LogScenario logged, Simulation& simulation, bool at_its_beginning) {
  trail_length_ = 0;
  deadlines_watched_ = -1;
  logged.scenario = simulation.description().scenario;
  logged.model = model_hash(simulation.model());
  if (!at_its_beginning) {
    std::vector<std::byte> state;
    if (std::string why = simulation.save_state(state); !why.empty()) return why;
    logged.state = keep_state(state);
  }
  std::vector<std::byte> content;
  encode(content, logged);
  begin(LogKind::scenario, simulation.step_index());
  ring_.append(content.data(), content.size());
  commit();
  checkpoint(simulation);
  return {};
}

void LogRecorder::deadlines(const Simulation& simulation, bool watched) {
  if (deadlines_watched_ == (watched ? 1 : 0)) return;
  deadlines_watched_ = watched ? 1 : 0;
  note(LogKind::deadlines, simulation.step_index(), static_cast<std::uint8_t>(watched ? 1 : 0));
}

void LogRecorder::commands(const Simulation& simulation, std::span<const Command> batch) {
  for (const Command& command : batch) {
    std::visit(
        [&](const auto& c) {
          begin(kind_of(c), simulation.step_index());
          encode(ring_, c);
          commit();
        },
        command);
  }
}

void LogRecorder::stepped(const Simulation& simulation) {
  trail_[trail_length_++] = static_cast<LogTrail>(simulation.state_hash());
  if (trail_length_ == trail_.size() || simulation.step_index() % options_.checkpoint_every == 0)
    checkpoint(simulation);
}

void LogRecorder::checkpoint(const Simulation& simulation) {
  begin(LogKind::checkpoint, simulation.step_index());
  ring_.put(simulation.state_hash());
  ring_.append(trail_.data(), trail_length_ * sizeof(LogTrail));
  commit();
  trail_length_ = 0;
}

void LogRecorder::fault(const Simulation& simulation) {
  note(LogKind::fault, simulation.step_index());
}

void LogRecorder::reset(std::uint64_t step) {
  note(LogKind::reset, step);
}

void LogRecorder::level_of_detail(const Simulation& simulation, int process, int level) {
  note(LogKind::level_of_detail, simulation.step_index(), static_cast<std::int32_t>(process),
       static_cast<std::int32_t>(level));
}

void LogRecorder::attach(const Simulation& simulation, int part, int to) {
  note(LogKind::attach, simulation.step_index(), static_cast<std::int32_t>(part),
       static_cast<std::int32_t>(to));
}

void LogRecorder::detach(const Simulation& simulation, int part) {
  note(LogKind::detach, simulation.step_index(), static_cast<std::int32_t>(part));
}

void LogRecorder::entity_state(const Simulation& simulation, int component, const Pose& X_WB,
                               const Twist& V_WB) {
  begin(LogKind::entity_state, simulation.step_index());
  ring_.put(static_cast<std::int32_t>(component));
  ring_.append(X_WB.R.data(), 9 * sizeof(double));
  ring_.append(X_WB.p.data(), 3 * sizeof(double));
  ring_.append(V_WB.v.data(), 3 * sizeof(double));
  ring_.append(V_WB.w.data(), 3 * sizeof(double));
  commit();
}

void LogRecorder::restored(std::uint64_t step, std::span<const std::byte> state) {
  note(LogKind::restored, step, keep_state(state));
}

void LogRecorder::saved(const Simulation& simulation) {
  note(LogKind::saved, simulation.step_index());
}

void LogRecorder::end_world(const Simulation& simulation) {
  checkpoint(simulation);
  note(LogKind::scenario_end, simulation.step_index());
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
    frame(LogKind::end, {});
    write_out();
  }
}

void LogRecorder::write_waiting() {
  // States are kept before the records that name them, so those of all records up to here are there.
  const bool overflowed = overflowed_.load(std::memory_order_acquire);
  const std::uint64_t to = ring_.complete_to();
  std::vector<State> states;
  {
    const std::lock_guard lock(mutex_);
    states.swap(waiting_states_);
  }
  for (const State& state : states) {
    std::vector<std::byte> content;
    StateWriter writer(content);
    writer.put(state.number);
    content.insert(content.end(), state.bytes.begin(), state.bytes.end());
    frame(LogKind::state, content);
  }
  while (ring_.take(record_, to)) {
    if (!failed_.load(std::memory_order_relaxed)) framing_.append(out_, record_);
    if (out_.size() > kMaxUnwritten) write_out();
  }
  write_out();
  if (overflowed && !failed_.load()) {
    frame(LogKind::lost, {});
    write_out();
    fail("the disk was too slow, and records were lost");
  }
}

void LogRecorder::frame(LogKind kind, std::span<const std::byte> content) {
  if (failed_.load(std::memory_order_relaxed)) return;
  std::vector<std::byte> whole(1 + sizeof(std::uint64_t));
  whole[0] = static_cast<std::byte>(kind);
  whole.insert(whole.end(), content.begin(), content.end());
  framing_.append(out_, whole);
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
