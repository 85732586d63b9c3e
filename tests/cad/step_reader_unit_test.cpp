// STEP files made by OpenCASCADE, read back: figures by hand.
#include "server/cad/step_reader.h"

#include <gmock/gmock.h>
#include <BRepGProp.hxx>
#include <BRepPrimAPI_MakeSphere.hxx>
#include <BRep_Builder.hxx>
#include <GProp_GProps.hxx>
#include <TopExp_Explorer.hxx>
#include <TopoDS_Compound.hxx>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <regex>

#include "server/product/contacts.h"
#include "server/product/disassembly.h"
#include "tests/cad/step_files.h"
#include "tests/support/temporary_directory.h"

namespace takt::cad {
namespace {

using product::Instance;
using product::Product;
using test::box;
using test::cylinder;
using test::moved_by;
using test::StepProduct;
using testing::ElementsAre;
using testing::HasSubstr;

/// A plate around the origin with a hole along z.
TopoDS_Shape bored(double side, double thickness, double radius) {
  const TopoDS_Shape plate =
      BRepPrimAPI_MakeBox(gp_Pnt(-side / 2, -side / 2, 0), side, side, thickness).Shape();
  return BRepAlgoAPI_Cut(plate, BRepPrimAPI_MakeCylinder(radius, thickness).Shape()).Shape();
}

class StepReader : public testing::Test {
 protected:
  std::filesystem::path file() const { return directory_ / "product.step"; }
  const Instance& instance(const Product& product, const std::string& name) const {
    for (const Instance& one : product.instances)
      if (one.name == name) return one;
    throw std::out_of_range(name);
  }
  test::TemporaryDirectory directory_;
};

TEST_F(StepReader, VolumesAndCentresAreThoseOfTheSolids) {
  // OpenCASCADE writes the numbers as they are, below the unit that it is given.
  for (const auto& [unit, k] : {std::pair{"MM", 1.0}, std::pair{"INCH", 25.4}}) {
    StepProduct made("Assembly");
    made.use(made.root(), made.part("Plate", bored(60, 10, 8)), "Plate");
    made.use(made.root(), made.part("Pin", cylinder(7.9, 30)), "Pin", moved_by(0, 0, -5));
    made.write(file(), unit);
    const Product product = read_step(file());
    ASSERT_EQ(product.instances.size(), 2U) << unit;
    const product::Body& plate = product.bodies[instance(product, "Plate").body];
    const product::Body& pin = product.bodies[instance(product, "Pin").body];
    const double k2 = k * k, k3 = k * k * k, r = 0.0079, h = 0.03;
    EXPECT_NEAR(plate.exact.volume / k3, (0.06 * 0.06 - M_PI * 0.008 * 0.008) * 0.01, 1e-12) << unit;
    EXPECT_NEAR(pin.exact.volume / k3, M_PI * r * r * h, 1e-12) << unit;
    EXPECT_LT((pin.exact.p_BBcm / k - Vec3(0, 0, h / 2)).norm(), 1e-9) << unit;
    EXPECT_NEAR(pin.exact.G_BBcm_B(2, 2) / k2, r * r / 2, 1e-10) << unit;
    EXPECT_NEAR(pin.exact.G_BBcm_B(0, 0) / k2, (3 * r * r + h * h) / 12.0, 1e-10) << unit;
    EXPECT_LT((instance(product, "Pin").X_WB.p / k - Vec3(0, 0, -0.005)).norm(), 1e-9) << unit;
    EXPECT_TRUE(check_closed(plate.mesh).ok());
    EXPECT_NEAR(volume_properties(pin.mesh).volume, pin.exact.volume, 0.02 * pin.exact.volume);
    int concave = 0, planes = 0;
    for (const product::Face& face : plate.faces) {
      concave += face.kind == product::SurfaceKind::cylinder && face.concave ? 1 : 0;
      planes += face.kind == product::SurfaceKind::plane ? 1 : 0;
    }
    EXPECT_GE(concave, 1);
    EXPECT_EQ(planes, 6);
  }
}

TEST_F(StepReader, TheUnitIsThatOfTheFile) {
  StepProduct made("Assembly");
  made.use(made.root(), made.part("Box", box(0.05, 0.04, 0.03)), "Box", moved_by(0, 0, 0.1));
  made.write(file());
  std::ifstream in(file(), std::ios::binary);
  std::string text((std::istreambuf_iterator<char>(in)), {});
  const std::string millimetre = "SI_UNIT(.MILLI.,.METRE.)";
  std::size_t at = text.find(millimetre);
  ASSERT_NE(at, std::string::npos);
  for (; at != std::string::npos; at = text.find(millimetre))
    text.replace(at, millimetre.size(), "SI_UNIT($,.METRE.)");
  std::ofstream(file(), std::ios::binary) << text;
  const Product product = read_step(file());
  EXPECT_NEAR(product.bodies.at(0).exact.volume, 0.05 * 0.04 * 0.03, 1e-12);
  EXPECT_LT((product.instances.at(0).X_WB.p - Vec3(0, 0, 0.1)).norm(), 1e-9);
}

TEST_F(StepReader, StructureNamesColoursAndMaterialsAreKept) {
  StepProduct made("Gearbox 3");
  const TDF_Label bolt = made.part("Screw M6x20", cylinder(3, 20)), group = made.assembly("Cover group");
  made.colour(bolt, 0.2, 0.4, 0.6);
  made.material(bolt, "Titan Grade 5", 4.43);
  gp_Trsf turned;
  turned.SetRotation(gp_Ax1(gp_Pnt(0, 0, 0), gp_Dir(1, 0, 0)), M_PI / 2);
  made.use(group, bolt, "Screw M6x20", moved_by(10, 0, 0));
  made.use(group, bolt, "Screw M6x20", moved_by(20, 0, 0) * turned);
  made.use(made.root(), group, "Cover group", moved_by(0, 0, 100));
  made.use(made.root(), made.part("Gehäuse", box(50, 40, 30)), "Gehäuse");
  made.write(file());
  const Product product = read_step(file());
  EXPECT_EQ(product.name, "Gearbox 3");
  std::vector<std::string> names, paths;
  for (const Instance& one : product.instances) names.push_back(one.name), paths.push_back(one.path);
  EXPECT_EQ(product.bodies.size(), 2U);
  EXPECT_THAT(names, ElementsAre("Screw_M6x20", "Screw_M6x20_2", testing::StartsWith("Geh")));
  EXPECT_EQ(paths[0], "Gearbox 3/Cover group/Screw M6x20");
  const Instance& second = instance(product, "Screw_M6x20_2");
  EXPECT_LT((second.X_WB * Vec3(0, 0, 0.02) - Vec3(0.02, -0.02, 0.1)).norm(), 1e-9);
  const product::Body& body = product.bodies[second.body];
  EXPECT_EQ(body.material.name, "Titan Grade 5");
  EXPECT_NEAR(body.material.density_kg_m3, 4430.0, 1e-6);
  EXPECT_FALSE(body.material.assumed);
  ASSERT_TRUE(body.colour.has_value());
  EXPECT_NEAR((*body.colour)[2], 0.6, 0.01);
  const product::Body& housing = product.bodies[product.instances[2].body];
  EXPECT_TRUE(housing.material.assumed);
  EXPECT_EQ(housing.material.density_kg_m3, 7850.0);
}

TEST_F(StepReader, DensitiesCountInTheirUnit) {
  StepProduct made("A");
  const TDF_Label part = made.part("Housing", box(10, 10, 10));
  made.material(part, "Steel", 7.85);
  made.use(made.root(), part, "Housing");
  made.write(file());
  std::ifstream in(file(), std::ios::binary);
  const std::string text((std::istreambuf_iterator<char>(in)), {});
  ASSERT_NE(text.find("7.85"), text.npos);
  struct Stated {
    std::string value, gram, centimetre;
    double density_kg_m3;
  };
  for (const Stated& stated :
       {Stated{"7.85", "SI_UNIT($,.GRAM.)", "SI_UNIT(.CENTI.,.METRE.)", 7850.0},
        Stated{"2700.", "SI_UNIT(.KILO.,.GRAM.)", "SI_UNIT($,.METRE.)", 2700.0},
        Stated{"2.7E-06", "SI_UNIT(.KILO.,.GRAM.)", "SI_UNIT(.MILLI.,.METRE.)", 2700.0},
        Stated{"0.00785", "SI_UNIT($,.GRAM.)", "SI_UNIT(.MILLI.,.METRE.)", 7850.0}}) {
    std::string changed = std::regex_replace(text, std::regex("7\\.85\\d*"), stated.value);
    changed = std::regex_replace(changed, std::regex(R"(SI_UNIT\(\$,\.GRAM\.\))"),
                                 std::regex_replace(stated.gram, std::regex("\\$"), "$$$$"));
    changed = std::regex_replace(changed, std::regex(R"(SI_UNIT\(\.CENTI\.,\.METRE\.\))"),
                                 std::regex_replace(stated.centimetre, std::regex("\\$"), "$$$$"));
    std::ofstream(file(), std::ios::binary) << changed;
    const Product product = read_step(file());
    EXPECT_NEAR(product.bodies.at(0).material.density_kg_m3, stated.density_kg_m3, 1e-6)
        << stated.gram << stated.centimetre;
    EXPECT_FALSE(product.bodies.at(0).material.assumed);
    EXPECT_NEAR(product.bodies.at(0).exact.volume, 1e-6, 1e-15);
  }
}

TEST_F(StepReader, DensitiesThatNoSolidHasAreReported) {
  StepProduct made("A");
  const TDF_Label part = made.part("Housing", box(10, 10, 10));
  made.material(part, "Aluminium", 7.85e-6);
  made.use(made.root(), part, "Housing");
  made.write(file());
  const Product product = read_step(file());
  EXPECT_TRUE(product.bodies.at(0).material.assumed);
  EXPECT_NEAR(product.bodies.at(0).material.density_kg_m3, 2700.0, 100.0) << "aluminium by its name";
  EXPECT_THAT(product.notes, testing::Contains(testing::HasSubstr("which no solid has")));
}

TEST_F(StepReader, DensitiesCanBeGiven) {
  StepProduct made("A");
  made.use(made.root(), made.part("Housing", box(10, 10, 10)), "Housing");
  made.use(made.root(), made.part("Lid", box(10, 10, 2)), "Lid", moved_by(0, 0, 10));
  made.write(file());
  StepOptions options;
  options.densities = {{"Housing", 2700.0}, {"*", 1000.0}};
  const Product product = read_step(file(), options);
  EXPECT_EQ(product.bodies[instance(product, "Housing").body].material.density_kg_m3, 2700.0);
  EXPECT_EQ(product.bodies[instance(product, "Lid").body].material.density_kg_m3, 1000.0);
}

TEST_F(StepReader, FitsInterferencesAndPlanesAreRecognised) {
  StepProduct made("Fits");
  made.use(made.root(), made.part("Base", bored(60, 20, 8)), "Base");
  made.use(made.root(), made.part("Pressed", cylinder(8.012, 20)), "Pressed");
  made.use(made.root(), made.part("Cover", bored(60, 5, 9)), "Cover", moved_by(0, 0, 20));
  made.write(file());
  Product product = read_step(file());
  product.contacts = product::find_contacts(product);
  ASSERT_EQ(product.contacts.size(), 2U);
  for (const product::Contact& contact : product.contacts) {
    if (contact.kind == product::ContactKind::cylinder_fit)
      EXPECT_NEAR(contact.clearance_m, -12e-6, 1e-9);
    else
      EXPECT_NEAR(contact.area_m2, 0.06 * 0.06 - M_PI * 0.009 * 0.009, 2e-6);
  }
  const product::Disassembly plan = product::take_apart(product);
  EXPECT_TRUE(plan.stuck.empty());
  EXPECT_EQ(product.instances[plan.base].name, "Base");
}

TEST_F(StepReader, DamagedFilesAreReportedOrReadWhole) {
  StepProduct made("Cut");
  made.use(made.root(), made.part("Plate", bored(60, 10, 8)), "Plate");
  made.use(made.root(), made.part("Pin", cylinder(7.9, 30)), "Pin", moved_by(0, 0, -5));
  made.use(made.root(), made.part("Block", box(10, 20, 30)), "Block", moved_by(0, 0, 40));
  made.write(file());
  std::ifstream in(file(), std::ios::binary);
  const std::string whole((std::istreambuf_iterator<char>(in)), {});
  const Product expected = read_step(file());
  EXPECT_THAT(expected.notes, testing::IsEmpty());
  for (int percent = 0; percent < 100; ++percent) {
    const auto cut = directory_ / "cut.step";
    std::ofstream(cut, std::ios::binary)
        << whole.substr(0, whole.size() * static_cast<std::size_t>(percent) / 100);
    try {
      read_step(cut);
      ADD_FAILURE() << percent << " % of the file passed for a product";
    } catch (const CadError& error) {
      EXPECT_THAT(error.what(), HasSubstr("cut.step: ")) << percent;
    }
    // With the end in place, entities are missing: an error, or a note and no more than the whole.
    std::ofstream(cut, std::ios::binary)
        << whole.substr(0, whole.size() * static_cast<std::size_t>(percent) / 100)
        << "\nENDSEC;\nEND-ISO-10303-21;\n";
    try {
      const Product product = read_step(cut);
      EXPECT_LE(product.instances.size(), expected.instances.size()) << percent;
      if (product.instances.size() < expected.instances.size()) {
        EXPECT_THAT(product.notes, testing::Contains(testing::AnyOf(
                                       HasSubstr("entities that it does not contain"),
                                       HasSubstr("was cut off"), HasSubstr("that nothing uses"))))
            << percent;
      }
      for (const product::Body& body : product.bodies) EXPECT_TRUE(check_closed(body.mesh).ok()) << percent;
    } catch (const CadError& error) {
      EXPECT_THAT(error.what(), HasSubstr("cut.step: ")) << percent;
    }
  }
}

TEST_F(StepReader, OtherFilesAreRefusedByName) {
  const auto error = [&](const std::string& text) {
    std::ofstream(file()) << text;
    try {
      read_step(file());
    } catch (const CadError& e) {
      return std::string(e.what());
    }
    return std::string("no error");
  };
  EXPECT_THAT(error(""), HasSubstr("does not begin with ISO-10303-21"));
  EXPECT_THAT(error("solid cube\nendsolid\n"), HasSubstr("does not begin with ISO-10303-21"));
  EXPECT_THAT(error("ISO-10303-21;\nHEADER;\n"), HasSubstr("ends before END-ISO-10303-21"));
  std::filesystem::remove(file());
  EXPECT_THROW(read_step(file()), CadError);
}

TEST_F(StepReader, TheProgramAndItsCommandOfTaktWriteTheCell) {
  StepProduct made("Stack");
  made.use(made.root(), made.part("Base", box(60, 60, 10)), "Base");
  made.use(made.root(), made.part("Block", box(20, 20, 10)), "Block", moved_by(20, 20, 10));
  made.write(file());
  for (const char* command : {"takt-from-cad", "takt from-cad"}) {
    const std::string program = std::string(TAKT_BIN_DIR "/") + command;
    if (!std::filesystem::exists(program.substr(0, program.find(' ')))) continue;  // built without DDS
    const auto out = directory_ / "out";
    std::filesystem::remove_all(out);
    EXPECT_EQ(
        std::system((program + " " + file().string() + " -o " + out.string() + " > /dev/null 2>&1").c_str()),
        0)
        << command;
    EXPECT_TRUE(std::filesystem::exists(out / "Stack.yaml")) << command;
    // A picture without content has less than 8 kB.
    EXPECT_GT(std::filesystem::file_size(out / "exploded.png"), 16U * 1024U) << command;
    EXPECT_NE(
        std::system((program + " " + file().string() + "x -o " + out.string() + " > /dev/null 2>&1").c_str()),
        0)
        << command;
  }
}

/// The six faces of a cube of 20 mm, each `gap_mm` away from its neighbours.
TopoDS_Shape faces_apart(double gap_mm) {
  const TopoDS_Shape cube = box(20, 20, 20);
  TopoDS_Compound faces;
  BRep_Builder().MakeCompound(faces);
  for (TopExp_Explorer at(cube, TopAbs_FACE); at.More(); at.Next()) {
    GProp_GProps properties;
    BRepGProp::SurfaceProperties(at.Current(), properties);
    gp_Vec out(gp_Pnt(10, 10, 10), properties.CentreOfMass());
    out.Normalize();
    gp_Trsf X;
    X.SetTranslation(gap_mm / std::sqrt(2.0) * out);
    BRep_Builder().Add(faces, BRepBuilderAPI_Transform(at.Current(), X, true).Shape());
  }
  return faces;
}

TEST_F(StepReader, SurfacesThatNearlyMeetAreSewn) {
  StepProduct made("Cubes");
  made.use(made.root(), made.part("Near", faces_apart(0.005)), "Near");
  made.use(made.root(), made.part("Far", faces_apart(0.5)), "Far", moved_by(40, 0, 0));
  made.write(file());
  const Product product = read_step(file());
  ASSERT_EQ(product.instances.size(), 1U);
  EXPECT_EQ(product.instances[0].name, "Near");
  const product::Body& body = product.bodies[0];
  EXPECT_NEAR(body.exact.volume, 8e-6, 0.005 * 8e-6);
  EXPECT_TRUE(check_closed(body.mesh).ok());
  EXPECT_THAT(
      product.notes,
      testing::UnorderedElementsAre(
          testing::MatchesRegex("Near: its surfaces are sewn to 1 solid, over gaps of at most 0.00[0-9]+ mm"),
          HasSubstr("Far: 6 surfaces bound no solid and are left out")));
}

TEST_F(StepReader, ARobotTakesTheProductOfAFileApartAndPutsItTogether) {
  StepProduct made("Stack");
  made.use(made.root(), made.part("Base", box(60, 60, 10)), "Base");
  made.use(made.root(), made.part("Block", box(20, 20, 10)), "Block", moved_by(20, 20, 10));
  made.use(made.root(), made.part("Cap", box(10, 16, 8)), "Cap", moved_by(25, 22, 20));
  made.write(file());
  const auto out = (directory_ / "out").string();
  const auto run = [](const std::string& command) {
    return std::system((std::string(TAKT_BIN_DIR "/") + command + " > /dev/null 2>&1").c_str());
  };
  ASSERT_EQ(run("takt-from-cad " + file().string() + " --robot -o " + out), 0);
  // The exit code says whether each part is where it was.
  EXPECT_EQ(run("takt-run run " + out + "/Stack_robot.yaml --report " + out + "/report.json"), 0);
  std::ifstream in(out + "/report.json");
  const std::string report((std::istreambuf_iterator<char>(in)), {});
  EXPECT_THAT(report, HasSubstr("lift Cap"));
  EXPECT_THAT(report, HasSubstr("assemble Block"));
}

TEST_F(StepReader, WhatFallsInARunOfTheCellIsHeldByAPad) {
  // The pin has 0.29 mm of clearance and nothing below it: it falls, though it touches the plate by the tolerances of a fit.
  StepProduct made("Loose");
  made.use(made.root(), made.part("Plate", bored(60, 10, 8.29)), "Plate");
  made.use(made.root(), made.part("Pin", cylinder(8, 30)), "Pin", moved_by(0, 0, -5));
  made.use(made.root(), made.part("Block", box(12, 12, 10)), "Block", moved_by(15, 15, 10));
  made.write(file());
  const auto out = (directory_ / "out").string();
  const auto run = [](const std::string& command) {
    return std::system((std::string(TAKT_BIN_DIR "/") + command).c_str());
  };
  ASSERT_EQ(
      run("takt-from-cad " + file().string() + " --robot -o " + out + " > /dev/null 2> " + out + ".txt"), 0);
  const auto text = [](const std::string& name) {
    std::ifstream in(name);
    return std::string((std::istreambuf_iterator<char>(in)), {});
  };
  EXPECT_THAT(text(out + ".txt"), testing::AllOf(HasSubstr("no part or post holds Pin at level 1"),
                                                 testing::Not(HasSubstr("does not"))));
  EXPECT_THAT(text(out + "/Loose_robot.lua"), testing::AllOf(HasSubstr("lift Block"), HasSubstr("lift Pin")));
  for (const char* name : {"Loose", "Loose_robot"})
    EXPECT_EQ(run("takt-run run " + out + "/" + name + ".yaml > /dev/null 2>&1"), 0) << name;
}

TEST_F(StepReader, MeshesOfManyFitsHaveABoundedNumberOfTriangles) {
  // 25 holes of 2 x 198 triangles, with twice as many in the faces around them, are more than 20 000; the pin that all of
  // them share stays fine.
  StepProduct made("Rack");
  TopoDS_Compound holes;
  BRep_Builder().MakeCompound(holes);
  const TDF_Label pin = made.part("Pin", cylinder(20, 20));
  for (int i = 0; i < 25; ++i) {
    const gp_Trsf there = moved_by(50.0 * (i % 5) + 25, 50.0 * (i / 5) + 25, 5);
    BRep_Builder().Add(holes, cylinder(20.01, 20).Moved(TopLoc_Location(there)));
    made.use(made.root(), pin, "Pin", there);
  }
  made.use(made.root(), made.part("Plate", BRepAlgoAPI_Cut(box(250, 250, 20), holes).Shape()), "Plate");
  made.write(file());
  const auto out = directory_ / "out", said = directory_ / "said.txt";
  const std::string command = std::string(TAKT_BIN_DIR "/takt-from-cad ") + file().string() + " -o " +
                              out.string() + " > /dev/null 2> " + said.string();
  ASSERT_EQ(std::system(command.c_str()), 0);
  const auto text = [](const std::filesystem::path& name) {
    std::ifstream in(name);
    return std::string((std::istreambuf_iterator<char>(in)), {});
  };
  EXPECT_THAT(text(said),
              testing::AllOf(testing::ContainsRegex("Plate: a mesh .* has [0-9]+ triangles, more than 20000: "
                                                    "it is [0-9.]+ times further from the surface"),
                             testing::Not(HasSubstr("Pin: "))));
  const auto triangles = [&](const std::string& name) {
    const std::string mesh = text(out / "meshes" / name);
    int count = 0;
    for (std::size_t at = 0; (at = mesh.find("\nf ", at)) != std::string::npos; ++at) ++count;
    return count;
  };
  EXPECT_GT(triangles("Plate.obj"), 8'000) << "finer than without fits";
  EXPECT_LE(triangles("Plate.obj"), 20'000);
}

TEST_F(StepReader, NoCellWithARobotIsWrittenWhereItCanMoveNothing) {
  // A thin pin whose ends are flush with the plate: no jaw reaches its sides, and the smallest cup is wider.
  StepProduct made("Loose");
  made.use(made.root(), made.part("Plate", bored(60, 10, 0.41)), "Plate");
  made.use(made.root(), made.part("Pin", cylinder(0.4, 10)), "Pin");
  made.write(file());
  const auto out = directory_ / "out", said = directory_ / "said.txt";
  const std::string command = std::string(TAKT_BIN_DIR "/takt-from-cad ") + file().string() + " --robot -o " +
                              out.string() + " > /dev/null 2> " + said.string();
  ASSERT_EQ(std::system(command.c_str()), 0);
  std::ifstream in(said);
  EXPECT_THAT(std::string((std::istreambuf_iterator<char>(in)), {}), HasSubstr("takes no part out"));
  EXPECT_TRUE(std::filesystem::exists(out / "Loose.yaml"));
  EXPECT_FALSE(std::filesystem::exists(out / "Loose_robot.yaml"));
  EXPECT_FALSE(std::filesystem::exists(out / "Loose_robot.lua"));
}

TEST_F(StepReader, ARobotTakesScrewsAndNutsOut) {
  StepProduct made("Clamp");
  const auto bolt =
      BRepAlgoAPI_Fuse(cylinder(4.95, 45),
                       BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(0, 0, 45), gp_Dir(0, 0, 1)), 8, 6).Shape())
          .Shape();
  const TDF_Label screw = made.part("M10 bolt", bolt), nut = made.part("M10 nut", bored(16, 8, 5));
  const TopoDS_Shape hole = BRepPrimAPI_MakeCylinder(5.1, 20).Shape();
  const auto drilled = [&](const TopoDS_Shape& shape) {
    TopoDS_Shape result = shape;
    for (const double x : {-30.0, 30.0}) {
      const TopLoc_Location there(moved_by(x, 0, 0));
      result = BRepAlgoAPI_Cut(result, hole.Moved(there)).Shape();
    }
    return result;
  };
  const auto plate = [](double x, double y, double z) {
    return BRepPrimAPI_MakeBox(gp_Pnt(-x / 2, -y / 2, 0), x, y, z).Shape();
  };
  made.use(made.root(), made.part("Plate", drilled(plate(140, 80, 20))), "Plate", moved_by(0, 0, 15));
  made.use(made.root(), made.part("Cover", drilled(plate(100, 40, 10))), "Cover", moved_by(0, 0, 35));
  for (const double x : {-30.0, 30.0}) {
    made.use(made.root(), screw, "M10 bolt", moved_by(x, 0, 0));
    made.use(made.root(), nut, "M10 nut", moved_by(x, 0, 7));
  }
  made.write(file());
  const auto out = (directory_ / "out").string();
  const auto run = [](const std::string& command) {
    return std::system((std::string(TAKT_BIN_DIR "/") + command + " > /dev/null 2>&1").c_str());
  };
  ASSERT_EQ(run("takt-from-cad " + file().string() + " --robot -o " + out), 0);
  EXPECT_EQ(run("takt-run run " + out + "/Clamp_robot.yaml --report " + out + "/report.json"), 0);
  std::ifstream in(out + "/report.json");
  const std::string report((std::istreambuf_iterator<char>(in)), {});
  for (const char* step : {"unscrew M10_nut\"", "unscrew M10_nut_2\"", "lift M10_bolt\"", "lift M10_bolt_2\"",
                           "lift Cover\"", "assemble Cover\"", "assemble M10_nut\""})
    EXPECT_THAT(report, HasSubstr(step));
}

}  // namespace
}  // namespace takt::cad
