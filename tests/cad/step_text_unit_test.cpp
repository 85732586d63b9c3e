// What the text of a STEP file contains beside what OpenCASCADE reads.
#include "server/cad/step_text.h"

#include <gmock/gmock.h>

#include <fstream>
#include <iterator>
#include <string>

#include "server/cad/step_reader.h"
#include "tests/cad/step_files.h"
#include "tests/support/temporary_directory.h"

namespace takt::cad {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

/// A tetrahedron of 20 mm as AP242 edition 2 has it, as an entity with this link to exact faces.
std::string tetrahedron(const std::string& link) {
  return "#90001 = COORDINATES_LIST('',4,((0.,0.,0.),(20.,0.,0.),(0.,20.,0.),(0.,0.,20.)));\n"
         "#90002 = TRIANGULATED_FACE('',#90001,4,(),$,(),((1,3,2),(1,2,4),(1,4,3),(2,3,4)));\n"
         "#90003=TESSELLATED_SOLID('a (b, ''c'' d)',( #90002 ), " +
         link + ");\n";
}

TEST(StepText, SolidsOfTrianglesAloneAreCounted) {
  EXPECT_THAT(unread_tessellation(tetrahedron("$")),
              AllOf(StartsWith("1 solid of it is given as triangles alone (TESSELLATED_SOLID"),
                    HasSubstr("export exact geometry (AP242 with B-rep, AP214), or the triangles as GLB")));
  EXPECT_EQ(unread_tessellation(tetrahedron("#17")), "");
  EXPECT_THAT(unread_tessellation(tetrahedron("$") + tetrahedron("#17") + tetrahedron("$")),
              StartsWith("2 solids of it are"));
  EXPECT_THAT(unread_tessellation("#1 = TESSELLATED_SHELL('',(#2,#3),$);"),
              StartsWith("1 shell of it is given as triangles alone (TESSELLATED_SHELL"));
  EXPECT_EQ(unread_tessellation("#1 = TESSELLATED_SHELL('',(#2,#3),#4);"), "");
  for (const char* other :
       {"", "TESSELLATED_SOLID(", "#1=TESSELLATED_SOLID(", "#1=TESSELLATED_SOLID('",
        "#1=TESSELLATED_SOLID(((", "#1=TESSELLATED_SOLID()", "#1=TESSELLATED_SOLID('',(#2)"})
    EXPECT_EQ(unread_tessellation(other), "") << other;
}

TEST(StepText, SolidsOfTrianglesAloneAreReported) {
  const test::TemporaryDirectory directory;
  test::StepProduct made("Pair");
  made.part("Block", test::box(10, 20, 30));
  made.write(directory / "block.step");
  std::ifstream in(directory / "block.step");
  std::string text((std::istreambuf_iterator<char>(in)), {});
  text.insert(text.rfind("ENDSEC;"), tetrahedron("$"));
  std::ofstream(directory / "both.step") << text;
  const product::Product product = read_step(directory / "both.step");
  EXPECT_EQ(product.instances.size(), 1U);
  EXPECT_THAT(product.notes, testing::Contains(HasSubstr("1 solid of it is given as triangles alone")));
  // Without the block.
  const std::size_t from = text.find("= ADVANCED_BREP_SHAPE_REPRESENTATION"), to = text.find(';', from);
  ASSERT_NE(from, text.npos);
  const std::string context = text.substr(text.rfind(',', to), to - text.rfind(',', to) - 1);
  std::ofstream(directory / "triangles.step")
      << text.replace(from, to - from, "= TESSELLATED_SHAPE_REPRESENTATION('',(#90003)" + context + ")");
  try {
    read_step(directory / "triangles.step");
    ADD_FAILURE() << "no error";
  } catch (const CadError& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr("triangles.step: found no solid; "),
                                    HasSubstr("1 solid of it is given as triangles alone")));
  }
}

}  // namespace
}  // namespace takt::cad
