// What the text of a STEP file contains beside what OpenCASCADE reads.
#include "server/cad/step_text.h"

#include <gmock/gmock.h>

#include <Standard_Version.hxx>

#include <cstring>
#include <fstream>
#include <iterator>
#include <string>
#include <utility>

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
    const product::Product read = read_step(directory / "triangles.step");
    EXPECT_GE(OCC_VERSION_HEX, 0x070800) << "older ones do not read triangles";
    EXPECT_EQ(read.instances.size(), 1U);
  } catch (const CadError& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr("triangles.step: found no solid; "),
                                    HasSubstr("1 solid of it is given as triangles alone")));
  }
}

TEST(StepText, UnusedBoundariesAreReportedWithTheirTypeAndUnusedPlacementsNot) {
  const std::string used = "DATA;\n#1=PRODUCT('a','',(#2));\n#2=PRODUCT_CONTEXT('',#1,'');\n";
  const std::string place =
      "#3=CARTESIAN_POINT('',(0.,0.,0.));\n#4=DIRECTION('',(1.,0.,0.));\n#5=AXIS2_PLACEMENT_3D('',#3,#4,$);"
      "\n";
  EXPECT_THAT(damage_of_step_text(used + place + "ENDSEC;"), testing::IsEmpty());
  EXPECT_THAT(damage_of_step_text(used + place + "#7= EDGE_LOOP ('',(#1));\n#6=EDGE_LOOP('',(#5));\nENDSEC;"),
              testing::ElementsAre(
                  AllOf(StartsWith("the file contains 1 products"), HasSubstr("first #6 (EDGE_LOOP): "))));
}

TEST(StepText, ApostrophesWithinStringsAreEncoded) {
  EXPECT_EQ(with_encoded_apostrophes("#1=PRODUCT('a','',(#2));"), "");
  EXPECT_EQ(with_encoded_apostrophes("#1=A('5'')','','''a''''b''' ,'c'' , d');"),
            "#1=A('5\\X\\27)','','\\X\\27a\\X\\27\\X\\27b\\X\\27' ,'c\\X\\27 , d');");
  EXPECT_EQ(with_encoded_apostrophes("/* it's */ #1=A('''');"), "/* it's */ #1=A('\\X\\27');");
  // A string without an end would turn all later ones inside out.
  for (const char* damaged : {"#1=A('a,'');\n#2=B('b','');", "#1=A('''", "#1=A('b''"})
    EXPECT_EQ(with_encoded_apostrophes(damaged), "") << damaged;
}

TEST(StepText, NamesWithApostrophesBeforeCommasAndBracketsAreRead) {
  const test::TemporaryDirectory directory;
  test::StepProduct made("Pair");
  made.use(made.root(), made.part("First", test::box(10, 20, 30)), "First");
  made.use(made.root(), made.part("Second", test::box(10, 20, 40)), "Second");
  made.write(directory / "pair.step");
  std::ifstream in(directory / "pair.step");
  std::string text((std::istreambuf_iterator<char>(in)), {});
  for (const auto& [name, other] :
       {std::pair("'First'", "'Nut (6'')'"), std::pair("'Second'", "'5'', long'")})
    for (std::size_t at = text.find(name); at != text.npos; at = text.find(name, at + std::strlen(other)))
      text.replace(at, std::strlen(name), other);
  std::ofstream(directory / "feet.step") << text;
  const product::Product product = read_step(directory / "feet.step");
  ASSERT_EQ(product.instances.size(), 2U);
  EXPECT_EQ(product.instances[0].path, "Pair/Nut (6')");
  EXPECT_EQ(product.instances[1].path, "Pair/5', long");
  EXPECT_THAT(product.notes, testing::IsEmpty());
}

}  // namespace
}  // namespace takt::cad
