#pragma once
// Where a gripper can hold a part: opposite faces for its fingers, or a place that a suction cup seals.
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "server/product/geometry.h"
#include "server/product/robot_plan.h"

namespace takt::product {

/// How a part is held; in the world.
struct Grasp {
  double cup_m = 0.0;  ///< diameter of the suction cup that holds it; 0: the fingers do
  Vec3 out;            ///< from the part towards the tool
  Vec3 jaws;           ///< axis of the jaws
  Vec3 tip;            ///< tool centre point, or lip of the cup
  double width = 0.0, score = 0.0;
};

/// A box with axes of its own; `lower` and `upper` are coordinates along them, from the origin of the world.
struct TurnedBox {
  Mat3 axes;  ///< columns
  Vec3 lower, upper;
  bool meets(const Triangle& triangle) const;
  Aabb box() const;
};

/// What stands in the cell at present.
struct Surroundings {
  std::vector<PlacedInstance> original;  ///< as in the product; with faces
  std::vector<PlacedInstance> now;       ///< triangles and boxes where they are at present
  std::vector<Pose> moved;               ///< by instance: from the product to its present place
  std::vector<std::string> names;        ///< by instance
  std::vector<PlacedInstance> fixed;     ///< the support
  double floor_m = 0.0;                  ///< nothing may be below
  double reach_m = 0.0;                  ///< from inside the product to outside of it
};

/// A removal for which a grasp is wanted.
struct Removing {
  std::size_t held = 0;
  std::set<std::size_t> moving;  ///< `held` among them
  Vec3 direction;
  double way_m = 0.0;
  double mass_kg = 0.0;
};

class GraspSearch {
 public:
  GraspSearch(const Surroundings& around, const GripperSize& gripper) : around_(around), gripper_(gripper) {}

  /// The best grasp whose fingers reach the part, and carry it out, without meeting anything. The tool comes along the
  /// removal, from above or from a side; never from below.
  std::optional<Grasp> by_fingers(const Removing& removing);
  /// The place nearest to the middle of the part that a cup of this diameter seals: its lip lies on the part all around, and
  /// no hole leads through the part within it. The cup comes from above, along the removal, or from a side.
  std::optional<Grasp> by_cup(const Removing& removing, double cup_m);
  /// Why the last search found none: one phrase.
  const std::string& reason() const { return reason_; }

 private:
  std::vector<Vec3> jaw_axes(std::size_t held, const Vec3& out) const;
  std::optional<Grasp> between(const std::vector<Triangle>& upper, std::size_t held, const Vec3& out,
                               const Vec3& jaws, double top, double depth, double at);
  std::vector<TurnedBox> tool_boxes(const Grasp& grasp, const Vec3& by, double longer) const;
  std::string obstacle(const std::vector<TurnedBox>& boxes, const std::set<std::size_t>& without) const;
  bool meets_support(const Removing& removing) const;
  std::vector<Grasp> cup_places(std::size_t held, const Vec3& out, double cup_m) const;
  std::string obstacle_on_the_way(const Grasp& grasp, const Removing& removing) const;

  const Surroundings& around_;
  const GripperSize& gripper_;
  std::string reason_;
  double narrowest_m_ = 0.0;  ///< of what was too wide, in the present search
};

}  // namespace takt::product
