#pragma once
// Assemblies as engineers draw them: fasteners of nominal diameter in core holes, standard numbers for names, play, press fits
// behind shoulders, undercuts. mm.
#include <BRepBuilderAPI_MakeFace.hxx>
#include <BRepBuilderAPI_MakePolygon.hxx>
#include <BRepPrimAPI_MakeCone.hxx>
#include <BRepPrimAPI_MakePrism.hxx>
#include <cmath>
#include <vector>

#include "tests/cad/step_files.h"

namespace takt::test {

inline TopoDS_Shape block(double x, double y, double z, double dx, double dy, double dz) {
  return BRepPrimAPI_MakeBox(gp_Pnt(x, y, z), dx, dy, dz).Shape();
}
inline TopoDS_Shape cut(const TopoDS_Shape& a, const TopoDS_Shape& b) {
  return BRepAlgoAPI_Cut(a, b).Shape();
}
inline TopoDS_Shape fuse(const TopoDS_Shape& a, const TopoDS_Shape& b) {
  return BRepAlgoAPI_Fuse(a, b).Shape();
}
inline TopoDS_Shape prism(const std::vector<gp_Pnt>& corners, const gp_Vec& along) {
  BRepBuilderAPI_MakePolygon polygon;
  for (const gp_Pnt& corner : corners) polygon.Add(corner);
  polygon.Close();
  return BRepPrimAPI_MakePrism(BRepBuilderAPI_MakeFace(polygon.Wire()).Face(), along).Shape();
}
inline TopoDS_Shape hexagon(double across_flats, double from, double to) {
  std::vector<gp_Pnt> corners;
  for (int i = 0; i < 6; ++i)
    corners.emplace_back(across_flats / std::sqrt(3.0) * std::cos(i * M_PI / 3),
                         across_flats / std::sqrt(3.0) * std::sin(i * M_PI / 3), from);
  return prism(corners, gp_Vec(0, 0, to - from));
}

/// A shaft in a block that pins place and screws hold on a plate: config/cad/bearing_block.step.
inline StepProduct bearing_block() {
  TopoDS_Shape plate = block(-70, -50, 0, 140, 100, 20);
  TopoDS_Shape body =
      cut(block(-50, -30, 20, 100, 60, 50), rod(gp_Pnt(-60, 0, 45), gp_Dir(1, 0, 0), 12.05, 120));
  for (const double x : {-38.0, 38.0})
    for (const double y : {-21.0, 21.0}) {
      plate = cut(plate, upright(3.4, x, y, 0, 20));
      body = cut(body, upright(4.5, x, y, 20, 70));
    }
  for (const double x : {-20.0, 20.0}) {
    plate = cut(plate, upright(4.0, x, -22, 0, 20));
    body = cut(body, upright(4.02, x, -22, 20, 70));
  }
  StepProduct made("Bearing block");
  const TDF_Label base = made.part("Plate", plate), middle = made.part("Block", body),
                  shaft = made.part("Shaft", rod(gp_Pnt(-90, 0, 45), gp_Dir(1, 0, 0), 12.0, 180)),
                  pin = made.part("Pin", upright(4.0, 0, 0, 0, 78)),
                  screw = made.part("M8 screw", fuse(upright(4.0, 0, 0, 0, 65), upright(6.5, 0, 0, 65, 73)));
  made.material(base, "steel S355", 7.85);
  made.material(middle, "aluminium EN AW-6082", 2.7);
  made.colour(base, 0.35, 0.38, 0.42);
  made.colour(middle, 0.72, 0.76, 0.8);
  made.colour(shaft, 0.25, 0.45, 0.7);
  made.colour(pin, 0.85, 0.65, 0.2);
  made.colour(screw, 0.15, 0.15, 0.17);
  made.use(made.root(), base, "Plate");
  made.use(made.root(), middle, "Block");
  made.use(made.root(), shaft, "Shaft");
  for (const double x : {-20.0, 20.0}) made.use(made.root(), pin, "Pin", moved_by(x, -22, 0));
  for (const double x : {-38.0, 38.0})
    for (const double y : {-21.0, 21.0}) made.use(made.root(), screw, "M8 screw", moved_by(x, y, 5));
  return made;
}

/// A dovetail with play, and a stop that a screw without a word in its name holds.
inline StepProduct slide() {
  const auto dovetail = [](double narrow, double wide, double from, double to) {
    return prism({gp_Pnt(-narrow, -90, from), gp_Pnt(narrow, -90, from), gp_Pnt(wide, -90, to),
                  gp_Pnt(-wide, -90, to)},
                 gp_Vec(0, 180, 0));
  };
  const TopoDS_Shape rail = cut(cut(fuse(block(-40, -60, 0, 80, 120, 10), dovetail(10, 16, 10, 22)),
                                    fuse(block(-40, -100, 10, 80, 40, 20), block(-40, 60, 10, 80, 40, 20))),
                                rod(gp_Pnt(0, 40, 5), gp_Dir(0, 1, 0), 2.1, 30));
  StepProduct made("Slide");
  made.use(made.root(), made.part("Rail", rail), "Rail");
  made.use(made.root(),
           made.part("Slider", cut(block(-35, -25, 10.1, 70, 50, 30), dovetail(10.1, 16.2, 10, 22.2))),
           "Slider");
  made.use(
      made.root(),
      made.part("Stop", cut(block(-20, 60, 0, 40, 8, 30), rod(gp_Pnt(0, 50, 5), gp_Dir(0, 1, 0), 2.75, 30))),
      "Stop");
  made.use(made.root(),
           made.part("ISO 4762 M5x20", fuse(rod(gp_Pnt(0, 48, 5), gp_Dir(0, 1, 0), 2.5, 20),
                                            rod(gp_Pnt(0, 68, 5), gp_Dir(0, 1, 0), 4.25, 5))),
           "ISO 4762 M5x20");
  return made;
}

/// Bearings are pressed into blind bores of housing and cover; countersunk screws hold the cover; keys carry gears.
inline StepProduct gearbox() {
  TopoDS_Shape housing = cut(block(0, 0, 0, 120, 80, 50), block(8, 8, 8, 104, 64, 60)),
               cover = block(0, 0, 50, 120, 80, 8);
  for (const double x : {40.0, 85.0}) {
    housing = cut(housing, upright(13, x, 40, 2, 10));
    cover = cut(cut(cover, upright(13, x, 40, 49, 56)), upright(7, x, 40, 49, 60));
  }
  const TopoDS_Shape sink =
      BRepPrimAPI_MakeCone(gp_Ax2(gp_Pnt(0, 0, 55.8), gp_Dir(0, 0, 1)), 2.0, 4.2, 2.2).Shape();
  for (const double x : {4.0, 116.0})
    for (const double y : {4.0, 76.0}) {
      housing = cut(housing, upright(1.65, x, y, 35, 50));
      cover = cut(cut(cover, upright(2.2, x, y, 49, 60)), sink.Moved(TopLoc_Location(moved_by(x, y, 0))));
    }
  StepProduct made("Gearbox");
  made.use(made.root(), made.part("Housing", housing), "Housing");
  made.use(made.root(), made.part("Cover", cover), "Cover");
  const TDF_Label bearing =
      made.part("6001 bearing", cut(upright(13.004, 0, 0, 0, 6), upright(5.995, 0, 0, -1, 8)));
  const TDF_Label shaft = made.part(
      "Shaft", cut(fuse(upright(6, 0, 0, 4, 55), upright(10, 0, 0, 8.1, 49.9)), block(-3, 7, 20, 6, 8, 20)));
  const TDF_Label key = made.part("Key", block(-3, 7, 20, 6, 5, 20));
  const TDF_Label gear = made.part("Gear", cut(cut(upright(21, 0, 0, 18, 42), upright(10.02, 0, 0, 10, 50)),
                                               block(-3.02, 5, 10, 6.04, 7.1, 40)));
  for (const double x : {40.0, 85.0}) {
    made.use(made.root(), bearing, "Bearing lower", moved_by(x, 40, 2.1));
    made.use(made.root(), bearing, "Bearing upper", moved_by(x, 40, 49.9));
    made.use(made.root(), shaft, "Shaft", moved_by(x, 40, 0));
    made.use(made.root(), key, "Key", moved_by(x, 40, 0));
    made.use(made.root(), gear, "Gear", moved_by(x, 40, 0));
  }
  const TDF_Label screw = made.part("ISO 10642 M4x20", fuse(upright(2, 0, 0, 38, 56), sink));
  for (const double x : {4.0, 116.0})
    for (const double y : {4.0, 76.0}) made.use(made.root(), screw, "ISO 10642 M4x20", moved_by(x, y, 0));
  return made;
}

/// Two pipes of the same mass, a gasket, three bolts with washers and nuts.
inline StepProduct flanges() {
  TopoDS_Shape lower =
                   cut(fuse(upright(60, 0, 0, 0, 12), upright(30, 0, 0, -60, 0)), upright(25, 0, 0, -70, 20)),
               upper =
                   cut(fuse(upright(60, 0, 0, 14, 26), upright(30, 0, 0, 26, 86)), upright(25, 0, 0, 0, 100)),
               gasket = cut(upright(60, 0, 0, 12, 14), upright(25, 0, 0, 0, 20));
  std::vector<gp_Trsf> places;
  for (int i = 0; i < 3; ++i) {
    const double x = 45 * std::cos(2 * i * M_PI / 3), y = 45 * std::sin(2 * i * M_PI / 3);
    places.push_back(moved_by(x, y, 0));
    for (TopoDS_Shape* one : {&lower, &upper, &gasket}) *one = cut(*one, upright(5.5, x, y, -1, 40));
  }
  StepProduct made("Flanges");
  made.use(made.root(), made.part("Upper pipe", upper), "Upper pipe");
  made.use(made.root(), made.part("Gasket", gasket), "Gasket");
  made.use(made.root(), made.part("Lower pipe", lower), "Lower pipe");
  const TDF_Label bolt = made.part("Bolt M10", fuse(upright(5, 0, 0, -14, 28), hexagon(16, 28, 34.4))),
                  above = made.part("Washer", cut(upright(10, 0, 0, 26, 28), upright(5.25, 0, 0, 20, 30))),
                  below = made.part("Washer", cut(upright(10, 0, 0, -2, 0), upright(5.25, 0, 0, -5, 5))),
                  nut = made.part("Nut M10", cut(hexagon(16, -10, -2), upright(4.25, 0, 0, -20, 5)));
  for (const gp_Trsf& place : places)
    for (const auto& [label, name] :
         {std::pair{bolt, "Bolt M10"}, {above, "Washer"}, {below, "Washer"}, {nut, "Nut M10"}})
      made.use(made.root(), label, name, place);
  return made;
}

/// A lid with two hooks in windows of a box.
inline StepProduct snap_box() {
  TopoDS_Shape box = cut(block(0, 0, 0, 80, 50, 30), block(3, 3, 3, 74, 44, 40));
  TopoDS_Shape lid = fuse(block(0, 0, 30, 80, 50, 3), block(3.2, 3.2, 27, 73.6, 43.6, 3));
  for (const bool right : {false, true}) {
    box = cut(box, block(right ? 76 : -1, 18, 20, 5, 14, 4));
    lid = fuse(lid,
               fuse(block(right ? 74.8 : 3.2, 20, 18, 2, 10, 12), block(right ? 76 : 2, 20, 20.5, 2, 10, 3)));
  }
  StepProduct made("Snap box");
  made.use(made.root(), made.part("Box", box), "Box");
  made.use(made.root(), made.part("Lid", lid), "Lid");
  made.use(made.root(), made.part("Battery", block(10, 10, 3, 50, 30, 15)), "Battery");
  return made;
}

/// A fork and a rod on a pin that an E-ring keeps.
inline StepProduct clevis() {
  const gp_Dir x(1, 0, 0);
  const TopoDS_Shape fork = cut(cut(block(-20, -15, 0, 40, 30, 50), block(-10, -20, 20, 20, 40, 40)),
                                rod(gp_Pnt(-30, 0, 38), x, 5.0, 60));
  const TopoDS_Shape eye = cut(fuse(block(-9.9, -8, 25, 19.8, 16, 80), rod(gp_Pnt(-9.9, 0, 38), x, 10, 19.8)),
                               rod(gp_Pnt(-30, 0, 38), x, 5.03, 60));
  const TopoDS_Shape groove = cut(rod(gp_Pnt(22, 0, 38), x, 6, 1.2), rod(gp_Pnt(22, 0, 38), x, 4.2, 1.2));
  const TopoDS_Shape ring = cut(cut(rod(gp_Pnt(22.05, 0, 38), x, 7, 1.1), rod(gp_Pnt(22, 0, 38), x, 4.2, 2)),
                                block(21, -3, 38, 3, 6, 10));
  StepProduct made("Clevis");
  made.use(made.root(), made.part("Fork", fork), "Fork");
  made.use(made.root(), made.part("Eye", eye), "Eye");
  made.use(made.root(),
           made.part("Pin", cut(fuse(rod(gp_Pnt(-20, 0, 38), x, 4.98, 48), rod(gp_Pnt(-23, 0, 38), x, 8, 3)),
                                groove)),
           "Pin");
  made.use(made.root(), made.part("E-ring", ring), "E-ring");
  return made;
}

}  // namespace takt::test
