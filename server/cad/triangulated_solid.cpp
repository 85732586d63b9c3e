#include "server/cad/triangulated_solid.h"

#include <BRepMesh_IncrementalMesh.hxx>
#include <BRepTools.hxx>
#include <BRep_Tool.hxx>
#include <Poly_Triangulation.hxx>
#include <ShapeFix_Shape.hxx>
#include <ShapeUpgrade_ShapeDivideClosed.hxx>
#include <Standard_Failure.hxx>
#include <TopExp_Explorer.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Face.hxx>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <tuple>
#include <unordered_map>
#include <utility>

#include "server/cad/sewn_solids.h"
#include "server/cad/vectors.h"
#include "server/product/fill_holes.h"

namespace takt::cad {

namespace {

constexpr double kWeld_mm = 1e-5;  ///< vertices closer than this are one

/// Numbers positions (mm); those within the welding distance have one number.
class Welder {
 public:
  explicit Welder(std::vector<Vec3>& vertices) : vertices_(vertices) {}
  std::uint32_t number(const Vec3& p) {
    const Cell home = cell(p);
    for (std::int64_t x = -1; x <= 1; ++x)
      for (std::int64_t y = -1; y <= 1; ++y)
        for (std::int64_t z = -1; z <= 1; ++z) {
          const auto [first, last] =
              cells_.equal_range(hash({std::get<0>(home) + x, std::get<1>(home) + y, std::get<2>(home) + z}));
          for (auto it = first; it != last; ++it)
            if ((vertices_[it->second] - p).norm() < kWeld_mm) return it->second;
        }
    vertices_.push_back(p);
    const auto index = static_cast<std::uint32_t>(vertices_.size() - 1);
    cells_.emplace(hash(home), index);
    return index;
  }

 private:
  using Cell = std::tuple<std::int64_t, std::int64_t, std::int64_t>;
  static Cell cell(const Vec3& p) {
    const auto part = [](double x) { return static_cast<std::int64_t>(std::floor(x / (4 * kWeld_mm))); };
    return {part(p.x()), part(p.y()), part(p.z())};
  }
  static std::uint64_t hash(const Cell& c) {
    std::uint64_t h = 1469598103934665603ULL;
    for (const std::int64_t part : {std::get<0>(c), std::get<1>(c), std::get<2>(c)})
      h = (h ^ static_cast<std::uint64_t>(part)) * 1099511628211ULL;
    return h;
  }
  std::vector<Vec3>& vertices_;
  std::unordered_multimap<std::uint64_t, std::uint32_t> cells_;
};

/// The triangles of all faces, welded (mm).
void collect_mesh(const TopoDS_Shape& solid, TriangleMesh& mesh, std::vector<int>& triangle_faces) {
  Welder welder(mesh.vertices);
  int index = 0;
  for (TopExp_Explorer at(solid, TopAbs_FACE); at.More(); at.Next(), ++index) {
    const TopoDS_Face& face = TopoDS::Face(at.Current());
    TopLoc_Location place;
    const Handle(Poly_Triangulation) triangles = BRep_Tool::Triangulation(face, place);
    if (triangles.IsNull()) continue;
    std::vector<std::uint32_t> numbers;
    for (int i = 1; i <= triangles->NbNodes(); ++i)
      numbers.push_back(welder.number(vector(triangles->Node(i).Transformed(place.Transformation()).XYZ())));
    const bool turned = (face.Orientation() == TopAbs_REVERSED) != place.Transformation().IsNegative();
    for (int i = 1; i <= triangles->NbTriangles(); ++i) {
      int a = 0, b = 0, c = 0;
      triangles->Triangle(i).Get(a, b, c);
      TriangleMesh::Triangle t{numbers[static_cast<std::size_t>(a - 1)],
                               numbers[static_cast<std::size_t>(b - 1)],
                               numbers[static_cast<std::size_t>(c - 1)]};
      if (turned) std::swap(t[1], t[2]);
      if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) continue;
      mesh.triangles.push_back(t);
      triangle_faces.push_back(index);
    }
  }
}

/// Ways of meshing. All keep `deflection_mm`; a coarser angle changes small radii only.
enum class Way { as_it_is, closed_faces_divided, finer, coarser_in_angle, mended, sewn };
constexpr std::array kWays{
    Way::as_it_is, Way::closed_faces_divided, Way::finer, Way::coarser_in_angle, Way::mended, Way::sewn};

TopoDS_Shape prepared(const TopoDS_Shape& solid, Way way, double& sewn_gap_mm) {
  switch (way) {
    case Way::closed_faces_divided: {
      ShapeUpgrade_ShapeDivideClosed divide(solid);
      divide.SetNbSplitPoints(1);
      divide.Perform();
      return divide.Result();
    }
    case Way::mended: {
      ShapeFix_Shape fix(solid);
      fix.Perform();
      return fix.Shape();
    }
    case Way::sewn: {
      const SewnSolids solids = sew({solid});
      sewn_gap_mm = solids.largest_gap_mm;
      return solids.solids.size() == 1 && solids.left == 0 ? solids.solids.front() : TopoDS_Shape();
    }
    default:
      return solid;
  }
}

/// Meshes the faces that have no mesh as near as this, and collects all.
void finish(TriangulatedSolid& result, double deflection_mm, double angle_rad) {
  const BRepMesh_IncrementalMesh mesher(result.shape, deflection_mm, false, angle_rad, false);
  collect_mesh(result.shape, result.mesh, result.triangle_faces);
  result.open_edges = product::open_edges(result.mesh);
}

TriangulatedSolid attempt(const TopoDS_Shape& solid, Way way, double deflection_mm, double angle_rad) {
  TriangulatedSolid result;
  result.shape = prepared(solid, way, result.sewn_gap_mm);
  if (result.shape.IsNull()) return result;
  if (way == Way::finer) deflection_mm *= 0.5;
  if (way == Way::coarser_in_angle) angle_rad *= 2.5;
  BRepTools::Clean(result.shape);
  finish(result, deflection_mm, angle_rad);
  return result;
}

}  // namespace

TriangulatedSolid triangulate(const TopoDS_Shape& solid, double deflection_mm, double angle_rad) {
  TriangulatedSolid best;
  for (const Way way : kWays) {
    TriangulatedSolid one;
    try {
      one = attempt(solid, way, deflection_mm, angle_rad);
    } catch (const Standard_Failure&) {
      continue;  // this way does not suit the solid
    }
    if (one.mesh.triangles.empty()) continue;
    if (best.mesh.triangles.empty() || one.open_edges < best.open_edges) best = std::move(one);
    if (best.open_edges == 0) break;
  }
  return best;
}

TriangulatedSolid triangulate_faces(const TopoDS_Shape& solid, double deflection_mm, double angle_rad,
                                    const std::vector<double>& face_deflections_mm) {
  TriangulatedSolid result;
  result.shape = solid;
  BRepTools::Clean(solid);
  std::size_t index = 0;
  for (TopExp_Explorer at(solid, TopAbs_FACE); at.More() && index < face_deflections_mm.size();
       at.Next(), ++index)
    if (face_deflections_mm[index] > 0.0)
      const BRepMesh_IncrementalMesh mesher(at.Current(), face_deflections_mm[index], false, angle_rad,
                                            false);
  finish(result, deflection_mm, angle_rad);  // what is finer stays
  return result;
}

}  // namespace takt::cad
