// Products whose structure is awkward: parts in files of their own, names that repeat.
#include <gmock/gmock.h>

#include <fstream>
#include <functional>
#include <iterator>
#include <regex>
#include <set>
#include <tuple>

#include "server/cad/step_reader.h"
#include "tests/cad/step_files.h"
#include "tests/support/temporary_directory.h"

namespace takt::cad {
namespace {

using product::Instance;
using product::Product;
using test::box;
using test::moved_by;
using test::StepProduct;
using testing::IsEmpty;
using testing::UnorderedElementsAre;

/// Volume (cm^3) and height (cm) of each instance.
std::vector<std::pair<double, double>> places(const Product& product) {
  std::vector<std::pair<double, double>> result;
  for (const Instance& one : product.instances)
    result.emplace_back(std::round(product.bodies[one.body].exact.volume * 1e9) * 1e-3,
                        std::round(one.X_WB.p.z() * 1e5) * 1e-3);
  return result;
}

/// A base, and two groups of a plate and a block at heights of 10 and 60 mm.
StepProduct nested() {
  StepProduct made("Tower");
  const TDF_Label plate = made.part("Plate", box(50, 40, 10)), block = made.part("Block", box(10, 20, 30)),
                  group = made.assembly("Group");
  made.use(group, plate, "Plate");
  made.use(group, block, "Block", moved_by(0, 0, 10));
  made.use(made.root(), made.part("Base", box(80, 80, 10)), "Base");
  made.use(made.root(), group, "Group", moved_by(0, 0, 10));
  made.use(made.root(), group, "Group", moved_by(0, 0, 60));
  return made;
}

TEST(StepStructure, PartsInFilesOfTheirOwnStandWhereTheyStandInOneFile) {
  const test::TemporaryDirectory directory;
  const auto whole = directory / "whole.step", apart = directory / "apart.step";
  nested().write(whole);
  nested().write_apart(apart, "part_");
  std::vector<std::filesystem::path> others;
  for (const auto& entry : std::filesystem::directory_iterator(directory.path()))
    if (entry.path() != whole && entry.path() != apart) others.push_back(entry.path());
  ASSERT_GE(others.size(), 3U);  // plate, block, base
  const Product expected = read_step(whole), product = read_step(apart);
  EXPECT_THAT(product.notes, IsEmpty());
  EXPECT_EQ(product.instances.size(), 5U);
  EXPECT_EQ(product.bodies.size(), 3U);
  EXPECT_THAT(places(product), testing::UnorderedElementsAreArray(places(expected)));
  EXPECT_THAT(places(expected),
              UnorderedElementsAre(std::pair(64.0, 0.0), std::pair(20.0, 1.0), std::pair(6.0, 2.0),
                                   std::pair(20.0, 6.0), std::pair(6.0, 7.0)));
  // Without one of the files its parts are missing, and the file is named.
  std::size_t reported = 0;
  for (const std::filesystem::path& other : others) {
    const auto hidden = directory / "hidden";
    std::filesystem::rename(other, hidden);
    try {
      const Product rest = read_step(apart);
      EXPECT_LT(rest.instances.size(), 5U) << other;
      for (const std::string& note : rest.notes)
        reported += note.find(other.filename().string()) != note.npos ? 1 : 0;
    } catch (const CadError& error) {
      reported += std::string(error.what()).find(other.filename().string()) != std::string::npos ? 1 : 0;
      EXPECT_THAT(error.what(), testing::HasSubstr("put the files that it refers to into its folder"));
    }
    std::filesystem::rename(hidden, other);
  }
  EXPECT_EQ(reported, others.size());
}

/// The text of a file, changed.
void rewrite(const std::filesystem::path& file, const std::function<void(std::string&)>& change) {
  std::ifstream in(file);
  std::string text((std::istreambuf_iterator<char>(in)), {});
  in.close();
  change(text);
  std::ofstream(file) << text;
}

TEST(StepStructure, SourcesOfPartsThatTheFileContainsAreNotMissing) {
  // CATIA writes the shapes into the file and names the documents that they come from.
  const test::TemporaryDirectory directory;
  const auto file = directory / "product.step";
  nested().write(file);
  int documents = 0;
  rewrite(file, [&](std::string& text) {
    const std::regex definition(R"(PRODUCT_DEFINITION\('design','',(#[0-9]+),(#[0-9]+)\))");
    std::string changed, entities;
    auto rest = text.cbegin();
    for (std::smatch found; std::regex_search(rest, text.cend(), found, definition); rest = found[0].second) {
      const std::string number = std::to_string(90001 + 2 * documents),
                        type = std::to_string(90002 + 2 * documents);
      ++documents;
      changed.append(rest, found[0].first);
      changed += "PRODUCT_DEFINITION_WITH_ASSOCIATED_DOCUMENTS('design',''," + found[1].str() + "," +
                 found[2].str() + ",(#" + number + "))";
      entities += "#" + number + " = DOCUMENT('1','" + number + ".CATPart','CATPart document',#" + type +
                  ");\n#" + type + " = DOCUMENT_TYPE('');\n";
    }
    changed.append(rest, text.cend());
    changed.insert(changed.rfind("ENDSEC;"), entities);
    text = changed;
  });
  ASSERT_EQ(documents, 5);
  const Product product = read_step(file);
  EXPECT_EQ(product.instances.size(), 5U);
  EXPECT_THAT(product.notes, IsEmpty());
}

TEST(StepStructure, NamesThatRepeatBecomeNamesOfTheirOwn) {
  const test::TemporaryDirectory directory;
  StepProduct made("Part");
  const TDF_Label first = made.part("Part", box(10, 10, 10)), second = made.part("Part", box(10, 10, 20)),
                  group = made.assembly("Part");
  made.use(group, first, "Part");
  made.use(group, second, "Part", moved_by(20, 0, 0));
  made.use(made.root(), group, "Part");
  made.use(made.root(), group, "Part", moved_by(0, 0, 50));
  made.use(made.root(), first, "Part_2", moved_by(0, 40, 0));
  made.write(directory / "product.step");
  const Product product = read_step(directory / "product.step");
  std::set<std::string> names;
  for (const Instance& one : product.instances) names.insert(one.name);
  EXPECT_EQ(product.instances.size(), 5U);
  EXPECT_EQ(names.size(), 5U);
  EXPECT_EQ(product.bodies.size(), 2U);
  EXPECT_THAT(places(product),
              UnorderedElementsAre(std::pair(1.0, 0.0), std::pair(2.0, 0.0), std::pair(1.0, 5.0),
                                   std::pair(2.0, 5.0), std::pair(1.0, 0.0)));
}

TEST(StepStructure, UsesThatCadProgramsNamedHaveTheNameOfTheirPart) {
  const test::TemporaryDirectory directory;
  StepProduct made("Rack");
  const TDF_Label part = made.part("Panel", box(10, 10, 10)),
                  other = made.part("Open CASCADE STEP translator 7.6 1.1", box(10, 10, 20)),
                  group = made.assembly("Left side");
  int row = 0;
  for (const char* name : {"*DIT37", "Next assembly relationship", " ", "NAUO12", "17", "Door"})
    made.use(made.root(), part, name, moved_by(20.0 * ++row, 0, 0));
  made.use(group, other, "=>[0:1:1:2]");
  made.use(made.root(), group, "(Unsaved)");
  made.write(directory / "product.step");
  std::vector<std::string> names;
  for (const Instance& one : read_step(directory / "product.step").instances) names.push_back(one.name);
  EXPECT_THAT(names,
              testing::ElementsAre("Panel", "Panel_2", "Panel_3", "Panel_4", "Panel_5", "Door", "Left_side"));
}

/// A block of 10 x 20 x 30 mm whose placement is an operator: axes x, (0, `y`, 0) and z, origin (40, 0, 0).
std::string placed_by_operator(const test::TemporaryDirectory& directory, const std::string& y,
                               const std::string& scale) {
  StepProduct made("Pair");
  made.use(made.root(), made.part("Block", box(10, 20, 30)), "Block", moved_by(40, 0, 0));
  made.write(directory / "product.step");
  std::ifstream in(directory / "product.step");
  const std::string text((std::istreambuf_iterator<char>(in)), {});
  const std::regex placement(R"((#\d+) = ITEM_DEFINED_TRANSFORMATION\('','',#\d+,#\d+\);)");
  const std::string operation =
      "$1 = CARTESIAN_TRANSFORMATION_OPERATOR_3D('','','',#90001,#90002,#90004," + scale +
      ",#90003);\n#90001 = DIRECTION('',(1.,0.,0.));\n#90002 = DIRECTION('',(0.," + y +
      ",0.));\n#90003 = DIRECTION('',(0.,0.,1.));\n#90004 = CARTESIAN_POINT('',(40.,0.,0.));";
  return std::regex_replace(text, placement, operation, std::regex_constants::format_first_only);
}

TEST(StepStructure, OperatorsThatMirrorOrScaleAreFollowed) {
  const test::TemporaryDirectory directory;
  const auto metres = [](const std::string& text) {
    return std::regex_replace(text, std::regex(R"(SI_UNIT\(\.MILLI\.,\.METRE\.\))"), "SI_UNIT($,.METRE.)");
  };
  for (const auto& [y, scale, unit] :
       {std::tuple("1.", 1.0, 1e-3), std::tuple("-1.", 1.0, 1e-3), std::tuple("1.", 2.0, 1e-3),
        std::tuple("-1.", 0.5, 1e-3), std::tuple("-1.", 0.5, 1.0)}) {
    const std::string text = placed_by_operator(directory, y, std::to_string(scale));
    std::ofstream(directory / "operator.step") << (unit == 1.0 ? metres(text) : text);
    const Product product = read_step(directory / "operator.step");
    EXPECT_THAT(product.notes, testing::Not(testing::Contains(testing::HasSubstr("mirror"))));
    ASSERT_EQ(product.instances.size(), 1U);
    const Instance& one = product.instances[0];
    const product::Body& body = product.bodies[one.body];
    const double side = y[0] == '-' ? -1.0 : 1.0;
    const Vec3 centre(40.0 + scale * 5.0, side * scale * 10.0, scale * 15.0);
    EXPECT_LT((one.X_WB * body.exact.p_BBcm - unit * centre).norm(), 1e-9 * unit * 1e3) << y << scale;
    EXPECT_NEAR(body.exact.volume / std::pow(unit * scale, 3), 6000.0, 1e-3) << y << scale;
    EXPECT_GT(volume_properties(body.mesh).volume, 0.0);
    Vec3 least = Vec3::Constant(1e9), most = -least;
    for (const Vec3& v : body.mesh.vertices)
      least = least.cwiseMin(one.X_WB * v), most = most.cwiseMax(one.X_WB * v);
    EXPECT_LT((most - least - unit * scale * Vec3(10, 20, 30)).norm(), 1e-9 * unit * 1e3);
  }
}

std::string error_of(const std::filesystem::path& file) {
  try {
    read_step(file);
  } catch (const CadError& error) {
    return error.what();
  }
  return "no error";
}

/// A part of a block of 10 x 20 x 30 mm and of the same block by MAPPED_ITEM with an operator: axes x, (0, `y`, 0) and z,
/// origin (40, 0, 0). With `again`, that item stands in a representation which the part has by the same operator.
std::string mapped_by_operator(const test::TemporaryDirectory& directory, const std::string& y,
                               const std::string& scale, bool again) {
  StepProduct made("Twins");
  made.part("Block", box(10, 20, 30));
  made.write(directory / "product.step");
  std::ifstream in(directory / "product.step");
  std::string text((std::istreambuf_iterator<char>(in)), {});
  std::smatch brep;
  EXPECT_TRUE(std::regex_search(
      text, brep,
      std::regex(R"((#\d+) = ADVANCED_BREP_SHAPE_REPRESENTATION\('',\((#\d+),(#\d+)\),(#\d+)\))")));
  const std::string whole = brep[1], axes = brep[2], solid = brep[3], context = brep[4];
  // The part is two uses of what was the part.
  std::string added =
      "#90001 = DIRECTION('',(1.,0.,0.));\n#90002 = DIRECTION('',(0.," + y +
      ",0.));\n#90003 = DIRECTION('',(0.,0.,1.));\n#90004 = CARTESIAN_POINT('',(40.,0.,0.));\n" +
      "#90005 = CARTESIAN_TRANSFORMATION_OPERATOR_3D('','','',#90001,#90002,#90004," + scale +
      ",#90003);\n#90020 = ADVANCED_BREP_SHAPE_REPRESENTATION('',(" + axes + "," + solid + ")," + context +
      ");\n#90010 = REPRESENTATION_MAP(" + axes + ",#90020);\n" + "#90011 = MAPPED_ITEM('',#90010,#90005);\n";
  if (again)
    added += "#90021 = ADVANCED_BREP_SHAPE_REPRESENTATION('',(" + axes + ",#90011)," + context +
             ");\n#90022 = REPRESENTATION_MAP(" + axes +
             ",#90021);\n#90023 = MAPPED_ITEM('',#90022,#90005);\n";
  text.replace(static_cast<std::size_t>(brep.position(0)), static_cast<std::size_t>(brep.length(0)),
               whole + " = ADVANCED_BREP_SHAPE_REPRESENTATION('',(" + axes + "," + solid +
                   (again ? ",#90023)," : ",#90011),") + context + ")");
  text.insert(text.rfind("ENDSEC;"), added);
  return text;
}

TEST(StepStructure, OperatorsWithinAPartAreFollowed) {
  const test::TemporaryDirectory directory;
  for (const auto& [y, scale] :
       {std::pair("1.", 1.0), std::pair("-1.", 1.0), std::pair("-1.", 0.5), std::pair("1.", 2.0)}) {
    std::ofstream(directory / "mapped.step")
        << mapped_by_operator(directory, y, std::to_string(scale), false);
    const Product product = read_step(directory / "mapped.step");
    ASSERT_EQ(product.instances.size(), 2U) << y << scale;
    const auto centre = [&](std::size_t i) -> Vec3 {
      return product.instances[i].X_WB * product.bodies[product.instances[i].body].exact.p_BBcm;
    };
    const double side = y[0] == '-' ? -1.0 : 1.0;
    EXPECT_LT((centre(0) - 1e-3 * Vec3(5.0, 10.0, 15.0)).norm(), 1e-9);
    const Vec3 expected(40.0 + scale * 5.0, side * scale * 10.0, scale * 15.0);
    EXPECT_LT((centre(1) - 1e-3 * expected).norm(), 1e-9) << y << scale;
    const product::Body& body = product.bodies[product.instances[1].body];
    EXPECT_NEAR(body.exact.volume * 1e9, 6000.0 * std::pow(scale, 3), 1e-3);
    EXPECT_NEAR(volume_properties(body.mesh).volume * 1e9, 6000.0 * std::pow(scale, 3), 1e-3);
  }
}

TEST(StepStructure, OperatorsOnTopOfEachOtherAreFollowedOrRefused) {
  const test::TemporaryDirectory directory;
  const auto file = directory / "again.step";
  std::ofstream(file) << mapped_by_operator(directory, "1.", "1.", true);
  const Product product = read_step(file);
  ASSERT_EQ(product.instances.size(), 2U);
  EXPECT_LT((product.instances[1].X_WB * product.bodies[product.instances[1].body].exact.p_BBcm -
             1e-3 * Vec3(85.0, 10.0, 15.0))
                .norm(),
            1e-9);
  std::ofstream(file) << mapped_by_operator(directory, "-1.", "0.5", true);
  EXPECT_THAT(error_of(file), testing::HasSubstr("mirrors or scales is combined with another placement"));
}

TEST(StepStructure, AssembliesThatDoubleAtEachLevelEndAtTheLimit) {
  const test::TemporaryDirectory directory;
  for (const int levels : {3, 15}) {
    StepProduct made("Tower");
    TDF_Label inner = made.part("Block", box(1, 1, 1));
    double length = 1.0;
    for (int i = 0; i < levels; ++i, length *= 2.0) {
      const TDF_Label outer = i + 1 == levels ? made.root() : made.assembly("Level " + std::to_string(i));
      made.use(outer, inner, "a");
      made.use(outer, inner, "b", moved_by(length, 0, 0));
      inner = outer;
    }
    made.write(directory / "tower.step");
    if (levels == 3)
      EXPECT_EQ(read_step(directory / "tower.step").instances.size(), 8U);
    else
      EXPECT_THAT(error_of(directory / "tower.step"),
                  testing::HasSubstr("assembly 'Tower' uses parts and assemblies more than 20000 times"));
  }
}

TEST(StepStructure, AnAssemblyThatUsesItselfIsNamed) {
  const test::TemporaryDirectory directory;
  nested().write(directory / "product.step");
  std::ifstream in(directory / "product.step");
  std::string text((std::istreambuf_iterator<char>(in)), {});
  std::smatch use;
  ASSERT_TRUE(std::regex_search(
      text, use,
      std::regex(R"(NEXT_ASSEMBLY_USAGE_OCCURRENCE\('[^']*','Group','[^']*',(#\d+),(#\d+),\$\))")));
  const std::string back =
      "#90001 = NEXT_ASSEMBLY_USAGE_OCCURRENCE('9','',''," + use[2].str() + "," + use[1].str() + ",$);\n";
  text.insert(text.rfind("ENDSEC;"), back);
  std::ofstream(directory / "cycle.step") << text;
  EXPECT_THAT(error_of(directory / "cycle.step"), testing::AllOf(testing::HasSubstr("cycle.step: assembly '"),
                                                                 testing::HasSubstr("uses itself")));
}

}  // namespace
}  // namespace takt::cad
