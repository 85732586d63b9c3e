#include "server/cad/step_spheres.h"

#include <Geom_Curve.hxx>
#include <Geom_SphericalSurface.hxx>
#include <Precision.hxx>
#include <Standard_Failure.hxx>
#include <StepGeom_Axis2Placement3d.hxx>
#include <StepGeom_Direction.hxx>
#include <StepGeom_Pcurve.hxx>
#include <StepGeom_SphericalSurface.hxx>
#include <StepGeom_SurfaceCurve.hxx>
#include <StepShape_EdgeCurve.hxx>
#include <StepShape_EdgeLoop.hxx>
#include <StepShape_FaceBound.hxx>
#include <StepShape_FaceSurface.hxx>
#include <StepShape_OrientedEdge.hxx>
#include <StepToGeom.hxx>
#include <TColStd_HArray1OfReal.hxx>
#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <vector>

#if __has_include(<StepData_Factors.hxx>)
#include <StepData_Factors.hxx>
#endif

namespace takt::cad {

namespace {

using Sphere = Handle(StepGeom_SphericalSurface);

/// Borders that come nearer to a pole than this run through it.
constexpr double kNear_rad = 0.05;

// In the units of the file.
#if __has_include(<StepData_Factors.hxx>)  // OCCT 7.8
Handle(Geom_Curve) made(const Handle(StepGeom_Curve) & curve) {
  return StepToGeom::MakeCurve(curve, StepData_Factors());
}
Handle(Geom_SphericalSurface) made(const Sphere& sphere) {
  return StepToGeom::MakeSphericalSurface(sphere, StepData_Factors());
}
#else
Handle(Geom_Curve) made(const Handle(StepGeom_Curve) & curve) {
  return StepToGeom::MakeCurve(curve);
}
Handle(Geom_SphericalSurface) made(const Sphere& sphere) {
  return StepToGeom::MakeSphericalSurface(sphere);
}
#endif

struct Borders {
  Sphere sphere;
  std::vector<Handle(StepGeom_Curve)> curves;
  bool kept = false;  ///< its parametrisation stays
};

Handle(StepGeom_Curve) curve_of(const Handle(StepShape_OrientedEdge) & use) {
  const auto edge = use.IsNull() ? Handle(StepShape_EdgeCurve)()
                                 : Handle(StepShape_EdgeCurve)::DownCast(use->EdgeElement());
  if (edge.IsNull()) return {};
  const auto on_surface = Handle(StepGeom_SurfaceCurve)::DownCast(edge->EdgeGeometry());
  return on_surface.IsNull() ? edge->EdgeGeometry() : on_surface->Curve3d();
}

void add_borders(const StepShape_FaceSurface& face, Borders& borders) {
  std::set<const Standard_Transient*> edges;
  for (int i = 1; i <= face.NbBounds(); ++i) {
    const auto bound = face.BoundsValue(i);
    const auto loop =
        bound.IsNull() ? Handle(StepShape_EdgeLoop)() : Handle(StepShape_EdgeLoop)::DownCast(bound->Bound());
    if (loop.IsNull()) {  // of a vertex: a whole sphere
      borders.kept = true;
      return;
    }
    for (int k = 1; k <= loop->NbEdgeList(); ++k) {
      const auto use = loop->EdgeListValue(k);
      const auto curve = curve_of(use);
      // A face has its seam twice.
      if (curve.IsNull() || !edges.insert(use->EdgeElement().get()).second)
        borders.kept = true;
      else
        borders.curves.push_back(curve);
    }
  }
}

/// Directions of points of the borders, seen from the centre.
std::vector<gp_Dir> directions_of(const Borders& borders, const gp_Pnt& center) {
  constexpr int kPoints = 48;
  std::vector<gp_Dir> directions;
  for (const auto& step_curve : borders.curves) {
    const Handle(Geom_Curve) curve = made(step_curve);
    if (curve.IsNull() || Precision::IsInfinite(curve->FirstParameter()) ||
        Precision::IsInfinite(curve->LastParameter()))
      return {};
    const double from = curve->FirstParameter(), length = curve->LastParameter() - from;
    for (int i = 0; i <= kPoints; ++i) {
      const gp_Vec way(center, curve->Value(from + length * i / kPoints));
      if (way.Magnitude() > Precision::Confusion()) directions.emplace_back(way);
    }
  }
  return directions;
}

/// Smallest angle between one of the directions and a pole (rad).
double clearance(const gp_Dir& pole, const std::vector<gp_Dir>& directions) {
  double largest = 0.0;
  for (const gp_Dir& direction : directions) largest = std::max(largest, std::abs(pole.Dot(direction)));
  return std::acos(std::min(largest, 1.0));
}

Handle(StepGeom_Direction) step_direction(const gp_Dir& direction) {
  const Handle(TColStd_HArray1OfReal) ratios = new TColStd_HArray1OfReal(1, 3);
  for (int i = 1; i <= 3; ++i) ratios->SetValue(i, direction.Coord(i));
  Handle(StepGeom_Direction) made = new StepGeom_Direction;
  made->Init(new TCollection_HAsciiString(""), ratios);
  return made;
}

void turn_poles(const Borders& borders) {
  constexpr double kSideways = 0.1;  // a pole beside the faces is better than one within
  const Handle(Geom_SphericalSurface) surface = made(borders.sphere);
  if (surface.IsNull()) return;
  const gp_Ax3 frame = surface->Position();
  const std::vector<gp_Dir> directions = directions_of(borders, frame.Location());
  if (directions.empty() || clearance(frame.Direction(), directions) > kNear_rad) return;
  gp_Vec middle(0.0, 0.0, 0.0);
  for (const gp_Dir& direction : directions) middle += gp_Vec(direction);
  if (middle.Magnitude() > Precision::Confusion()) middle.Normalize();  // else the borders are symmetric
  const gp_Vec x(frame.XDirection()), y(frame.YDirection()), z(frame.Direction());
  gp_Dir best = frame.Direction();
  double most = 0.0;
  for (int i = -1; i <= 1; ++i)
    for (int j = -1; j <= 1; ++j)
      for (int k = 0; k <= 1; ++k) {
        if (i == 0 && j == 0) continue;
        const gp_Dir pole(double(i) * x + double(j) * y + double(k) * z);
        const double worth = clearance(pole, directions) - kSideways * std::abs(gp_Vec(pole).Dot(middle));
        if (worth > most) most = worth, best = pole;
      }
  if (most <= kNear_rad) return;
  // The seam lies on the far side.
  const gp_Vec sideways = middle - gp_Vec(best) * middle.Dot(gp_Vec(best));
  const gp_Dir seam = sideways.Magnitude() > 1e-6 ? gp_Dir(-sideways) : gp_Ax3(gp_Pnt(), best).XDirection();
  const auto& old = borders.sphere->Position();
  const Handle(StepGeom_Axis2Placement3d) turned = new StepGeom_Axis2Placement3d;
  turned->Init(old->Name(), old->Location(), true, step_direction(best), true, step_direction(seam));
  borders.sphere->SetPosition(turned);
}

}  // namespace

void turn_poles_from_borders(const Interface_InterfaceModel& model) {
  std::map<const Standard_Transient*, Borders> spheres;
  std::set<const Standard_Transient*> with_pcurves;
  for (int i = 1; i <= model.NbEntities(); ++i) {
    const Handle(Standard_Transient)& entity = model.Value(i);
    if (const auto pcurve = Handle(StepGeom_Pcurve)::DownCast(entity); !pcurve.IsNull())
      with_pcurves.insert(pcurve->BasisSurface().get());
    const auto face = Handle(StepShape_FaceSurface)::DownCast(entity);
    if (face.IsNull()) continue;
    const auto sphere = Sphere::DownCast(face->FaceGeometry());
    if (sphere.IsNull() || sphere->Position().IsNull()) continue;
    Borders& borders = spheres[sphere.get()];
    borders.sphere = sphere;
    add_borders(*face, borders);
  }
  for (const auto& [entity, borders] : spheres) {
    if (borders.kept || with_pcurves.contains(entity)) continue;
    try {
      turn_poles(borders);
    } catch (const Standard_Failure&) {
      continue;  // damaged: the transfer says so
    }
  }
}

}  // namespace takt::cad
