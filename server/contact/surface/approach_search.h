#pragma once
// Which components may come near one in a step: a tree of their bounds with their speeds (geometry/broad_phase.h).
// Its cost follows the components that move, not the pairs that exist.
#include <span>
#include <vector>

#include "plant_models/plant_model.h"
#include "server/contact/surface/contact_model.h"
#include "server/geometry/broad_phase.h"

namespace takt {

class ApproachSearch {
 public:
  /// Bodies are taken to be at least so fast, and the present speeds may grow by a factor within a step.
  static constexpr double kFastest_m_per_s = 10.0, kFaster = 2.0;

  ApproachSearch(std::size_t component_count, const ContactModel& model);

  /// Sets the places and speeds of all components.
  void follow(const CellMotion& motion);
  /// The same for components that may have moved.
  void follow(const CellMotion& motion, std::span<const int> components);
  /// World box of the component's surface, where it was followed to.
  const Aabb& box(int component) const { return boxes_[static_cast<std::size_t>(component)]; }
  /// No point of the component's surface is further from its origin (m); 0 without surface.
  double radius_m(int component) const { return radius_m_[static_cast<std::size_t>(component)]; }
  /// The components, in no certain order, that come nearer than reach_m() by their bounds, and some more. Valid until
  /// the next call; does not allocate.
  std::span<const int> find(int component, const CellMotion& motion, double step_s);

  static double reach_m(double step_s, double speed_m_per_s) {
    return step_s * std::max(kFastest_m_per_s, kFaster * speed_m_per_s);
  }
  static double gap_m(const Aabb& a, const Aabb& b) {
    return (a.lower - b.upper).cwiseMax(b.lower - a.upper).maxCoeff();
  }
  static Aabb world_box(const ContactSurface& surface, const Pose& X_WB);

 private:
  const ContactModel& model_;
  std::vector<double> radius_m_;
  std::vector<Aabb> boxes_;
  BroadPhase tree_;
  bool begun_ = false;  ///< the tree contains all components
  std::vector<int> found_;
};

}  // namespace takt
