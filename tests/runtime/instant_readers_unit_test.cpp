// Instants without a reader are not handed over, but the newest is there for a reader that comes.
#include <gtest/gtest.h>

#include "server/runtime/loop/run_loop.h"
#include "tests/support/loop_reader.h"
#include "tests/support/service_cell.h"

namespace takt {
namespace {

TEST(InstantReaders, EachInstantCountsUntilAnAdapterCounts) {
  InstantReaders readers;
  EXPECT_TRUE(readers.any());
  readers.begin_to_count();
  EXPECT_FALSE(readers.any());
  readers.change(2);
  readers.change(-1);
  EXPECT_TRUE(readers.any());
  EXPECT_EQ(readers.arrivals(), 1U);
  // Of a reader that came and left, the threads of DDS may report the end first.
  readers.change(-1);
  readers.change(-1);
  readers.change(1);
  EXPECT_FALSE(readers.any());
}

TEST(InstantReaders, ALoopPublishesInstantsForReadersAndWithTheStatus) {
  constexpr std::uint64_t kFirstReader = 200, kNoReader = 400, kEnd = 600;
  Simulation simulation(test::service_model());
  auto outbound = std::make_shared<OutboundQueue>();
  outbound->instant_readers.begin_to_count();
  LoopOutput* output = nullptr;
  std::uint64_t handed_over = 0, without_status = 0, skipped = 0;
  RunLoopOptions options;
  options.pace = Pace::free;
  options.outbound = outbound;
  options.pause_at_s = 1e-3 * static_cast<double>(kEnd);
  // In the loop's thread, ahead of the publication of this instant: what was published of the one before.
  options.on_instant = [&](const Simulation& now) {
    if (now.step_index() == 0) return;
    const Snapshot* snapshot = output->snapshots.take();
    const LoopStatus* status = output->status.take();
    const std::uint64_t before = now.step_index() - 1;
    const bool is_read = before >= kFirstReader && before < kNoReader;
    if (snapshot != nullptr) {
      EXPECT_EQ(snapshot->step, before);
      if (is_read)
        ++handed_over;
      else if (status == nullptr && before > 0)
        ++without_status;
    } else if (is_read) {
      ++skipped;
    }
    if (now.step_index() + 1 == kFirstReader) outbound->instant_readers.change(1);
    if (now.step_index() + 1 == kNoReader) outbound->instant_readers.change(-1);
  };
  RunLoop loop(simulation, options);
  output = &loop.output();
  loop.start();
  // Only what is not an instant, which the loop's thread takes above.
  EventRecord event;
  const auto ended = [&] {
    while (loop.output().events.pop(event))
      if (info_of(event).code == "end_of_scenario") return true;
    return false;
  };
  while (!ended()) loop.output().news.wait_until_ns(monotonic_now_ns() + 10'000'000);
  loop.stop();
  EXPECT_EQ(handed_over, kNoReader - kFirstReader);
  EXPECT_EQ(skipped, 0U);
  EXPECT_EQ(without_status, 0U);
  const Snapshot* last = loop.output().snapshots.take();
  ASSERT_NE(last, nullptr) << "the instant of a pause is there for readers that come later";
  EXPECT_EQ(last->step, kEnd);
  EXPECT_EQ(last->state_hash, simulation.state_hash());
}

}  // namespace
}  // namespace takt
