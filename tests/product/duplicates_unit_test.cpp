// Solids that a file has twice at one place.
#include "server/product/duplicates.h"

#include <gmock/gmock.h>

#include <filesystem>

#include "server/product/cell_writer.h"
#include "server/product/contacts.h"
#include "server/product/disassembly.h"
#include "tests/support/product_bodies.h"
#include "tests/support/temporary_directory.h"

namespace takt::product {
namespace {

using test::box_body;
using test::product_of;
using testing::ElementsAre;
using testing::HasSubstr;

std::vector<std::string> names(const Product& product) {
  std::vector<std::string> result;
  for (const Instance& one : product.instances) result.push_back(one.name);
  return result;
}

TEST(Duplicates, ASolidThatStandsTwiceAtOnePlaceIsLeftOutWithANote) {
  const Vec3 size(0.04, 0.03, 0.02);
  Product product = product_of({{box_body("Base", {0.1, 0.1, 0.02}), {0, 0, 0.01}},
                                {box_body("Block", size), {0, 0, 0.03}},
                                {box_body("Copy", size), {0, 0, 0.03}},
                                {box_body("Moved", size), {0, 1e-4, 0.03}},
                                {box_body("Longer", Vec3(0.0401, 0.03, 0.02)), {0, 0, 0.03}}});
  product.instances.push_back(product.instances[0]);
  product.instances.back().name = "Base_2";
  leave_out_duplicates(product);
  EXPECT_THAT(names(product), ElementsAre("Base", "Block", "Moved", "Longer"));
  EXPECT_THAT(
      product.notes,
      ElementsAre(HasSubstr("Copy is left out: the same solid stands at the same place as Block; "),
                  HasSubstr("Base_2 is left out: the same solid stands at the same place as Base; ")));
}

TEST(Duplicates, EqualMassPropertiesOfAnotherShapeAreNoDuplicate) {
  // A square prism that is turned by an eighth has the same volume, centre and inertia.
  Product product = product_of({{box_body("Prism", {0.03, 0.03, 0.05}), {0, 0, 0.03}},
                                {box_body("Turned", {0.03, 0.03, 0.05}), {0, 0, 0.03}}});
  product.instances[1].X_WB.R = Eigen::AngleAxisd(M_PI / 4, Vec3::UnitZ()).toRotationMatrix();
  leave_out_duplicates(product);
  EXPECT_THAT(names(product), ElementsAre("Prism", "Turned"));
  // By a quarter it fills the same space.
  product.instances[1].X_WB.R = Eigen::AngleAxisd(M_PI / 2, Vec3::UnitZ()).toRotationMatrix();
  leave_out_duplicates(product);
  EXPECT_THAT(names(product), ElementsAre("Prism"));
}

TEST(Duplicates, ACellHasNoMeshOfWhatIsLeftOut) {
  const test::TemporaryDirectory directory;
  Product product = product_of({{box_body("Base", {0.1, 0.1, 0.02}), {0, 0, 0.01}},
                                {box_body("Block", {0.04, 0.03, 0.02}), {0, 0, 0.03}},
                                {box_body("Copy", {0.04, 0.03, 0.02}), {0, 0, 0.03}}});
  leave_out_duplicates(product);
  product.contacts = find_contacts(product);
  const Disassembly plan = take_apart(product);
  EXPECT_TRUE(plan.stuck.empty());
  write_cell(product, plan, hierarchy(product, plan), directory.path());
  EXPECT_TRUE(std::filesystem::exists(directory / "meshes/Block.obj"));
  EXPECT_FALSE(std::filesystem::exists(directory / "meshes/Copy.obj"));
}

}  // namespace
}  // namespace takt::product
