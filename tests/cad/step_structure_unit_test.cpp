// Products whose structure is awkward: parts in files of their own, names that repeat.
#include <gmock/gmock.h>

#include <fstream>
#include <iterator>
#include <regex>
#include <set>

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
    }
    std::filesystem::rename(hidden, other);
  }
  EXPECT_EQ(reported, others.size());
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

TEST(StepStructure, OperatorsThatMirrorOrScaleAreReported) {
  const test::TemporaryDirectory directory;
  StepProduct made("Pair");
  made.use(made.root(), made.part("Block", box(10, 20, 30)), "Block", moved_by(40, 0, 0));
  made.write(directory / "product.step");
  std::ifstream in(directory / "product.step");
  const std::string text((std::istreambuf_iterator<char>(in)), {});
  const std::regex placement(R"((#\d+) = ITEM_DEFINED_TRANSFORMATION\('','',#\d+,#\d+\);)");
  const auto notes_with = [&](const std::string& y, const std::string& scale) {
    const std::string operation =
        "$1 = CARTESIAN_TRANSFORMATION_OPERATOR_3D('','','',#90001,#90002,#90004," + scale +
        ",#90003);\n#90001 = DIRECTION('',(1.,0.,0.));\n#90002 = DIRECTION('',(0.," + y +
        ",0.));\n#90003 = DIRECTION('',(0.,0.,1.));\n#90004 = CARTESIAN_POINT('',(40.,0.,0.));";
    std::ofstream(directory / "operator.step")
        << std::regex_replace(text, placement, operation, std::regex_constants::format_first_only);
    const Product product = read_step(directory / "operator.step");
    EXPECT_THAT(places(product), UnorderedElementsAre(std::pair(6.0, 0.0)));
    EXPECT_NEAR(product.instances.at(0).X_WB.p.x(), 0.04, 1e-9);
    return product.notes;
  };
  EXPECT_THAT(notes_with("1.", "1."), IsEmpty());
  for (const auto& notes : {notes_with("-1.", "1."), notes_with("1.", "2."), notes_with("-1.", "0.5")})
    EXPECT_THAT(notes, testing::ElementsAre(testing::HasSubstr("1 placement mirrors or scales its part")));
}

}  // namespace
}  // namespace takt::cad
