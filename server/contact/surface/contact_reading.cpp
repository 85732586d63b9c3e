// What reports read of surface contact.
#include <algorithm>

#include "server/contact/surface/contact_interaction.h"

namespace takt {

ContactSample ContactInteraction::sample_of(const PairContact& pair, const ContactResult& result,
                                            const Pose& X_WT) {
  ContactSample sample;
  sample.base = pair.base;
  sample.target = pair.target;
  sample.result = result;
  sample.p_WC = X_WT * result.p_TC;
  sample.F_base_W = to_world(result.F_B_T, X_WT.R);
  sample.F_base_W.t -= (sample.p_WC - X_WT.p).cross(sample.F_base_W.f);
  return sample;
}

std::size_t ContactInteraction::read(const CellMotion& motion, std::span<ContactSample> samples) {
  std::size_t count = 0;
  for (PairContact* const present : present_) {
    PairContact& pair = *present;
    look_at_pair(pair, motion);
    if (pair.result.elements == 0) continue;
    if (count++ >= samples.size()) continue;
    samples[count - 1] = sample_of(pair, pair.result, body(motion, pair.target).X_WB);
  }
  return count;
}

void ContactInteraction::read_peaks(const CellMotion& motion, std::vector<ContactPeak>& peaks) {
  peaks.clear();
  for (PairContact* const present : present_) {
    PairContact& pair = *present;
    look_at_pair(pair, motion);
    const Pose& X_WT = body(motion, pair.target).X_WB;
    if (watches_peaks_ && !pair.still) pair.note_peak(updates_, motion.time_s, X_WT);
    const PairContact::Peak& peak = pair.peak;
    if (peak.update == updates_ && peak.result.normal_force_N > pair.result.normal_force_N)
      peaks.push_back({peak.time_s, sample_of(pair, peak.result, peak.X_WT)});
    else if (pair.result.elements > 0)
      peaks.push_back({motion.time_s, sample_of(pair, pair.result, X_WT)});
  }
}

void ContactInteraction::add_forces(const CellMotion& motion, std::span<Vec3> forces_W) {
  for (PairContact* const moving : moving_) {
    PairContact& pair = *moving;
    look_at_pair(pair, motion);
    if (pair.result.elements == 0) continue;
    const Vec3 f_W = body(motion, pair.target).X_WB.R * pair.result.F_B_T.f;
    forces_W[static_cast<std::size_t>(pair.base)] += f_W;
    forces_W[static_cast<std::size_t>(pair.target)] -= f_W;
  }
}

int ContactInteraction::heaviest_on(int component, const CellMotion& motion) {
  int heaviest = -1;
  double most_N = 0.0;
  for (PairContact* const present : present_) {
    PairContact& pair = *present;
    if (pair.base != component && pair.target != component) continue;
    look_at_pair(pair, motion);
    if (pair.result.elements == 0 || pair.result.F_B_T.f.norm() <= most_N) continue;
    most_N = pair.result.F_B_T.f.norm();
    heaviest = pair.base == component ? pair.target : pair.base;
  }
  return heaviest;
}

void ContactInteraction::read(const CellMotion& motion, std::vector<ContactSample>& samples) {
  samples.resize(present_.size());
  samples.resize(read(motion, std::span<ContactSample>(samples)));
}

std::vector<ElementPressure> ContactInteraction::pressures(std::size_t pair, const CellMotion& motion) {
  const ContactPairModel ends = model_.pairs[pair];
  const RelativeMotion now = motion_of(ends.base, ends.target, motion);
  for (PairContact* const present : present_)
    if (present->number == pair) return present->contact.pressures(now);
  const auto surface = [this](int component) { return model_.surfaces[static_cast<std::size_t>(component)]; };
  return PolygonalContact(surface(ends.base), surface(ends.target), ends.law,
                          model_.field(ends.target, ends.depth))
      .pressures(now);
}

void ContactInteraction::list_pushed(const CellMotion& motion, int component, const Vec3& direction_W,
                                     std::vector<int>& others) {
  constexpr double kLeastShare = 0.5;
  others.clear();
  for (PairContact* const present : present_) {
    PairContact& pair = *present;
    if (pair.base != component && pair.target != component) continue;
    evaluate_pair(pair, motion);
    if (pair.result.elements == 0) continue;
    const bool is_base = pair.base == component;
    const Vec3 on_base_W = body(motion, pair.target).X_WB.R * pair.result.F_B_T.f;
    const Vec3 on_other_W = is_base ? Vec3(-on_base_W) : on_base_W;
    if (on_other_W.dot(direction_W) <= kLeastShare * on_other_W.norm()) continue;
    others.push_back(is_base ? pair.target : pair.base);
  }
  std::sort(others.begin(), others.end());
}

}  // namespace takt
