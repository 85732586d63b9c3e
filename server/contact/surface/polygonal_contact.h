#pragma once
// Polygonal Contact Model between two closed triangle meshes, convex or not (thesis 2.2.2 and 4.3; Hippmann
// 2004, 2024): elements of the Base's surface press into the Target's surface; each is a spring, damper and
// friction element by (2.17) to (2.21).
//
// The penetration u of an element is the distance of its centroid, if it is inside, from the closest point of
// the Target's surface, and its force acts along the Target's normal at that point: without friction and
// damping, the wrench of a pair is minus the gradient of one energy of the relative pose, sum (K/b) A u^2 /
// 2, for any meshes (docs/theory.md). u is continuous for any motion.
//
// With a distance field of the Target (FieldElements) u and the direction come from that instead, and no motion is held.
//
// Between hold() and release() the elements near contact, and the faces that they pass over, are those of one
// search for a piece of the motion (HeldPatch); further away they are searched as without.
//
// B is the frame of the Base, T that of the Target. Results are functions of pose, twist, stick anchors and
// what is held alone: caches between calls (candidate lists, valid while a motion bound holds) change no bit. An object
// must be used by one thread at a time. After warm-up it does not allocate.
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "plant_models/plant_model.h"
#include "server/contact/pair_linearisation.h"
#include "server/contact/surface/contact_law.h"
#include "server/contact/surface/contact_springs.h"
#include "server/geometry/surface/contact_surface.h"
#include "server/geometry/surface/distance_field.h"

namespace takt {

/// Motion of the Base relative to the Target: pose, and twist of the origin of B in the axes of T. If the surface of the Target
/// moves in itself (a belt), friction acts between the Base and the material S of the surface.
struct RelativeMotion {
  Pose X_TB;
  Twist V_TB_T;
  bool surface_moves = false;
  Pose X_TS{};     ///< of the material, where it moves
  Twist V_TS_T{};  ///< of the material relative to the Target, at the origin of T

  void move_surface(const SurfaceMotion& surface) {
    surface_moves = true;
    X_TS = surface.X_TS;
    V_TS_T = surface.V_TS_T;
  }
};
/// From the motions of base and target in the world.
RelativeMotion relative_motion(const Pose& X_WB, const Twist& V_WB, const Pose& X_WT, const Twist& V_WT);

/// Bit for bit, including the sign of a zero: reuse must not change a result.
bool same_bits(const RelativeMotion& a, const RelativeMotion& b);

/// The motion along which a patch is held, and for how long at most.
struct HeldFrom {
  RelativeMotion motion;
  double most_s = 0.0;
};

struct ContactResult {
  Wrench F_B_T;          ///< on the Base about the origin of T, axes of T; the Target gets the negative
  int elements = 0;      ///< with force
  double area_m2 = 0.0;  ///< of those
  double normal_force_N = 0.0;  ///< sum of all elements'
  double friction_force_N = 0.0;
  double largest_pressure_Pa = 0.0;
  double largest_penetration_m = 0.0;
  double elastic_energy_J = 0.0;  ///< sum (K/b) A u^2 / 2
  Vec3 p_TC = Vec3::Zero();       ///< centre of pressure; zero without pressure
};

/// About the origin of T, axes of T; see PairLinearisation.
struct ContactJacobian {
  Mat6 K = Mat6::Zero(), D = Mat6::Zero();
};

/// One element with force, for pictures.
struct ElementPressure {
  int element = -1;  ///< of the Base's surface
  Vec3 p_B = Vec3::Zero();
  double area_m2 = 0.0, penetration_m = 0.0, pressure_Pa = 0.0;
};

struct ContactCounts {
  std::uint64_t evaluations = 0;
  std::uint64_t rebuilds = 0;  ///< of the candidate lists
  std::uint64_t searches = 0;  ///< for elements in or near contact
  std::uint64_t elements = 0;  ///< with force, over all evaluations
};

class PolygonalContact {
 public:
  /// `field`: of the Target, from which depths come; nullptr: from its triangles.
  PolygonalContact(std::shared_ptr<const ContactSurface> base, std::shared_ptr<const ContactSurface> target,
                   const ContactLaw& law, const std::shared_ptr<const DistanceField>& field = nullptr);
  ~PolygonalContact();
  PolygonalContact(PolygonalContact&&) noexcept;
  PolygonalContact& operator=(PolygonalContact&&) noexcept;

  /// Becomes the new contact of another pair, without allocation.
  void rebind(const std::shared_ptr<const ContactSurface>& base,
              const std::shared_ptr<const ContactSurface>& target, const ContactLaw& law,
              const std::shared_ptr<const DistanceField>& field = nullptr);
  /// Whether the bounds of the two have ever met. Until then an object is small, and no evaluation allocates.
  bool has_search() const;

  void evaluate(const RelativeMotion& motion, ContactResult& result);
  void evaluate(const RelativeMotion& motion, Linearisation linearisation, ContactResult& result,
                ContactJacobian& jacobian);

  /// True if the Target is curved, so that a search costs far more than an evaluation: hold() has an effect.
  bool can_hold() const;
  /// Discrete, at an accepted point: holds the patch of the straight motion from here on, unless what is held
  /// covers the next `next_s` of it. True if it is another patch now.
  bool hold(const RelativeMotion& motion, double next_s);
  /// From which the patch that is held follows, for snapshots, and its counterpart; null: none is held.
  const HeldFrom* held_from() const;
  void hold_from(const HeldFrom& from);
  void release();

  /// Discrete, at an accepted point, stick law only: springs stretched beyond the slip limit relax to it,
  /// elements without contact lose theirs, new ones begin with the present friction. True if any spring is stored.
  bool accept(const RelativeMotion& motion);
  /// Discards all springs (and candidate lists).
  void reset();
  /// Result of accept() as numbers, for snapshots: per stretched element its number and displacement.
  std::vector<double> save() const;
  /// The stored springs, by element, ascending.
  std::span<const ContactSpring> springs() const;
  /// Throws std::invalid_argument for numbers that are not a result of save().
  void restore(std::span<const double> kept);

  std::vector<ElementPressure> pressures(const RelativeMotion& motion);
  /// Thickness of the Target at the deepest element (m), if that element has passed kPassing of it, else 0.
  /// Beyond half of the thickness contact pushes the element out on the far side.
  double passed_wall_m(const RelativeMotion& motion);
  static constexpr double kPassing = 0.44;
  /// Share of the thinner wall of both bodies up to which the contact law is linear
  /// (ContactLaw::linear_depth_m).
  static constexpr double kLinearShare = 0.15;
  const ContactCounts& counts() const;
  const ContactLaw& law() const;
  /// Discrete: sets another coefficient of friction, >= 0.
  void set_friction(double friction);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace takt
