#include "server/cad/solid_mesh.h"

#include <BRepAdaptor_Curve.hxx>
#include <BRepAdaptor_Surface.hxx>
#include <BRepGProp.hxx>
#include <BRep_Tool.hxx>
#include <GProp_GProps.hxx>
#include <TopExp_Explorer.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Edge.hxx>
#include <TopoDS_Face.hxx>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <unordered_map>

#include "idl/common/text.h"
#include "server/cad/triangulated_solid.h"
#include "server/cad/vectors.h"
#include "server/geometry/mesh/repair.h"
#include "server/product/fill_holes.h"
#include "server/product/mesh_faces.h"

namespace takt::cad {

namespace {

using product::Face;
using product::SurfaceKind;

constexpr double kMm = 1e-3;
constexpr double kIntegral =
    1e-7;  ///< relative error of integrals over splines, which rules of fixed order miss by percents

/// Rules of fixed order are exact on these surfaces, and adaptive ones only as near as they are asked for.
bool is_elementary(const TopoDS_Face& face) {
  const GeomAbs_SurfaceType type = BRepAdaptor_Surface(face).GetType();
  return type == GeomAbs_Plane || type == GeomAbs_Cylinder || type == GeomAbs_Cone ||
         type == GeomAbs_Sphere || type == GeomAbs_Torus;
}

double area_mm2(const TopoDS_Face& face) {
  GProp_GProps area;
  if (is_elementary(face))
    BRepGProp::SurfaceProperties(face, area);
  else
    BRepGProp::SurfaceProperties(face, area, kIntegral);
  return area.Mass();
}

GProp_GProps volume_of(const TopoDS_Shape& solid) {
  bool elementary = true;
  for (TopExp_Explorer at(solid, TopAbs_FACE); at.More() && elementary; at.Next())
    elementary = is_elementary(TopoDS::Face(at.Current()));
  GProp_GProps volume;
  if (elementary)
    BRepGProp::VolumeProperties(solid, volume);
  else
    BRepGProp::VolumeProperties(solid, volume, kIntegral);
  return volume;
}

Vec3 point(const gp_Pnt& p) {
  return vector(p.XYZ()) * kMm;
}
Vec3 direction(const gp_Dir& d) {
  return vector(d.XYZ());
}

Face describe_surface(const TopoDS_Face& face) {
  Face result;
  const BRepAdaptor_Surface surface(face);
  const auto axis = [&](const gp_Ax1& a) {
    result.point_B = point(a.Location());
    result.axis_B = direction(a.Direction());
  };
  switch (surface.GetType()) {
    case GeomAbs_Plane:
      result.kind = SurfaceKind::plane;
      axis(surface.Plane().Axis());
      break;
    case GeomAbs_Cylinder:
      result.kind = SurfaceKind::cylinder;
      axis(surface.Cylinder().Axis());
      result.radius_m = surface.Cylinder().Radius() * kMm;
      break;
    case GeomAbs_Cone:
      result.kind = SurfaceKind::cone;
      axis(surface.Cone().Axis());
      result.radius_m = surface.Cone().RefRadius() * kMm;
      break;
    case GeomAbs_Sphere:
      result.kind = SurfaceKind::sphere;
      result.point_B = point(surface.Sphere().Location());
      result.radius_m = surface.Sphere().Radius() * kMm;
      break;
    case GeomAbs_Torus:
      result.kind = SurfaceKind::torus;
      axis(surface.Torus().Axis());
      result.radius_m = surface.Torus().MajorRadius() * kMm;
      break;
    default:
      break;
  }
  result.area_m2 = area_mm2(face) * kMm * kMm;
  return result;
}

/// Exporters write planes and cylinders as splines, too.
void recognise_faces(product::Body& body) {
  for (std::size_t f = 0; f < body.faces.size(); ++f) {
    if (body.faces[f].kind != SurfaceKind::other) continue;
    std::vector<Vec3> vertices, normals;
    for (std::size_t i = 0; i < body.mesh.triangles.size(); ++i) {
      if (body.triangle_faces[i] != static_cast<int>(f)) continue;
      const auto& t = body.mesh.triangles[i];
      for (const std::uint32_t v : t) vertices.push_back(body.mesh.vertices[v]);
      normals.push_back((body.mesh.vertices[t[1]] - body.mesh.vertices[t[0]])
                            .cross(body.mesh.vertices[t[2]] - body.mesh.vertices[t[0]]));
    }
    for (Vec3& n : normals) n = n.norm() > 0.0 ? Vec3(n.normalized()) : n;
    product::recognise(vertices, normals, body.faces[f]);
  }
}

struct Helix {
  Vec3 point, axis;
  double radius_m, pitch_m;
};

/// The helix about this axis that an edge is, of at least half a turn.
std::optional<Helix> helix_of(const TopoDS_Edge& edge, const Vec3& origin, const Vec3& axis) {
  if (BRep_Tool::Degenerated(edge)) return std::nullopt;
  const BRepAdaptor_Curve curve(edge);
  if (curve.GetType() == GeomAbs_Line || curve.GetType() == GeomAbs_Circle) return std::nullopt;
  constexpr int kSamples = 400;
  const Vec3 x = axis.unitOrthogonal(), y = axis.cross(x);
  double turned = 0.0, before = 0.0, r_min = 1e300, r_max = 0.0, z0 = 0.0;
  std::vector<std::pair<double, double>> track;  // angle, height
  for (int i = 0; i <= kSamples; ++i) {
    const double u = curve.FirstParameter() + (curve.LastParameter() - curve.FirstParameter()) * i / kSamples;
    const Vec3 p = point(curve.Value(u)) - origin;
    const double z = p.dot(axis), px = p.dot(x), py = p.dot(y), r = std::hypot(px, py);
    r_min = std::min(r_min, r), r_max = std::max(r_max, r);
    const double angle = std::atan2(py, px);
    if (i == 0) z0 = z;
    if (i > 0) turned += std::remainder(angle - before, 2.0 * std::numbers::pi);
    before = angle;
    track.emplace_back(turned, z - z0);
  }
  if (std::abs(turned) < std::numbers::pi || r_max - r_min > 0.02 * r_max || !(r_max > 1e-6))
    return std::nullopt;
  const double slope = track.back().second / turned;  // m per rad
  if (std::abs(slope) * std::numbers::pi < 1e-5) return std::nullopt;
  for (const auto& [angle, z] : track)
    if (std::abs(z - slope * angle) > 0.05 * std::abs(2.0 * std::numbers::pi * slope)) return std::nullopt;
  return Helix{origin, axis, r_max, slope * 2.0 * std::numbers::pi};
}

/// Axes of the body's cylinders and cones, each once.
std::vector<std::pair<Vec3, Vec3>> axes_of(const product::Body& body) {
  std::vector<std::pair<Vec3, Vec3>> axes;
  for (const Face& face : body.faces) {
    if (face.kind != SurfaceKind::cylinder && face.kind != SurfaceKind::cone) continue;
    const bool known = std::any_of(axes.begin(), axes.end(), [&](const auto& axis) {
      return axis.second.cross(face.axis_B).norm() < 1e-6 &&
             (face.point_B - axis.first).cross(axis.second).norm() < 1e-7;
    });
    if (!known) axes.emplace_back(face.point_B, face.axis_B);
  }
  return axes;
}

/// Faces that a helical edge bounds are flanks, crests and roots of a thread.
void find_threads(const TopoDS_Shape& solid, product::Body& body) {
  const bool any = std::any_of(body.faces.begin(), body.faces.end(),
                               [](const Face& face) { return face.kind == SurfaceKind::other; });
  if (!any) return;
  std::vector<std::pair<Vec3, Vec3>> axes = axes_of(body);
  if (axes.empty()) axes.emplace_back(body.exact.p_BBcm, Vec3::UnitZ());
  int index = 0;
  for (TopExp_Explorer at(solid, TopAbs_FACE); at.More(); at.Next(), ++index) {
    Face& face = body.faces[static_cast<std::size_t>(index)];
    if (face.kind != SurfaceKind::other && face.kind != SurfaceKind::cylinder) continue;
    std::optional<Helix> helix;
    for (TopExp_Explorer e(at.Current(), TopAbs_EDGE); e.More() && !helix; e.Next())
      for (const auto& [origin, axis] : axes)
        if (!helix) helix = helix_of(TopoDS::Edge(e.Current()), origin, axis);
    if (!helix) continue;
    face.kind = SurfaceKind::helix;
    face.point_B = helix->point, face.axis_B = helix->axis;
    face.radius_m = helix->radius_m, face.pitch_m = helix->pitch_m;
  }
}

/// Closes the holes of a mesh (m). Accepted are those that leave the solid its volume: `repaired` becomes the closed mesh.
/// Returns what was done.
std::string close_holes(const TriangleMesh& mesh, double volume_m3, RepairedMesh& repaired) {
  constexpr double kSameVolume = 0.02;  // curved faces have flat triangles
  const product::FilledMesh filled = product::fill_holes(mesh);
  RepairedMesh closed = repair_mesh(filled.mesh);
  const double difference = closed.problem.empty()
                                ? std::abs(volume_properties(closed.mesh).volume - volume_m3)
                                : std::numeric_limits<double>::infinity();
  if (!(difference <= kSameVolume * volume_m3)) return {};
  repaired = std::move(closed);
  return "its surface had " + counted(filled.holes, "hole", "holes") + " of at most " +
         number_text(filled.largest_m * 1e3, 3) +
         " mm, closed by flat triangles; its mesh has the volume of the solid within " +
         number_text(100.0 * difference / volume_m3, 2) + " %";
}

}  // namespace

bool make_body(const TopoDS_Shape& solid_mm, double deflection_m, double angle_rad, product::Body& body,
               std::vector<std::string>& notes) {
  TriangulatedSolid triangulated = triangulate(solid_mm, deflection_m / kMm, angle_rad);
  const TopoDS_Shape& solid = triangulated.shape;
  if (triangulated.open_edges == 0 && triangulated.sewn_gap_mm > 0.0)
    notes.push_back(body.name + ": its faces do not meet everywhere and are sewn over gaps of at most " +
                    number_text(triangulated.sewn_gap_mm, 2) + " mm");
  body.mesh = std::move(triangulated.mesh);
  body.triangle_faces = std::move(triangulated.triangle_faces);
  if (body.mesh.triangles.empty()) {
    notes.push_back(body.name + ": no faces could be meshed; the body is left out");
    return false;
  }
  for (Vec3& vertex : body.mesh.vertices) vertex *= kMm;
  const GProp_GProps volume = volume_of(solid);
  const double sign = volume.Mass() < 0.0 ? -1.0 : 1.0;
  for (TopExp_Explorer at(solid, TopAbs_FACE); at.More(); at.Next())
    body.faces.push_back(describe_surface(TopoDS::Face(at.Current())));
  if (sign < 0.0)
    for (auto& triangle : body.mesh.triangles) std::swap(triangle[1], triangle[2]);
  recognise_faces(body);
  product::orient_faces(body);
  const MeshCheck check = check_closed(body.mesh);
  if (!check.ok()) {
    RepairedMesh repaired = repair_mesh(body.mesh);
    std::string how = "its mesh was open and was repaired";
    if (!repaired.problem.empty())
      how = close_holes(body.mesh, sign * volume.Mass() * kMm * kMm * kMm, repaired);
    if (!repaired.problem.empty()) {
      notes.push_back(body.name + ": its mesh bounds no solid (" + check.problem +
                      "); the body is left out. In the CAD program, check the solid and export it again");
      return false;
    }
    notes.push_back(body.name + ": " + how + "; contacts of its faces are found by their surfaces");
    // Faces of triangles stay known where the repair kept the triangle.
    std::unordered_multimap<std::uint64_t, std::size_t> before;
    const auto key = [](TriangleMesh::Triangle t) {
      std::sort(t.begin(), t.end());
      return (static_cast<std::uint64_t>(t[0]) * 2654435761U) ^ (static_cast<std::uint64_t>(t[1]) << 21U) ^
             (static_cast<std::uint64_t>(t[2]) << 42U);
    };
    for (std::size_t i = 0; i < body.mesh.triangles.size(); ++i)
      before.emplace(key(body.mesh.triangles[i]), i);
    std::vector<int> faces;
    for (const auto& triangle : repaired.mesh.triangles) {
      const auto found = before.find(key(triangle));
      faces.push_back(found == before.end() ? -1 : body.triangle_faces[found->second]);
    }
    body.mesh = std::move(repaired.mesh);
    body.triangle_faces = std::move(faces);
  }
  const gp_Pnt centre = volume.CentreOfMass();
  body.exact.volume = sign * volume.Mass() * kMm * kMm * kMm;
  body.exact.p_BBcm = point(centre);
  const gp_Mat inertia = volume.MatrixOfInertia();
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      body.exact.G_BBcm_B(i, j) = inertia.Value(i + 1, j + 1) / volume.Mass() * kMm * kMm;
  const double meshed = volume_properties(body.mesh).volume;
  if (!(body.exact.volume > 0.0) || std::abs(meshed - body.exact.volume) > 0.2 * body.exact.volume) {
    notes.push_back(body.name +
                    ": the volume of its surfaces disagrees with that of its mesh; that of the mesh is used");
    body.exact = volume_properties(body.mesh);
  }
  body.deflection_m = deflection_m;
  find_threads(solid, body);
  return true;
}

TriangleMesh finer_mesh(const TopoDS_Shape& solid, double deflection_m, double angle_rad,
                        const product::Body& body, const std::vector<double>& face_deflections_m) {
  std::size_t count = 0;
  constexpr double kSameArea = 1e-6;
  for (TopExp_Explorer at(solid, TopAbs_FACE); at.More(); at.Next(), ++count) {
    if (count == body.faces.size()) return {};
    const double known = body.faces[count].area_m2;
    if (!(std::abs(area_mm2(TopoDS::Face(at.Current())) * kMm * kMm - known) <= kSameArea * std::abs(known)))
      return {};
  }
  if (count != body.faces.size()) return {};
  std::vector<double> face_deflections_mm;
  face_deflections_mm.reserve(face_deflections_m.size());
  for (const double d : face_deflections_m) face_deflections_mm.push_back(d / kMm);
  TriangulatedSolid triangulated =
      triangulate_faces(solid, deflection_m / kMm, angle_rad, face_deflections_mm);
  if (triangulated.open_edges > 0) {  // faces of their own fineness do not suit each solid
    double finest_mm = deflection_m / kMm;
    for (const double d : face_deflections_mm)
      if (d > 0.0) finest_mm = std::min(finest_mm, d);
    triangulated = triangulate(solid, finest_mm, angle_rad);
  }
  TriangleMesh mesh = std::move(triangulated.mesh);
  for (Vec3& vertex : mesh.vertices) vertex *= kMm;
  if (volume_properties(mesh).volume < 0.0)
    for (auto& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
  return check_closed(mesh).ok() ? mesh : TriangleMesh{};
}

}  // namespace takt::cad
