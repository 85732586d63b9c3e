// FMU files that are no FMUs, of another kind or platform, or made to do harm: each is refused with a reason.
#include "server/fmu/fmu_archive.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "server/fmu/model_description.h"
#include "tests/support/fmu_cell.h"
#include "tests/support/zip_file.h"

namespace takt {
namespace {

using testing::HasSubstr;

using Entry = test::ZipEntry;
using test::write_zip;

/// The reason why an archive is refused, which leaves nothing outside of the directory.
std::string unpacking(const std::vector<Entry>& entries) {
  const test::TemporaryDirectory directory;
  write_zip(directory / "x.fmu", entries);
  std::filesystem::create_directory(directory / "to");
  std::string reason = "unpacked";
  try {
    unpack_fmu(directory / "x.fmu", directory / "to");
  } catch (const FmuError& error) {
    reason = error.what();
  }
  EXPECT_FALSE(std::filesystem::exists(directory / "evil"));
  return reason;
}

TEST(FmuArchive, NamesThatLeadOutOfItAndLinksAreRefused) {
  const Entry description{"modelDescription.xml", "<x/>"};
  EXPECT_EQ(unpacking({description, {"resources/a/b.txt"}}), "unpacked");
  EXPECT_THAT(unpacking({description, {"../evil"}}), HasSubstr("leads out of the archive"));
  EXPECT_THAT(unpacking({description, {"resources/../../evil"}}), HasSubstr("leads out of the archive"));
  EXPECT_THAT(unpacking({description, {"documentation/../../evil"}}), HasSubstr("leads out of the archive"));
  EXPECT_THAT(unpacking({description, {"/evil"}}), HasSubstr("absolute name"));
  EXPECT_THAT(unpacking({description, {"C:\\evil"}}), HasSubstr("absolute name"));
  EXPECT_THAT(unpacking({description, {"\\evil"}}), HasSubstr("absolute name"));
  EXPECT_THAT(unpacking({description, {"resources\\..\\..\\evil"}}), HasSubstr("leads out of the archive"));
  EXPECT_THAT(unpacking({description, {"resources/link", "/etc/passwd", S_IFLNK | 0777}}),
              HasSubstr("is a link"));
  EXPECT_THAT(unpacking({description, {"resources/a"}, {"resources/a"}}), HasSubstr("stands twice"));
  EXPECT_THAT(unpacking({{"resources/a"}}), HasSubstr("has no modelDescription.xml"));
  EXPECT_EQ(unpacking({{"./modelDescription.xml", "<x/>"}, {"./resources/"}, {"./resources/a"}}), "unpacked");
  EXPECT_THAT(unpacking({description, {"./resources/a"}, {"resources/a"}}), HasSubstr("stands twice"));
  EXPECT_THAT(unpacking({{"motor/modelDescription.xml", "<x/>"}}),
              HasSubstr("no modelDescription.xml at its top, only 'motor/modelDescription.xml'"));
}

TEST(FmuArchive, BackslashesBetweenTheFoldersOfANameAreTakenForSlashes) {
  const test::TemporaryDirectory directory;
  write_zip(directory / "x.fmu",
            {{"modelDescription.xml"}, {"binaries\\win64\\"}, {"resources\\a\\b.txt", "content"}});
  unpack_fmu(directory / "x.fmu", directory / "to");
  EXPECT_EQ(std::filesystem::file_size(directory / "to/resources/a/b.txt"), 7U);
}

TEST(FmuArchive, TooMuchIsRefused) {
  EXPECT_THAT(unpacking({{"modelDescription.xml", std::string(kLargestDescription_bytes + 1, ' ')}}),
              HasSubstr("modelDescription.xml has more than 64 MiB"));
  std::vector<Entry> many(kMostFmuFiles + 1);
  for (std::size_t i = 0; i < many.size(); ++i) many[i].name = "documentation/" + std::to_string(i);
  EXPECT_THAT(unpacking(many), HasSubstr("more than 100000 files"));
}

TEST(FmuArchive, WhatIsNoArchiveOrDamagedIsRefused) {
  const test::TemporaryDirectory directory;
  directory.write("x.fmu", "PK no zip");
  EXPECT_THAT([&] { unpack_fmu(directory / "x.fmu", directory.path()); },
              testing::ThrowsMessage<FmuError>(HasSubstr("no ZIP archive")));
  // Each byte of a good one changed in turn: unpacked or refused, never more than that.
  std::ifstream in(test::kTestFmus / "motor3.fmu", std::ios::binary);
  const std::string good{std::istreambuf_iterator<char>(in), {}};
  ASSERT_GT(good.size(), 1000U);
  int refused = 0, changed = 0;
  for (std::size_t i = 0; i < good.size(); i += 1 + good.size() / 150) {
    std::string bad = good;
    bad[i] = static_cast<char>(bad[i] ^ 0x55);
    ++changed;
    directory.write("x.fmu", bad);
    const FreshDirectory to;
    try {
      unpack_fmu(directory / "x.fmu", to.path());
    } catch (const FmuError&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 3 * changed / 5);  // times and attributes may be any
}

TEST(FmuArchive, TheDigestIsThatOfTheStandard) {
  const test::TemporaryDirectory directory;
  directory.write("abc", "abc");  // FIPS 180-4, example B.1
  EXPECT_EQ(sha256_of(directory / "abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

const std::string kHead2 = "<fmiModelDescription fmiVersion='2.0' modelName='m' guid='g'>";

std::string reading(const std::string& xml) {
  try {
    read_model_description(xml);
  } catch (const FmuError& error) {
    return error.what();
  }
  return "read";
}

TEST(ModelDescription, OtherKindsAreRefusedWithTheReason) {
  const std::string end = "<ModelVariables/></fmiModelDescription>";
  EXPECT_EQ(reading(kHead2 + "<CoSimulation modelIdentifier='m'/>" + end), "read");
  EXPECT_THAT(reading("no xml"), HasSubstr("is no XML"));
  EXPECT_THAT(reading("<x/>"), HasSubstr("no element fmiModelDescription"));
  EXPECT_THAT(reading("<fmiModelDescription fmiVersion='1.0'/>"),
              HasSubstr("follows FMI '1.0'; takt takes FMI 2.0 and 3.0"));
  EXPECT_THAT(reading(kHead2 + "<ModelExchange modelIdentifier='m'/>" + end),
              HasSubstr("it has model exchange and no co-simulation"));
  EXPECT_THAT(
      reading("<fmiModelDescription fmiVersion='3.0'><ScheduledExecution modelIdentifier='m'/>" + end),
      HasSubstr("it has scheduled execution and no co-simulation"));
  EXPECT_EQ(reading(kHead2 + "<CoSimulation modelIdentifier='water-tank.2'/>" + end), "read");
  EXPECT_THAT(reading(kHead2 + "<CoSimulation modelIdentifier='../m'/>" + end),
              HasSubstr("modelIdentifier is '../m'"));
  EXPECT_THAT(
      reading(
          kHead2 +
          "<CoSimulation modelIdentifier='m'/><ModelVariables><ScalarVariable name='a' valueReference='-1'>"
          "<Real/></ScalarVariable></ModelVariables></fmiModelDescription>"),
      HasSubstr("valueReference is '-1'"));
  // Entities of a document are not expanded.
  EXPECT_THAT(reading("<!DOCTYPE x [<!ENTITY a 'aaaaaaaaaa'>]><x>&a;</x>"), HasSubstr("fmiModelDescription"));
}

TEST(ModelDescription, MoreThanHalfAMillionVariablesAreRefused) {
  std::string xml = kHead2 + "<CoSimulation modelIdentifier='m'/><ModelVariables>";
  for (int i = 0; i <= 500'000; ++i)
    xml += "<ScalarVariable name='v" + std::to_string(i) + "' valueReference='0'><Real/></ScalarVariable>";
  EXPECT_THAT(reading(xml + "</ModelVariables></fmiModelDescription>"),
              HasSubstr("more than 500000 variables"));
}

TEST(ModelDescription, ArraysHaveElementsFromOneOn) {
  const FmuDescription fmu = read_model_description(
      "<fmiModelDescription fmiVersion='3.0' instantiationToken='t'><CoSimulation modelIdentifier='m' "
      "fixedInternalStepSize='0.5'/>"
      "<ModelVariables><UInt64 name='n' valueReference='1' causality='structuralParameter' start='3'/>"
      "<Float64 name='u' valueReference='2' causality='input' start='1 2 3 4 5 6'><Dimension "
      "valueReference='1'/><Dimension start='2'/></Float64>"
      "</ModelVariables></fmiModelDescription>");
  EXPECT_EQ(fmu.fixed_step_s, 0.5);
  EXPECT_EQ(fmu.find("u[6]").element, 5U);
  EXPECT_EQ(fmu.find("u[6]").variable->start[5], "6");
  EXPECT_THROW(static_cast<void>(fmu.find("u[7]")), FmuError);
  EXPECT_THROW(static_cast<void>(fmu.find("u[0]")), FmuError);
  EXPECT_THROW(static_cast<void>(fmu.find("u")), FmuError);
}

FmuDescription with_variables(int version, const std::string& variables,
                              const std::string& encoding = "UTF-8") {
  return read_model_description("<?xml version='1.0' encoding='" + encoding +
                                "'?><fmiModelDescription fmiVersion='" + std::to_string(version) +
                                ".0'><CoSimulation modelIdentifier='m'/><ModelVariables>" + variables +
                                "</ModelVariables></fmiModelDescription>");
}

TEST(ModelDescription, NumbersAreThoseOfXmlSchema) {
  const FmuDescription fmu = with_variables(
      2,
      "<ScalarVariable name='u' valueReference=' 7 ' causality='input'><Real min='-INF' max=' 24 ' start=' 1 "
      "'/></ScalarVariable><ScalarVariable name='v' valueReference='8'><Real min='-1.8e308' max='Infinity'/>"
      "</ScalarVariable>");
  EXPECT_FALSE(fmu.variables[1].lower.has_value());
  EXPECT_FALSE(fmu.variables[1].upper.has_value());
  EXPECT_EQ(fmu.variables[0].reference, 7U);
  EXPECT_FALSE(fmu.variables[0].lower.has_value());
  EXPECT_EQ(fmu.variables[0].upper, 24.0);
  EXPECT_EQ(fmu.variables[0].start, std::vector<std::string>{"1"});
  EXPECT_THROW(
      with_variables(2, "<ScalarVariable name='u' valueReference='7'><Real min='low'/></ScalarVariable>"),
      FmuError);
}

TEST(ModelDescription, AnAliasIsAnotherNameOfItsVariable) {
  const FmuDescription fmu = with_variables(3,
                                            "<Float64 name='w' valueReference='1' causality='output'><Alias "
                                            "name='speed' displayUnit='rpm'/></Float64>");
  EXPECT_EQ(fmu.find("speed").variable, fmu.find("w").variable);
  EXPECT_THROW(with_variables(3,
                              "<Float64 name='w' valueReference='1'/><Float64 name='v' "
                              "valueReference='2'><Alias name='w'/></Float64>"),
               FmuError);
}

TEST(ModelDescription, TextsOfFmi3StandInElements) {
  const FmuDescription fmu =
      with_variables(3,
                     "<String name='s' valueReference='1' causality='parameter'><Dimension start='2'/><Start "
                     "value='a b'/><Start "
                     "value=''/></String>");
  EXPECT_EQ(fmu.variables[0].start, (std::vector<std::string>{"a b", ""}));
}

TEST(ModelDescription, WhatIsNotUtf8IsLatin1) {
  const std::string variable =
      "<Float64 name='T' valueReference='1' unit='\xb0"
      "C'/>";
  EXPECT_EQ(with_variables(3, variable, "ISO-8859-1").variables[0].unit,
            "\xc2\xb0"
            "C");
  EXPECT_EQ(with_variables(3,
                           "<Float64 name='T' valueReference='1' unit='\xc2\xb0"
                           "C'/>")
                .variables[0]
                .unit,
            "\xc2\xb0"
            "C");
  EXPECT_EQ(with_variables(3, "<Float64 name='T' valueReference='1' unit='&#7;C'/>").variables[0].unit, "?C");
}

TEST(Fmu, WithoutABinaryForThisPlatformIsRefused) {
  const test::TemporaryDirectory directory;
  write_zip(directory / "x.fmu",
            {{"modelDescription.xml",
              kHead2 + "<CoSimulation modelIdentifier='m'/><ModelVariables/></fmiModelDescription>"},
             {"binaries/win64/m.dll"}});
  EXPECT_THAT([&] { test::FmuCell(directory / "x.fmu"); },
              testing::ThrowsMessage<ScenarioError>(
                  HasSubstr("no binary for this platform, binaries/linux64/m.so; found binaries for win64. "
                            "Export it for Linux")));
}

}  // namespace
}  // namespace takt
