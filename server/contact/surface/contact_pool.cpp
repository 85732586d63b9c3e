#include "server/contact/surface/contact_pool.h"

#include <algorithm>

namespace takt {
namespace {

/// Pairs of a small cell have a contact each from the start.
constexpr std::size_t kFirst = 256;
constexpr std::size_t kKeptPerComponent = 2;

auto place_of(std::vector<PairContact*>& kept, std::size_t number) {
  return std::lower_bound(kept.begin(), kept.end(), number,
                          [](const PairContact* pair, std::size_t key) { return pair->number < key; });
}

}  // namespace

void PairContact::note_peak(std::uint64_t update, double time_s, const Pose& X_WT) {
  peak.history.add(time_s, result.normal_force_N);
  const std::optional<ForceHistory::Vertex> vertex = peak.history.vertex();
  if (vertex && peak.time_s == peak.history.middle_time_s()) {
    const double larger = vertex->force_N / peak.result.normal_force_N;
    peak.update = update, peak.time_s = vertex->time_s;
    peak.result.F_B_T.f *= larger, peak.result.F_B_T.t *= larger;
    for (double* value :
         {&peak.result.normal_force_N, &peak.result.friction_force_N, &peak.result.largest_pressure_Pa})
      *value *= larger;
  }
  const double least_N = peak.update == update ? peak.result.normal_force_N : 0.0;
  if (result.elements > 0 && result.normal_force_N > least_N)
    peak = {update, time_s, X_WT, result, peak.history};
}

ContactPool::ContactPool(const ContactModel& model, std::size_t component_count)
    : model_(model), most_kept_(kFirst + kKeptPerComponent * component_count) {
  for (const ContactPairKind& kind : model.pairs.kinds())
    depends_on_heat_ = depends_on_heat_ || !kind.friction_at_K.empty();
  kept_.reserve(std::min(model.pairs.size(), most_kept_) + 1);
  grow(std::min(model.pairs.size(), kFirst));
}

void ContactPool::grow(std::size_t count) {
  if (count == 0) return;
  const ContactPairModel any = model_.pairs[0];
  made_.reserve(made_.size() + count);
  free_.reserve(made_.size() + count);
  for (std::size_t i = 0; i < count; ++i) {
    made_.push_back(
        std::make_unique<PairContact>(PolygonalContact(model_.surfaces[static_cast<std::size_t>(any.base)],
                                                       model_.surfaces[static_cast<std::size_t>(any.target)],
                                                       any.law, model_.field(any.target, any.depth))));
    made_.back()->number = PairTable::kNone;
    free_.push_back(made_.back().get());
  }
}

PairContact& ContactPool::take(std::size_t number, int base, int target) {
  if (const auto kept = place_of(kept_, number); kept != kept_.end() && (*kept)->number == number) {
    PairContact& pair = **kept;
    kept_.erase(kept);
    return pair;
  }
  if (free_.empty()) grow(std::max<std::size_t>(kFirst, made_.size() / 2));
  PairContact& pair = *free_.back();
  free_.pop_back();
  const auto& target_surface = model_.surfaces[static_cast<std::size_t>(target)];
  pair.number = number;
  pair.base = base, pair.target = target;
  pair.kind = &model_.pairs.kind(base, target);
  pair.contact.rebind(model_.surfaces[static_cast<std::size_t>(base)], target_surface, pair.kind->law,
                      model_.field(target, pair.kind->depth));
  pair.known = pair.uncounted = pair.still = pair.frozen = pair.deep = false;
  pair.deep_m = 0.25 * target_surface->wall_m();
  pair.made = pair.skipped = pair.apart = 0;
  set_friction(pair);
  return pair;
}

void ContactPool::give_back(PairContact& pair) {
  pair.still = pair.frozen = false;
  pair.peak.history.forget();
  pair.contact.release();
  if (!pair.contact.has_search() && pair.contact.springs().empty()) {
    drop(pair);
    return;
  }
  pair.given_back = ++given_back_;
  kept_.insert(place_of(kept_, pair.number), &pair);
  if (kept_.size() <= most_kept_) return;
  // Springs are state; buffers are not.
  auto oldest = kept_.end();
  for (auto i = kept_.begin(); i != kept_.end(); ++i)
    if ((*i)->contact.springs().empty() &&
        (oldest == kept_.end() || (*i)->given_back < (*oldest)->given_back))
      oldest = i;
  if (oldest == kept_.end()) return;
  PairContact& dropped = **oldest;
  kept_.erase(oldest);
  drop(dropped);
}

void ContactPool::drop(PairContact& pair) {
  earlier_.made += pair.made;
  earlier_.skipped += pair.skipped;
  earlier_.boxes_apart += pair.apart;
  earlier_.rebuilds += pair.contact.counts().rebuilds;
  earlier_.elements += pair.contact.counts().elements;
  const auto of = [this](int component) { return model_.surfaces[static_cast<std::size_t>(component)]; };
  pair.contact.rebind(of(pair.base), of(pair.target), pair.kind->law);
  pair.number = PairTable::kNone;
  free_.push_back(&pair);
}

void ContactPool::update_friction(std::span<const BodyHeat> heat) {
  if (!depends_on_heat_) return;
  heat_.assign(heat.begin(), heat.end());
  for_each([this](PairContact& pair) { set_friction(pair); });
}

void ContactPool::set_friction(PairContact& pair) const {
  const std::vector<std::array<double, 2>>& table = pair.kind->friction_at_K;
  if (table.empty() || heat_.empty()) return;
  const double T = std::max(heat_[static_cast<std::size_t>(pair.base)].temperature_K,
                            heat_[static_cast<std::size_t>(pair.target)].temperature_K);
  std::size_t i = 1;
  while (i < table.size() && table[i][0] < T) ++i;
  double friction = T <= table.front()[0] ? table.front()[1] : table.back()[1];
  if (T > table.front()[0] && i < table.size()) {
    const auto& [from, to] = std::pair{table[i - 1], table[i]};
    friction = from[1] + (to[1] - from[1]) * (T - from[0]) / (to[0] - from[0]);
  }
  if (friction == pair.contact.law().friction) return;
  pair.contact.set_friction(friction);
  pair.known = pair.frozen = false;
}

void ContactPool::reset_counts() {
  earlier_.made = earlier_.skipped = earlier_.boxes_apart = 0;
  for_each([](PairContact& pair) { pair.made = pair.skipped = pair.apart = 0; });
}

ContactCallCounts ContactPool::counts() const {
  ContactCallCounts counts = earlier_;
  for_each([&counts](const PairContact& pair) {
    counts.made += pair.made;
    counts.skipped += pair.skipped;
    counts.boxes_apart += pair.apart;
    counts.rebuilds += pair.contact.counts().rebuilds;
    counts.elements += pair.contact.counts().elements;
  });
  return counts;
}

std::size_t ContactPool::with_buffers() const {
  std::size_t count = 0;
  for (const auto& pair : made_) count += pair->contact.has_search() ? 1 : 0;
  return count;
}

}  // namespace takt
