#include "server/cad/sewn_solids.h"

#include <BRepBuilderAPI_MakeSolid.hxx>
#include <BRepBuilderAPI_Sewing.hxx>
#include <BRepLib.hxx>
#include <BRep_Tool.hxx>
#include <Standard_Failure.hxx>
#include <TopExp_Explorer.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Shell.hxx>
#include <TopoDS_Solid.hxx>
#include <algorithm>
#include <array>

namespace takt::cad {

namespace {

constexpr std::array kTolerances_mm{1e-3, 1e-2, kWidestGap_mm};
constexpr int kMostFaces = 3000;  ///< the time that sewing takes grows with their square

int faces_of(const TopoDS_Shape& shape) {
  int count = 0;
  for (TopExp_Explorer at(shape, TopAbs_FACE); at.More(); at.Next()) ++count;
  return count;
}

double largest_tolerance_mm(const TopoDS_Shape& shape) {
  double largest = 0.0;
  for (TopExp_Explorer at(shape, TopAbs_EDGE); at.More(); at.Next())
    largest = std::max(largest, BRep_Tool::Tolerance(TopoDS::Edge(at.Current())));
  return largest;
}

}  // namespace

SewnSolids sew(const std::vector<TopoDS_Shape>& surfaces) {
  SewnSolids result;
  result.left = static_cast<int>(surfaces.size());
  int faces = 0;
  for (const TopoDS_Shape& surface : surfaces) faces += faces_of(surface);
  if (faces > kMostFaces) return result;
  for (const double tolerance_mm : kTolerances_mm) {
    SewnSolids sewn;
    try {
      BRepBuilderAPI_Sewing sewing(tolerance_mm);
      for (const TopoDS_Shape& surface : surfaces) sewing.Add(surface);
      sewing.Perform();
      int in_solids = 0;
      for (TopExp_Explorer at(sewing.SewedShape(), TopAbs_SHELL); at.More(); at.Next()) {
        const TopoDS_Shell shell = TopoDS::Shell(at.Current());
        if (!BRep_Tool::IsClosed(shell)) {
          ++sewn.left;
          continue;
        }
        BRepBuilderAPI_MakeSolid made(shell);
        TopoDS_Solid solid = made.Solid();
        BRepLib::OrientClosedSolid(solid);
        sewn.solids.push_back(solid);
        in_solids += faces_of(solid);
        sewn.largest_gap_mm = std::max(sewn.largest_gap_mm, largest_tolerance_mm(solid));
      }
      for (TopExp_Explorer at(sewing.SewedShape(), TopAbs_FACE, TopAbs_SHELL); at.More(); at.Next())
        ++sewn.left;
      if (in_solids == 0) continue;
    } catch (const Standard_Failure&) {
      continue;  // this tolerance does not suit them
    }
    if (sewn.solids.size() > result.solids.size() || (!sewn.solids.empty() && sewn.left < result.left))
      result = std::move(sewn);
    if (result.left == 0) break;
  }
  return result;
}

}  // namespace takt::cad
