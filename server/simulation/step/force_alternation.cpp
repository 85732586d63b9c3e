#include "server/simulation/step/force_alternation.h"

#include <algorithm>
#include <limits>

#include "plant_models/state_bytes.h"

namespace takt {

namespace {
constexpr int kReversals = 20;     // in succession: excludes impacts and resolved vibrations
constexpr double kOfWeight = 0.2;  // least change that counts
constexpr double kSameSize = 0.5;  // a decaying vibration loses more from step to step
}  // namespace

ForceAlternation::ForceAlternation(const CellModel& model)
    : model_(model), tracks_(model.parts.size()), forces_W_(model.components.size(), Vec3::Zero()) {
  found_.reserve(model.parts.size());
}

void ForceAlternation::reset() {
  std::fill(tracks_.begin(), tracks_.end(), Track{});
  found_.clear();
}

void ForceAlternation::pause() {
  found_.clear();
  for (Track& track : tracks_) track.known = false, track.reversals = 0;
}

bool ForceAlternation::reverses(Track& track, const Vec3& force_W, double least_N) const {
  const Vec3 change_W = track.known ? Vec3(force_W - track.force_W) : Vec3(Vec3::Zero());
  const double size_N = change_W.norm(), before_N = track.change_W.norm();
  const bool reversed = size_N > least_N && before_N > least_N && size_N > kSameSize * before_N &&
                        change_W.dot(track.change_W) < -0.5 * size_N * before_N;
  track.reversals = reversed ? track.reversals + 1 : 0;
  track.force_W = force_W, track.change_W = change_W, track.known = true;
  return track.reversals >= kReversals;
}

void ForceAlternation::update(double t, std::uint64_t step, const CellMotion& motion,
                              ContactInteraction& contacts) {
  found_.clear();
  std::fill(forces_W_.begin(), forces_W_.end(), Vec3::Zero());
  contacts.add_forces(motion, forces_W_);
  const double gravity = std::max(model_.interaction.gravity_W.norm(), 1.0);
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    const auto body = static_cast<std::size_t>(model_.parts[i].body);
    Track& track = tracks_[i];
    if (contacts.is_asleep(model_.parts[i].body)) {  // its force stays the same
      track.change_W.setZero();
      track.reversals = 0;
      continue;
    }
    const double least_N = kOfWeight * model_.parts[i].mass_kg * gravity;
    if (!reverses(track, forces_W_[body], least_N) || track.reported) continue;
    track.reported = true;
    found_.push_back({t, step, model_.parts[i].body, contacts.heaviest_on(model_.parts[i].body, motion),
                      track.change_W.norm()});
  }
}

void ForceAlternation::save(StateWriter& out) const {
  for (const Track& track : tracks_) {
    out.put(track.force_W), out.put(track.change_W), out.put(track.reversals);
    out.put(track.known), out.put(track.reported);
  }
}

void ForceAlternation::load(StateReader& in) {
  for (Track& track : tracks_) {
    track.force_W = in.vector("a contact force");
    track.change_W = in.vector("a change of a contact force");
    track.reversals = in.integer<int>(0, std::numeric_limits<int>::max(), "reversals of a contact force");
    track.known = in.flag("'a contact force is known'");
    track.reported = in.flag("'an alternating force was reported'");
  }
  found_.clear();
}

}  // namespace takt
