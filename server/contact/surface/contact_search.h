#pragma once
// Finds the elements of the Base that are in contact at a pose. The search descends into the tree of the
// Base's clusters where neither the octree of the Target's faces nor a free region keeps a cluster out of
// contact: clusters beside the Target, or sliding along a flat of it, cost a few tests. Inside solid regions
// penetrations follow from the planes. Elsewhere they follow from the faces that the octree lists, or, where
// the Base moves slowly, from candidate lists that hold for many poses.
//
// Regions and lists change no bit: depths below a patch are always computed from its plane in the frame of the Base,
// and where rounding might decide between two faces the faces themselves are tested.
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "server/contact/surface/contact_candidates.h"
#include "server/contact/surface/contact_depths.h"
#include "server/contact/surface/face_depths.h"
#include "server/contact/surface/held_patch.h"
#include "server/contact/surface/separating_planes.h"

namespace takt {

class ContactSearch {
 public:
  ContactSearch(const ContactSurface::Data& base, const ContactSurface::Data& target);
  ~ContactSearch();

  /// `X_BT`: the inverse of X_TB. True if a region was searched or a list was made.
  bool find(const Pose& X_TB, const Pose& X_BT);
  void forget();
  /// Finds the elements that are or come into contact during a motion. The Target must have an octree. Changes
  /// nothing that find() keeps.
  void find(const HeldMotion& motion, HeldPatch& patch) const;

  /// Elements whose centroid is inside the Target, ascending.
  std::span<const std::int32_t> elements() const { return {elements_.data(), hits_}; }
  /// Penetrations of the same elements.
  std::span<const double> depths_m() const { return {depths_m_.data(), hits_}; }
  /// Outward normal of the Target at the point closest to the centroid.
  const Vec3& normal_B(std::size_t hit) const { return normals_[static_cast<std::size_t>(normal_[hit])]; }
  /// An element whose closest point is on an edge, or on a vertex (edge_B zero).
  struct Bend {
    std::size_t hit;
    Vec3 edge_B;
  };
  std::span<const Bend> bends() const { return bends_; }

 private:
  struct Planes;
  struct Open;
  /// Of a cluster.
  struct State {
    double quiet_until_m = -1.0;  ///< travelled length up to which no element is in contact
    std::uint32_t uses = 0;       ///< visits since the last search for a region
    std::uint32_t wait = 0;       ///< visits before the next one
  };

  /// A held motion in pieces.
  struct HeldPath {
    std::array<Pose, HeldPatch::kPieces + 1> X_TB;  ///< at the ends of the pieces
    Twist way_B;                                    ///< displacement of points of the Base, of first order
    std::size_t pieces = 1, least_pieces = 1;
    double margin_m = 0.0, most_inclined_m = 0.0;
  };
  void visit(std::size_t index, const Planes* from);
  bool region_pays(State& state) const;
  void look(std::size_t index, bool leaf);
  bool left(const ContactCluster& cluster, const Planes& planes) const;
  bool solid_leaf(const ContactCluster& cluster, const Planes& planes);
  void open_leaf(std::size_t index, const Planes* planes);
  bool use_lists(Open& open, const ContactCluster& cluster, const Planes* planes);
  void add_from_lists(Open& open, State& state);
  void add_from_faces(const ContactCluster& cluster, State& state);
  void travel(const Pose& X_TB);
  void visit(std::size_t index, HeldPath& path, HeldPatch& patch) const;
  void make_room(std::size_t count);

  const ContactSurface::Data& base_;
  const ContactSurface::Data& target_;
  PlaneTolerance tolerance_;
  Pose X_TB_, X_BT_;
  bool made_ = false;
  /// Upper bound of the path of any point since the start: most validity tests need only this length and no
  /// poses.
  double travelled_m_ = 0.0;
  std::vector<SeparatingPlanes> regions_;  ///< per cluster
  std::vector<State> states_;              ///< per cluster
  FaceDepths faces_;
  double first_bound_m_;
  std::vector<std::unique_ptr<Open>> opened_;  ///< per cluster, where a leaf is open
  ContactCandidates::Work work_;

  std::size_t hits_ = 0;
  std::vector<std::int32_t> elements_, normal_;  ///< longer than there are hits
  std::vector<double> depths_m_;
  std::vector<Vec3> normals_;
  std::vector<Bend> bends_;
};

}  // namespace takt
