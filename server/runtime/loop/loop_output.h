#pragma once
// Output of the step loop, with the readers' acknowledgements. The loop writes without lock or wait (except
// replies to control requests, which are not part of a step); one thread of an adapter reads.
#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "idl/common/fixed_string.h"
#include "idl/common/spsc_ring.h"
#include "idl/common/triple_buffer.h"
#include "server/contact/surface/contact_interaction.h"
#include "server/runtime/auto_reset_event.h"
#include "server/runtime/loop/instant_writer.h"
#include "server/runtime/requests/control.h"
#include "server/runtime/requests/event.h"
#include "server/runtime/requests/motion_goal.h"
#include "server/runtime/requests/outbound_queue.h"
#include "server/runtime/requests/pressure_subscriptions.h"
#include "server/simulation/model/snapshot.h"
#include "server/simulation/step/simulation.h"

namespace takt {

struct Quantiles {
  double p50_s = 0.0, p99_s = 0.0, max_s = 0.0;
};

/// Figures of the loop, refreshed ten times a second of wall time.
struct LoopStatus {
  double time_s = 0.0;
  std::uint64_t step = 0;
  std::uint32_t epoch = 0;
  SimulationState state = SimulationState::paused;
  Pace pace = Pace::realtime;
  double pace_factor = 1.0;
  double wall_time_s = 0.0;        ///< since the construction of the loop
  double real_time_factor = 0.0;   ///< simulated time / wall time over the last second
  double computation_ratio = 0.0;  ///< computation time / simulated time over the last second
  double lag_s = 0.0;
  std::uint64_t overruns = 0, max_consecutive_overruns = 0, schedule_resets = 0;
  Quantiles step_time, wakeup_latency, command_latency;
  std::uint64_t commands_applied = 0;
  std::uint64_t commands_rejected = 0;  ///< by the loop; adapters count their own rejections
  std::uint64_t mpr_calls = 0, mpr_skipped = 0;
  FixedString<32> solver;
  std::uint64_t solver_steps = 0, solver_rejected_steps = 0;
  std::uint32_t contact_pairs = 0;  ///< that press in the newest instant
  ContactCallCounts contact_calls;
  std::array<std::int32_t, 64> process_levels{};  ///< level of detail at present, as far as they fit
  std::uint32_t process_count = 0;
  std::array<FixedString<128>, 16> waiting_for;
  std::uint32_t waiting_count = 0;
  FixedString<256> scheduling;
  FixedString<1024> fault;
};

/// What the simulation says of itself: instant, work so far, levels of detail (status_publisher.cpp).
void fill(LoopStatus& status, const Simulation& simulation);

struct LoopOutput {
  LoopOutput(const Simulation& simulation, std::shared_ptr<OutboundQueue> shared)
      : outbound(std::move(shared)),
        news(outbound->news),
        readers(outbound->instant_readers),
        contact_capacity(simulation.contact_capacity()),
        snapshots(simulation.make_snapshot()),
        events(4096),
        goals(1024),
        pressures(simulation.model()) {}

  /// Replies and other output that outlives the loaded scenario.
  const std::shared_ptr<OutboundQueue> outbound;
  /// Posted for a new value in one of the three members below, or a reply.
  AutoResetEvent& news;
  /// Without one, an instant is published with each status only, and ahead of a wait.
  const InstantReaders& readers;

  const std::size_t contact_capacity;  ///< most contacts that a published snapshot holds
  TripleBuffer<Snapshot> snapshots;
  TripleBuffer<LoopStatus> status;
  SpscRing<EventRecord> events;
  SpscRing<GoalReport> goals;  ///< of goals that were appended to the loop
  /// Which pairs are to be published element by element: agreed upon between clients and the adapter.
  PressureSubscriptions pressures;

  /// In lockstep the loop writes its instants itself, so that none is skipped; at other paces, and without a writer, the
  /// reader of `news` takes the newest.
  InstantWriterSlot instant_writer;
  /// The loop waits at a boundary, or is paused: the adapter repeats the newest state periodically, because a
  /// client that lost it gets no newer one.
  std::atomic<bool> standing_at_boundary{false};
};

}  // namespace takt
