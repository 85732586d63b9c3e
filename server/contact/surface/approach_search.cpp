#include "server/contact/surface/approach_search.h"

#include <algorithm>
#include <cmath>

#include "server/geometry/surface/contact_surface_data.h"

namespace takt {
namespace {

/// No point of the box is further from this one.
double farthest_m(const Aabb& box, const Vec3& p) {
  return (p - box.lower).cwiseAbs().cwiseMax((box.upper - p).cwiseAbs()).norm();
}

BroadPhase::Speed speed_of(const BodyMotion& body, double radius_m) {
  return {body.V_WB.v.norm(), body.V_WB.w.norm(), radius_m};
}

}  // namespace

ApproachSearch::ApproachSearch(std::size_t component_count, const ContactModel& model)
    : model_(model), radius_m_(component_count, 0.0), boxes_(component_count), tree_(component_count) {
  found_.reserve(component_count);
  for (std::size_t c = 0; c < std::min(component_count, model.surfaces.size()); ++c) {
    if (model.surfaces[c] == nullptr) continue;
    radius_m_[c] = farthest_m(model.surfaces[c]->bounds_B(), Vec3::Zero());
  }
}

Aabb ApproachSearch::world_box(const ContactSurface& surface, const Pose& X_WB) {
  return surface.data().box.at(X_WB, 0.0);
}

void ApproachSearch::follow(const CellMotion& motion) {
  for (std::size_t c = 0; c < boxes_.size(); ++c) {
    const Pose& X = motion.bodies[c].X_WB;
    const bool surface = c < model_.surfaces.size() && model_.surfaces[c] != nullptr;
    boxes_[c] = surface ? world_box(*model_.surfaces[c], X) : Aabb{X.p, X.p};
  }
  if (!begun_) tree_.build(boxes_);
  for (std::size_t c = 0; c < boxes_.size(); ++c) {
    if (begun_) tree_.update(static_cast<int>(c), boxes_[c]);
    tree_.set_speed(static_cast<int>(c), speed_of(motion.bodies[c], radius_m_[c]));
  }
  begun_ = true;
}

void ApproachSearch::follow(const CellMotion& motion, std::span<const int> components) {
  for (const int component : components) {
    const auto c = static_cast<std::size_t>(component);
    if (c >= model_.surfaces.size() || model_.surfaces[c] == nullptr) continue;
    boxes_[c] = world_box(*model_.surfaces[c], motion.bodies[c].X_WB);
    tree_.update(component, boxes_[c]);
    tree_.set_speed(component, speed_of(motion.bodies[c], radius_m_[c]));
  }
}

std::span<const int> ApproachSearch::find(int component, const CellMotion& motion, double step_s) {
  constexpr double kRounding = 1.0 + 1e-9;
  const auto c = static_cast<std::size_t>(component);
  const Vec3& p = motion.bodies[c].X_WB.p;
  const BroadPhase::Speed own = speed_of(motion.bodies[c], radius_m_[c]);
  found_.clear();
  // Of a pair with distance D between the origins, no point of one side, the Base, is faster relative to the other than
  // |v1 - v2| + |w2| D + |w1 - w2| r1, whichever of the two that is.
  tree_.find_if(
      [&](const Aabb& box, const BroadPhase::Speed& others) {
        const double gap = gap_m(boxes_[c], box);
        if (!(gap > reach_m(step_s, 0.0))) return true;
        const double origins_m = farthest_m(box, p) + others.radius_m;
        const double speed =
            own.linear_m_per_s + others.linear_m_per_s +
            std::max(own.angular_rad_per_s, others.angular_rad_per_s) * origins_m +
            (own.angular_rad_per_s + others.angular_rad_per_s) * std::max(own.radius_m, others.radius_m);
        return !(gap > kRounding * reach_m(step_s, speed));
      },
      found_);
  return found_;
}

}  // namespace takt
