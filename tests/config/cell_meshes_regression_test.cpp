// The meshes of the large cells, made on demand: closed, of the sizes said in the thesis, and with the fits
// that their parameters state.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <numbers>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "config/meshes/generator/cap_screw_meshes.h"
#include "config/meshes/generator/chainsaw_meshes.h"
#include "config/meshes/generator/lamp_meshes.h"
#include "config/meshes/generator/mesh_parameters.h"
#include "config/meshes/generator/rotor_meshes.h"
#include "config/meshes/generator/screw_meshes.h"
#include "server/geometry/mesh/import.h"
#include "tests/support/solid_mesh.h"
#include "tests/support/temporary_directory.h"

namespace takt {
namespace {

using meshes::Solid;
using test::mesh_of;

/// Smallest distance from the axis of the vertices between two heights.
double narrowest(const Solid& solid, double from, double to, double at_least) {
  double least = 1.0;
  for (const Vec3& v : solid.vertices) {
    const double r = std::hypot(v.x(), v.y());
    if (v.z() > from && v.z() < to && r > at_least) least = std::min(least, r);
  }
  return least;
}

double widest(const Solid& solid, double from, double to) {
  double most = 0.0;
  for (const Vec3& v : solid.vertices)
    if (v.z() > from && v.z() < to) most = std::max(most, std::hypot(v.x(), v.y()));
  return most;
}

TEST(CellMeshes, MeshesAreClosedAndOfTheDocumentedSize) {
  const test::TemporaryDirectory directory;
  const std::string command =
      std::string(TAKT_BIN_DIR) + "/takt-make-meshes --cells " + directory.path().string();
  ASSERT_EQ(std::system(command.c_str()), 0) << command;
  // Thesis 5.4.1: housing with mount 158 572, box 14 728, motor 4 038, jaws 1 224.
  const std::map<std::string, double> triangles{
      {"housing", 158572}, {"box", 14728}, {"motor", 4038}, {"jaw", 1224}};
  for (const char* name : {"housing",     "box",      "motor",       "motor_convex", "jaw",     "rotor_core",
                           "magnet",      "cover",    "screw",       "screw_rack",   "fixture", "punch_half",
                           "press_mount", "furnace",  "bolt",        "nut",          "spacer",  "pinion",
                           "wheel",       "gear_pin", "cap_screw",   "tapped_block", "washer",  "hex_bit",
                           "chuck_jaw",   "lamp",     "lamp_socket", "lamp_contact"}) {
    for (const auto& object : import_mesh_objects(directory.path() / (std::string(name) + ".obj"))) {
      EXPECT_EQ(check_closed(object.mesh).problem, "") << name << " " << object.name;
      const auto wanted = triangles.find(name);
      if (wanted == triangles.end()) continue;
      EXPECT_NEAR(static_cast<double>(object.mesh.triangles.size()) / wanted->second, 1.0, 0.1) << name;
    }
  }
}

TEST(CellMeshes, ParametersAreSetByNameWithinTheirBounds) {
  meshes::CellParameters p;
  meshes::set_parameter(p, "chainsaw.interference=5e-5");
  meshes::set_parameter(p, "chainsaw.motor_facets=40");
  meshes::set_parameter(p, "rotor.clearance=-0.00002");
  EXPECT_EQ(p.chainsaw.interference, 5e-5);
  EXPECT_EQ(p.chainsaw.motor_facets, 40);
  EXPECT_EQ(p.rotor.clearance, -2e-5);
  for (const char* wrong : {"", "chainsaw.interference", "interference=1e-5", "chainsaw.interference=x",
                            "chainsaw.interference=1", "chainsaw.motor_facets=40.5", "rotor.slots=1",
                            "chainsaw.contact_edge=nan"})
    EXPECT_THROW(meshes::set_parameter(p, wrong), std::invalid_argument) << wrong;
}

TEST(CellMeshes, MeshesAreClosedAtTheBoundsOfTheirParameters) {
  std::ostringstream list;
  meshes::list_parameters(list, {});
  std::istringstream lines(list.str());
  int parameters = 0, refused = 0;
  for (std::string line; std::getline(lines, line); ++parameters) {
    const std::string name = line.substr(0, line.find('='));
    const std::size_t to = line.rfind(" to "), from = line.rfind(", ");
    for (const std::string& bound : {line.substr(from + 2, to - from - 2), line.substr(to + 4)}) {
      meshes::CellParameters p;
      ASSERT_NO_THROW(meshes::set_parameter(p, name + "=" + bound)) << line;
      std::vector<Solid> solids;
      if (name.starts_with("chainsaw.")) {
        p.chainsaw.housing_facets = std::min(p.chainsaw.housing_facets, 120);  // quicker
        solids = {make_motor(p.chainsaw), make_housing(p.chainsaw), make_open_box(p.chainsaw)};
      } else if (!name.starts_with("rotor.")) {
        // Not every size goes with the default of the others; then the parameters are refused.
        try {
          if (name.starts_with("screw."))
            solids = {meshes::make_bolt(p.screw), meshes::make_nut(p.screw), meshes::make_spacer(p.screw)};
          else if (name.starts_with("cap_screw."))
            solids = {meshes::make_cap_screw(p.cap_screw), meshes::make_tapped_block(p.cap_screw),
                      meshes::make_washer(p.cap_screw), meshes::make_hex_bit(p.cap_screw),
                      meshes::make_chuck_jaw(p.cap_screw)};
          else if (name.starts_with("lamp."))
            solids = {meshes::make_lamp(p.lamp), meshes::make_lamp_socket(p.lamp),
                      meshes::make_lamp_contact(p.lamp)};
          else
            solids = {meshes::make_gear("pinion", p.gear.pinion_teeth, p.gear),
                      meshes::make_gear("wheel", p.gear.wheel_teeth, p.gear), meshes::make_gear_pin(p.gear)};
        } catch (const std::invalid_argument& error) {
          EXPECT_NE(std::string(error.what()).find("; allowed: "), std::string::npos) << error.what();
          ++refused;
        }
      } else {
        solids = {make_rotor_core(p.rotor), make_magnet(p.rotor), make_rotor_cover(p.rotor)};
      }
      for (const Solid& solid : solids) {
        EXPECT_EQ(check_closed(mesh_of(solid)).problem, "") << solid.name << " with " << name << "=" << bound;
        EXPECT_GT(volume_properties(mesh_of(solid)).volume, 0.0)
            << solid.name << " with " << name << "=" << bound;
      }
    }
  }
  EXPECT_EQ(parameters, 55);
  EXPECT_LE(refused, 14);
}

TEST(CellMeshes, ThePressFitIsAsNarrowAsItsParameter) {
  for (const double interference : {10e-6, 50e-6, -100e-6}) {
    meshes::ChainsawParameters p;
    p.interference = interference;
    const Solid motor = make_motor(p), housing = make_housing(p);
    EXPECT_EQ(check_closed(mesh_of(housing)).problem, "") << interference;
    // Corners of flats lie further out than the flats by a factor that depends on the body.
    const double boss = widest(motor, 0.002, 0.010) * std::cos(M_PI / p.motor_facets);
    const double seat = narrowest(housing, 0.015, 0.0235, 0.011) * std::cos(M_PI / p.housing_facets);
    EXPECT_NEAR(boss - seat, interference, 1e-9) << interference;
    // The seat's rim is chamfered.
    EXPECT_NEAR(narrowest(housing, 0.0249, 0.0251, 0.012) * std::cos(M_PI / p.housing_facets),
                p.boss_radius - interference + p.seat_chamfer, 1e-9);
  }
}

TEST(CellMeshes, TheMotorEqualsItsFiveConvexPieces) {
  const meshes::ChainsawParameters p;
  const std::vector<Solid> pieces = make_motor_pieces(p);
  ASSERT_EQ(pieces.size(), 5U);
  double volume = 0.0;
  for (const Solid& piece : pieces) {
    const TriangleMesh mesh = mesh_of(piece);
    EXPECT_EQ(check_closed(mesh).problem, "") << piece.name;
    volume += volume_properties(mesh).volume;
    // The flats (20 mm from the axis) end within facets of the turned face (radius 24 mm), whose corners
    // beyond are pulled in: by less than a facet, at the angle between both. The hull fills that gap.
    const double facet_m = 2.0 * 0.024 * std::tan(std::numbers::pi / p.motor_facets);
    const double hollow = piece.name == "piece_4" ? facet_m * std::sin(std::acos(20.0 / 24.0)) : 1e-9;
    for (const auto& t : mesh.triangles) {
      const Vec3& a = mesh.vertices[t[0]];
      const Vec3 n = (mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a).normalized();
      for (const Vec3& v : mesh.vertices) ASSERT_LE(n.dot(v - a), hollow) << piece.name;
    }
  }
  EXPECT_NEAR(volume_properties(mesh_of(make_motor(p))).volume / volume, 1.0, 0.01);
}

TEST(CellMeshes, MagnetsFitTheirSlots) {
  meshes::RotorParameters p;
  p.clearance = 30e-6;
  const Solid core = make_rotor_core(p), magnet = make_magnet(p);
  EXPECT_EQ(check_closed(mesh_of(core)).problem, "");
  // Volume: cylinder with 8 sectors of 16 columns less bore and slots, by the shoelace formula on one layer.
  Vec3 lower = Vec3::Constant(1.0), upper = -lower;
  for (const Vec3& v : magnet.vertices) lower = lower.cwiseMin(v), upper = upper.cwiseMax(v);
  EXPECT_NEAR((upper - lower - Vec3(p.magnet_thickness, p.magnet_width, p.magnet_length)).norm(), 0.0, 1e-12);
  // The first slot's faces, at +x.
  double inner = 1.0, outer = 0.0, half = 0.0;
  for (const Vec3& v : core.vertices) {
    if (std::abs(v.y()) > 0.5 * p.magnet_width + 50e-6 || v.x() < p.slot_radius - 1e-3 ||
        v.x() > p.slot_radius + p.magnet_thickness + 1e-3)
      continue;
    inner = std::min(inner, v.x()), outer = std::max(outer, v.x()), half = std::max(half, std::abs(v.y()));
  }
  EXPECT_NEAR(inner, p.slot_radius - p.clearance, 1e-12);
  EXPECT_NEAR(outer, p.slot_radius + p.magnet_thickness + p.clearance, 1e-12);
  EXPECT_NEAR(half, 0.5 * p.magnet_width + p.clearance, 1e-12);
}

}  // namespace
}  // namespace takt
