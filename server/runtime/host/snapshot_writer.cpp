#include "server/runtime/host/snapshot_writer.h"

#include <utility>

#include "server/runtime/monotonic_clock.h"

namespace takt {

SnapshotWriter::SnapshotWriter(RunLoop& loop, SessionStore& store, Session session)
    : loop_(loop), store_(store), session_(std::move(session)), thread_([this] { run(); }) {}

SnapshotWriter::~SnapshotWriter() {
  stop_.store(true);
  loop_.saver().news().post();
  thread_.join();
}

void SnapshotWriter::run() {
  constexpr std::int64_t kLongestSleep_ns = 1'000'000'000;
  while (!stop_.load()) {
    loop_.saver().news().wait_until_ns(monotonic_now_ns() + kLongestSleep_ns);
    write_newest();
  }
}

void SnapshotWriter::write_newest() {
  const SavedState* saved = loop_.saver().saved().take();
  if (saved == nullptr) return;
  session_.state = saved->state;
  session_.pace = saved->pace;
  session_.factor = saved->factor;
  std::string failure = store_.write(session_);
  if (failure.empty()) failure = store_.write_periodic(saved->identity, saved->bytes).message;
  if (failure.empty() == failing_) {  // reported at the start and at the end of a failure
    failing_ = !failure.empty();
    EventQueue& reports = loop_.output().outbound->events;
    if (failing_)
      reports.post(events::SnapshotFailed{"The periodic snapshot could not be written: " + failure});
    else
      reports.post(events::SnapshotWritten{});
  }
}

}  // namespace takt
