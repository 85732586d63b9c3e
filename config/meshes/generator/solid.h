#pragma once
// Closed meshes with round shapes: coordinates are metres, written as whole nanometres in single precision.
// (Shapes whose corners lie on whole micrometres are a LatticeMesh.)
#include <array>
#include <cstdint>
#include <functional>
#include <iosfwd>
#include <string>
#include <utility>
#include <vector>

#include "plant_models/spatial.h"

namespace takt::meshes {

/// One object of an OBJ file; triangles counter-clockwise seen from outside.
struct Solid {
  std::string name;
  std::vector<Vec3> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// Where column `column` of row `row` of a grid lies.
using GridPoint = std::function<Vec3(int row, int column)>;

/// A grid around a tube: columns are closed to a ring, `columns` of them; rows run along it. If `closed`, the
/// last row is followed by the first one (a ring); else the tube ends in `first_pole` and `last_pole`, each
/// joined to its row by a fan. Seen from outside with rows upwards, columns run to the right.
struct TubeGrid {
  int rows = 0;
  int columns = 0;
  bool closed = false;
  Vec3 first_pole = Vec3::Zero(), last_pole = Vec3::Zero();
};
Solid make_tube(const std::string& name, const TubeGrid& grid, const GridPoint& point);

/// (radius, z) of a profile.
using ProfilePoint = std::array<double, 2>;
using Profile = std::vector<ProfilePoint>;

/// The profile with each of its lines cut into equal pieces of about `edge` (m).
Profile subdivided(const Profile& profile, double edge, bool closed);

/// The profile turned about z, with `facets` flats instead of circles. Radii are those over the flats, so
/// that bodies with equally many facets keep their clearance exactly; one flat faces +x. An open profile
/// begins and ends on the axis and runs upwards outside; a closed one runs counter-clockwise in (radius, z).
Solid make_revolved(const std::string& name, const Profile& profile, bool closed, int facets);

/// The solid without triangles that have lost their area, for example between two coinciding grid lines: the
/// ends of edges shorter than the written resolution (1 nm) become one corner. Unchanged without such
/// triangles.
Solid collapsed(Solid solid);

/// Writes the object as OBJ in metres, each line of `header` as a comment first.
void write_obj(std::ostream& out, const std::vector<std::string>& header, const Solid& solid);
/// The same with several objects.
void write_obj(std::ostream& out, const std::vector<std::string>& header, const std::vector<Solid>& solids);

}  // namespace takt::meshes
