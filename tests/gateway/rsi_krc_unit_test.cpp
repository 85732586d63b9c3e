// The robot controller's side of RSI without sockets: corrections, late answers, limits.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client_lib/gateway/rsi/krc.h"
#include "tests/support/rsi_examples.h"

namespace takt::test::rsi_krc {
namespace {

using namespace gateway::rsi;
using gateway::Six;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr Six kHome{0, -90, 90, 0, 90, 0};

std::string sen(std::uint64_t ipoc, double a1, int stop = 0) {
  return "<Sen Type=\"KROSHU\"><Stop>" + std::to_string(stop) + "</Stop><AK A1=\"" + std::to_string(a1) +
         "\"/><IPOC>" + std::to_string(ipoc) + "</IPOC></Sen>";
}

struct Cell {
  explicit Cell(const KrcOptions& options = {}, const std::string& xml = kRsiXml)
      : krc(rsi_configuration(xml), options) {
    krc.start(kHome);
  }
  std::string begin() {
    Rob rob;
    rob.actual_axes = krc.target();
    return krc.begin_cycle(rob);
  }
  /// A cycle with this correction.
  void cycle(double a1) {
    begin();
    EXPECT_EQ(krc.answer(sen(krc.ipoc(), a1)), Taken::applied);
    krc.end_cycle();
  }
  void missed(int cycles) {
    for (int i = 0; i < cycles; ++i) {
      begin();
      krc.end_cycle();
    }
  }
  Krc krc;
};

TEST(Krc, IpocGrowsByTheCycleAndDelayCountsLatePackets) {
  Cell cell;
  EXPECT_THAT(cell.begin(), HasSubstr("<Delay D=\"0\"/><IPOC>4208163634</IPOC>"));
  cell.krc.end_cycle();
  EXPECT_THAT(cell.begin(), HasSubstr("<Delay D=\"1\"/><IPOC>4208163638</IPOC>"));
  Cell slow({.cycle_ms = 12});
  slow.begin();
  EXPECT_THAT(slow.begin(), HasSubstr("<IPOC>4208163646</IPOC>"));
}

TEST(Krc, AnAnswerOfAnotherSensorSystemCountsAsLate) {
  Cell cell;
  cell.begin();
  const std::string good = sen(cell.krc.ipoc(), 2.0);
  for (const char* type : {"ImFree", "kroshu", ""}) {
    EXPECT_EQ(cell.krc.answer(with(good, "KROSHU", type)), Taken::invalid);
    EXPECT_THAT(cell.krc.fault(), HasSubstr("Type: found '" + std::string(type) + "'; allowed: 'KROSHU'"));
  }
  cell.krc.end_cycle();
  EXPECT_EQ(cell.krc.late(), 1U);
  EXPECT_EQ(cell.krc.target(), kHome);
  cell.cycle(2.0);
  EXPECT_EQ(cell.krc.target()[0], 2.0);
}

TEST(Krc, AnAbsoluteCorrectionIsTheOffsetToTheStart) {
  Cell cell;
  cell.cycle(2.0);
  cell.cycle(2.0);
  EXPECT_EQ(cell.krc.target(), (Six{2, -90, 90, 0, 90, 0}));
  EXPECT_EQ(cell.krc.start_axes(), kHome);
}

TEST(Krc, ARelativeCorrectionAddsUp) {
  Cell cell({.relative = true});
  cell.cycle(2.0);
  cell.cycle(2.0);
  cell.cycle(-1.0);
  EXPECT_EQ(cell.krc.target()[0], 3.0);
}

TEST(Krc, AHundredMissingAnswersStopAndNinetyNineDoNot) {
  Cell cell;
  cell.cycle(1.0);
  cell.missed(99);
  EXPECT_TRUE(cell.krc.running());
  EXPECT_EQ(cell.krc.late(), 99U);
  EXPECT_EQ(cell.krc.target()[0], 1.0);
  cell.missed(1);
  EXPECT_EQ(cell.krc.state(), KrcState::connection_lost);
  EXPECT_THAT(cell.krc.reason(), HasSubstr("KSS29002"));
  EXPECT_EQ(cell.krc.target()[0], 1.0);
  cell.begin();
  EXPECT_EQ(cell.krc.answer(sen(cell.krc.ipoc(), 5.0)), Taken::not_awaited);
  EXPECT_EQ(cell.krc.target()[0], 1.0);
}

TEST(Krc, LatePacketsCountFromTheFirstAnswerOnIfTheControllerWaits) {
  Cell cell({.waits_for_sensor = true});
  cell.missed(500);
  EXPECT_TRUE(cell.krc.running());
  EXPECT_EQ(cell.krc.late(), 0U);
  cell.cycle(1.0);
  cell.missed(100);
  EXPECT_EQ(cell.krc.state(), KrcState::connection_lost);
}

TEST(Krc, AnAnswerWithAnotherIpocIsNotAppliedAndCountsAsLate) {
  Cell cell;
  cell.begin();
  for (const std::uint64_t wrong :
       {cell.krc.ipoc() + 1, cell.krc.ipoc() - 4, cell.krc.ipoc() + 4, std::uint64_t{0}})
    EXPECT_EQ(cell.krc.answer(sen(wrong, 5.0)), Taken::other_ipoc);
  EXPECT_EQ(cell.krc.target(), kHome);
  EXPECT_EQ(cell.krc.answer(sen(cell.krc.ipoc(), 3.0)), Taken::applied);  // the right one is still in time
  EXPECT_EQ(cell.krc.answer(sen(cell.krc.ipoc(), 4.0)), Taken::not_awaited);  // doubled
  cell.krc.end_cycle();
  EXPECT_EQ(cell.krc.late(), 0U);
  EXPECT_EQ(cell.krc.target()[0], 3.0);
  cell.begin();
  EXPECT_EQ(cell.krc.answer(sen(cell.krc.ipoc() - 4, 9.0)), Taken::other_ipoc);
  cell.krc.end_cycle();
  EXPECT_EQ(cell.krc.late(), 1U);
  EXPECT_EQ(cell.krc.target()[0], 3.0);
}

TEST(Krc, HoldonKeepsTheValueOfAMissingPacketAndItsAbsenceSetsZero) {
  Cell held;
  held.cycle(3.0);
  held.missed(1);
  EXPECT_EQ(held.krc.target()[0], 3.0);
  Cell reset({}, with(kRsiXml, "HOLDON=\"1\"", "HOLDON=\"0\""));
  reset.cycle(3.0);
  reset.missed(1);
  EXPECT_EQ(reset.krc.target()[0], 0.0);  // the known jump to the start
  Cell relative({.relative = true});
  relative.cycle(3.0);
  relative.missed(1);
  EXPECT_EQ(relative.krc.target()[0], 6.0);  // the output of the object stays
}

TEST(Krc, AxiscorrCutsAndItsMonitorStops) {
  Cell cut({.axis_limit = all_axes(5.0)});
  cut.cycle(8.0);
  EXPECT_EQ(cut.krc.target()[0], 5.0);
  EXPECT_TRUE(cut.krc.running());
  Cell monitored({.axis_monitor = all_axes(6.0)});
  monitored.cycle(6.0);
  EXPECT_TRUE(monitored.krc.running());
  monitored.cycle(6.001);
  EXPECT_EQ(monitored.krc.state(), KrcState::limit_exceeded);
  EXPECT_THAT(monitored.krc.reason(),
              HasSubstr("KSS29000: the correction of axis A1 is 6.001 degrees; allowed: 6"));
  EXPECT_EQ(monitored.krc.target()[0], 6.0);
  Cell relative({.relative = true, .axis_monitor = all_axes(6.0)});
  for (int i = 0; i < 3; ++i) relative.cycle(2.0);
  EXPECT_TRUE(relative.krc.running());
  relative.cycle(0.1);
  EXPECT_EQ(relative.krc.state(), KrcState::limit_exceeded);
}

TEST(Krc, ASoftwareLimitSwitchStops) {
  KrcOptions options;
  options.axis_upper[0] = 10.0;
  Cell cell(options);
  cell.cycle(10.0);
  EXPECT_TRUE(cell.krc.running());
  cell.cycle(11.0);
  EXPECT_THAT(cell.krc.reason(), HasSubstr("Software limit switch: axis A1"));
  EXPECT_EQ(cell.krc.target()[0], 10.0);
}

TEST(Krc, StopEndsRsiWithoutTheCorrectionBesideIt) {
  Cell cell;
  cell.cycle(1.0);
  cell.begin();
  EXPECT_EQ(cell.krc.answer(sen(cell.krc.ipoc(), 4.0, 1)), Taken::applied);
  EXPECT_EQ(cell.krc.state(), KrcState::stopped_by_sensor);
  EXPECT_EQ(cell.krc.target()[0], 1.0);
  cell.krc.start(kHome);
  EXPECT_THAT(cell.begin(), HasSubstr("<IPOC>4208163634</IPOC>"));
  EXPECT_EQ(cell.krc.target(), kHome);
}

TEST(Krc, InvalidAnswersChangeNothingAndTheReasonIsKept) {
  Cell cell;
  cell.cycle(1.0);
  cell.begin();
  const std::string good = sen(cell.krc.ipoc(), 9.0);
  for (std::size_t length = 0; length < good.size(); ++length)
    EXPECT_EQ(cell.krc.answer(good.substr(0, length)), Taken::invalid) << length;
  EXPECT_EQ(cell.krc.answer(sen(cell.krc.ipoc(), 2e9)), Taken::invalid);
  EXPECT_THAT(cell.krc.fault(), HasSubstr("AK.A1: found 2e+09"));
  EXPECT_EQ(cell.krc.target()[0], 1.0);
  EXPECT_EQ(cell.krc.answer(good), Taken::applied);
  EXPECT_EQ(cell.krc.target()[0], 9.0);
}

TEST(Krc, AnUnknownElementIsReportedOnce) {
  Cell cell;
  for (int i = 0; i < 2; ++i) {
    cell.begin();
    cell.krc.answer("<Sen Type=\"KROSHU\"><Foo>1</Foo><IPOC>" + std::to_string(cell.krc.ipoc()) +
                    "</IPOC></Sen>");
    if (i == 0) {
      EXPECT_THAT(cell.krc.new_unknown(), ElementsAre("Foo"));
    } else {
      EXPECT_TRUE(cell.krc.new_unknown().empty());
    }
  }
}

TEST(Krc, WithOnlysendNoAnswerIsExpected) {
  Cell cell({}, with(kRsiXml, "FALSE", "TRUE"));
  cell.missed(500);
  EXPECT_TRUE(cell.krc.running());
  EXPECT_EQ(cell.krc.late(), 0U);
  EXPECT_EQ(cell.krc.target(), kHome);
}

TEST(Krc, AConfigurationWithoutUsableCorrectionIsRefused) {
  EXPECT_THROW(Krc(rsi_configuration(with(kRsiXml, "AK.", "VK.")), {}), ConfigurationError);
  const std::string pose =
      with(with(with(kRsiXml, "AK.A1", "RKorr.X"), "AK.A2", "RKorr.Y"), "AK.A3", "RKorr.Z");
  EXPECT_THROW(Krc(rsi_configuration(pose), {}), ConfigurationError);  // AK.A4 beside RKorr.X
}

// The bytes are those of kuka-rsi3-communicator, whose RSI context wires AKorr to AXISCORR.
TEST(Krc, TheElementOfCorrectionsHasTheNameOfTheContext) {
  std::string xml = kRsiXml;
  for (int i = 1; i <= 6; ++i) xml = with(xml, "AK.A" + std::to_string(i), "AKorr.A" + std::to_string(i));
  try {
    Krc(rsi_configuration(xml), {});
    FAIL();
  } catch (const ConfigurationError& error) {
    EXPECT_THAT(error.what(), HasSubstr("AK.A1 to .A6"));
    EXPECT_THAT(error.what(), HasSubstr("key elements"));
  }
  KrcOptions options;
  options.axes_element = "AKorr";
  Cell cell(options, xml);
  cell.begin();
  EXPECT_EQ(
      cell.krc.answer("<Sen Type=\"KROSHU\">\n  <EStr>KRCnexxt - RSI Object ST_ETHERNET</EStr>\n"
                      "  <AKorr A1=\"1.5000\" A2=\"0.0000\" A3=\"0.0000\" A4=\"0.0000\" A5=\"0.0000\" "
                      "A6=\"-2.0000\" />\n  <Tech T21=\"1.09\" T22=\"2.08\"/>\n  <DiO>125</DiO>\n <IPOC>" +
                      std::to_string(cell.krc.ipoc()) + "</IPOC>\n</Sen>\n"),
      Taken::applied);
  EXPECT_EQ(cell.krc.target(), (Six{1.5, -90, 90, 0, 90, -2}));
}

/// A robot whose axes are the pose: X Y Z in mm, A B C in degrees.
PoseKinematics gantry(bool* reaches = nullptr) {
  return {[](const Six& axes) { return gateway::pose_of_xyzabc(axes); },
          [reaches](const Pose& X, const Six&) -> std::optional<Six> {
            if (reaches != nullptr && !*reaches) return std::nullopt;
            return gateway::xyzabc_of(X);
          }};
}

std::string pose_xml() {
  std::string xml = kRsiXml;
  const std::array<const char*, 6> names{"X", "Y", "Z", "A", "B", "C"};
  for (std::size_t i = 0; i < 6; ++i)
    xml = with(xml, "AK.A" + std::to_string(i + 1), std::string("RKorr.") + names[i]);
  return xml;
}

TEST(Krc, APoseCorrectionMovesAndTurnsTheToolInTheBaseFrame) {
  const Six start{500, 0, 300, 0, 0, 0};
  bool reaches = true;
  Krc krc(rsi_configuration(pose_xml()), {.relative = true}, gantry(&reaches));
  krc.start(start);
  for (int i = 0; i < 3; ++i) {
    krc.begin_cycle({});
    ASSERT_EQ(krc.answer("<Sen Type=\"KROSHU\"><RKorr X=\"1\" Z=\"-2\" A=\"10\"/><IPOC>" +
                         std::to_string(krc.ipoc()) + "</IPOC></Sen>"),
              Taken::applied);
  }
  const Six expected{503, 0, 294, 30, 0, 0};
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(krc.target()[i], expected[i], 1e-9) << i;
  reaches = false;
  krc.begin_cycle({});
  krc.answer("<Sen Type=\"KROSHU\"><RKorr X=\"1\"/><IPOC>" + std::to_string(krc.ipoc()) + "</IPOC></Sen>");
  EXPECT_EQ(krc.state(), KrcState::unreachable);
  EXPECT_NEAR(krc.target()[0], 503, 1e-9);
}

TEST(Krc, PoseCorrectionsHaveLimitsAndMonitors) {
  Krc krc(rsi_configuration(pose_xml()), {.translation_limit_mm = 5.0, .rotation_limit_deg = 5.0}, gantry());
  krc.start({});
  krc.begin_cycle({});
  krc.answer("<Sen Type=\"KROSHU\"><RKorr X=\"9\" A=\"20\"/><IPOC>" + std::to_string(krc.ipoc()) +
             "</IPOC></Sen>");
  EXPECT_NEAR(krc.target()[0], 5.0, 1e-9);
  EXPECT_NEAR(krc.target()[3], 5.0, 1e-9);
  Krc monitored(rsi_configuration(pose_xml()), {.translation_monitor_mm = 5.0}, gantry());
  monitored.start({});
  monitored.begin_cycle({});
  monitored.answer("<Sen Type=\"KROSHU\"><RKorr X=\"4\" Y=\"4\"/><IPOC>" + std::to_string(monitored.ipoc()) +
                   "</IPOC></Sen>");
  EXPECT_THAT(monitored.reason(), HasSubstr("KSS29000: the correction of the pose"));
}

}  // namespace
}  // namespace takt::test::rsi_krc
