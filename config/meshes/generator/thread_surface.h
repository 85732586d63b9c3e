#pragma once
// Threaded surfaces: the profile of a thread wound along a helix of one start, right-handed.
#include <functional>
#include <vector>

#include "config/meshes/generator/mesh_maker.h"

namespace takt::meshes {

// Profiles have the radius over the axis, periodic with the pitch and symmetric about the crest of the bolt at 0, and
// the places where rows of vertices run: in pitches from the crest, ascending within one pitch, the pieces of
// flanks at most `edge` long.

/// The basic profile of ISO 68-1: flanks at 30 degrees to the normal of the axis, flat crests and roots.
class BasicProfile {
 public:
  BasicProfile(double diameter, double pitch, double inwards);
  double radius(double along) const;
  std::vector<double> rows(double edge) const;
  double pitch() const { return pitch_; }
  double root_radius() const { return root_radius_; }

 private:
  double pitch_, crest_radius_, root_radius_;
};

/// Equal arcs for crests and roots that meet tangentially on the flanks, as in IEC 60061 (E14, E27, E40).
class KnuckleProfile {
 public:
  KnuckleProfile(double crest_radius, double root_radius, double pitch);
  double radius(double along) const;
  std::vector<double> rows(double edge) const;
  double arc_radius() const { return arc_radius_; }

 private:
  double crest_radius_, root_radius_, pitch_, arc_radius_;
};

/// A surface with its lower end at `from` in z and `height` above it; the crest is at angle 0 and z = from.
struct ThreadSurface {
  double pitch = 0.0, from = 0.0, height = 0.0;
  int columns = 0;           ///< vertices around
  std::vector<double> rows;  ///< of the profile
  bool outwards = true;      ///< of a bolt; else of a nut
};
/// Lower and upper ring of the surface. `radius(along, z)`: `along` is z less the rise of the helix, both from
/// the lower end.
struct ThreadEnds {
  Ring lower, upper;
};
ThreadEnds add_thread(MeshMaker& maker, const ThreadSurface& surface,
                      const std::function<double(double along, double z)>& radius);
/// A bolt's thread from z = 0 to `length`, chamfered at 45 degrees to below the root, with its flat end. Returns the
/// lower ring.
Ring add_bolt_thread(MeshMaker& maker, const BasicProfile& profile, double length, int columns, double edge);

}  // namespace takt::meshes
