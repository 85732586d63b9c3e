#include "server/contact/collision/pair_queries.h"

namespace takt {

void PairQueries::set_executor(Executor* executor, std::uint64_t least_calls) {
  executor_ = executor;
  least_calls_ = least_calls;
}

bool PairQueries::begin(std::uint64_t expected_calls) {
  begun_ = enough(expected_calls);
  if (!begun_ || !executor_->begin(expected_calls)) return false;
  clear();
  return true;
}

void PairQueries::end() {
  if (begun_) executor_->end();
  begun_ = false;
}

void PairQueries::clear() {
  items_.clear();
  lanes_.fill({});
  expected_calls_ = 0;
}

void PairQueries::add(const Item& pair, std::uint64_t expected_calls) {
  const auto index = static_cast<std::int32_t>(items_.size());
  items_.push_back(pair);
  Lane& lane = lanes_[CollisionWorld::hint_lane(pair.base)];
  if (lane.first < 0)
    lane.first = index;
  else
    items_[static_cast<std::size_t>(lane.last)].next = index;
  lane.last = index;
  expected_calls_ += 1 + expected_calls;
}

void PairQueries::run(CollisionWorld& world, std::vector<PairVerdict>& verdicts, DetectionCounts& counts) {
  if (!enough(expected_calls_)) {
    for (const Item& item : items_)
      query_verdict(world, item.base, item.target, verdicts[item.verdict], counts);
    return;
  }
  Job job{*this, world, verdicts};
  executor_->run(kLanes, &run_lane, &job);
  for (const Lane& lane : lanes_) counts += lane.counts;
}

void PairQueries::run_lane(std::size_t lane, void* context) {
  const Job& job = *static_cast<const Job*>(context);
  Lane& mine = job.queries.lanes_[lane];
  DetectionCounts counts;
  for (std::int32_t i = mine.first; i >= 0;) {
    const Item& item = job.queries.items_[static_cast<std::size_t>(i)];
    query_verdict(job.world, item.base, item.target, job.verdicts[item.verdict], counts);
    i = item.next;
  }
  mine.counts = counts;
}

}  // namespace takt
