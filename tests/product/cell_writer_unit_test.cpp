// The scenario of a product: what its head says, and by how many voxels V-HACD divides its bodies.
#include "server/product/cell_writer.h"

#include <gmock/gmock.h>

#include <fstream>

#include "server/product/contacts.h"
#include "server/scenario/scenario_builder.h"
#include "tests/support/product_bodies.h"
#include "tests/support/temporary_directory.h"

namespace takt::product {
namespace {

using testing::HasSubstr;

std::string text(const std::filesystem::path& file) {
  std::ifstream in(file);
  return std::string((std::istreambuf_iterator<char>(in)), {});
}

/// Plates with large holes whose faces are not known, so that they are not divided exactly.
Product of_plates(int count) {
  std::vector<std::pair<Body, Vec3>> bodies;
  for (int i = 0; i < count; ++i) {
    Body body = test::plate_with_hole("Plate" + std::to_string(i), 0.1, 0.01, 0.03);
    body.faces.clear();
    body.triangle_faces.assign(body.mesh.triangles.size(), -1);
    bodies.emplace_back(std::move(body), Vec3(0.2 * i, 0, 0.005));
  }
  return test::product_of(std::move(bodies));
}

Disassembly whole(const Product& product) {
  Disassembly plan;
  for (std::size_t i = product.instances.size(); i-- > 0;) plan.order.push_back(i);
  return plan;
}

TEST(CellWriter, ManyBodiesShareTheVoxelsOfVhacd) {
  for (const auto& [count, voxels] : {std::pair{1, "100000"}, {10, "100000"}, {20, "50000"}, {40, "30000"}}) {
    const Product product = of_plates(count);
    const Disassembly plan = whole(product);
    const test::TemporaryDirectory directory;
    const std::string scenario =
        text(write_cell(product, plan, hierarchy(product, plan), directory / "cell").scenario);
    const std::string wanted = std::string("{method: vhacd, resolution: ") + voxels + "}";
    int found = 0;
    for (std::size_t at = 0; (at = scenario.find(wanted, at)) != std::string::npos; ++at) ++found;
    EXPECT_EQ(found, count) << wanted;
  }
}

TEST(CellWriter, TheHeadSaysWhatIsNotedUntilItIsWritten) {
  const Product product = of_plates(1);
  const Disassembly plan = whole(product);
  const Hierarchy numbers = hierarchy(product, plan);
  const test::TemporaryDirectory directory;
  CellWriter writer(product, numbers, directory / "cell");
  EXPECT_THAT(text(writer.write_cell(plan).scenario), testing::Not(HasSubstr("# Note: ")));
  writer.add_note("Plate0 does not stay in its place");
  const CellFiles files = writer.write_cell(plan);
  EXPECT_THAT(files.notes, testing::ElementsAre("Plate0 does not stay in its place"));
  EXPECT_THAT(text(files.scenario), HasSubstr("\n# Note: Plate0 does not stay in its place.\n"));
}

TEST(CellWriter, APadMayStandInWhatIsInsideItsPart) {
  Product product = test::product_of({{test::box_body("Base", {0.1, 0.1, 0.02}), {0, 0, 0.01}},
                                      {test::box_body("Sheet", {0.04, 0.04, 0.01}), {0, 0, 0.05}},
                                      {test::box_body("Post", {0.02, 0.02, 0.05}), {0, 0, 0.045}}});
  product.contacts = find_contacts(product);
  Disassembly plan = whole(product);
  plan.on_pads = {1};
  const test::TemporaryDirectory directory;
  const CellFiles files = write_cell(product, plan, hierarchy(product, plan), directory / "cell");
  const auto cell = build_cell(read_scenario(files.scenario));
  for (const StartOverlap& one : cell->start_overlaps) ADD_FAILURE() << one.sentence;
}

}  // namespace
}  // namespace takt::product
