// Messages and configuration of KUKA's RSI, byte by byte.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "client_lib/gateway/rsi/messages.h"
#include "tests/support/rsi_examples.h"

namespace takt::test::rsi_messages {
namespace {

using namespace gateway::rsi;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr Decimals kGoldenDigits{.pose = 1, .axes = 4, .external_axes = 1};

Rob golden_rob() {
  Rob rob;
  rob.actual_pose = {445, 0, 790, 180, 0, 180};
  rob.actual_axes = {0, -90, 90, 0, 90, 0};
  rob.ipoc = 4208163634;
  return rob;
}

/// Reads a Rob as KUKA's client does: by position, not as XML. Empty: it would fail there.
std::string read_by_position(const std::string& text) {
  std::size_t at = 0;
  std::string numbers;
  const auto expect = [&](const std::string& words) {
    if (text.compare(at, words.size(), words) != 0) return false;
    at += words.size();
    return true;
  };
  const auto number = [&] {
    std::size_t length = 0;
    numbers += std::to_string(std::stod(text.substr(at), &length)) + " ";
    at += length;
  };
  const auto element = [&](const std::string& name, const std::vector<std::string>& attributes) {
    if (!expect("<" + name)) return false;
    for (const std::string& attribute : attributes) {
      if (!expect(" " + attribute + "=\"")) return false;
      number();
      if (!expect("\"")) return false;
    }
    return expect("/>");
  };
  if (!expect("<Rob Type=\"KUKA\">") || !element("RIst", {"X", "Y", "Z", "A", "B", "C"}) ||
      !element("AIPos", {"A1", "A2", "A3", "A4", "A5", "A6"}) ||
      !element("EIPos", {"E1", "E2", "E3", "E4", "E5", "E6"}) || !element("Delay", {"D"}) ||
      !expect("<IPOC>"))
    return {};
  number();
  return expect("</IPOC></Rob>") && at == text.size() ? numbers : std::string();
}

TEST(RsiMessages, TheGoldenTranscriptIsWrittenByteByByte) {
  EXPECT_EQ(write_rob(rsi_configuration(), golden_rob(), kGoldenDigits), kGoldenRob);
  Sen sen;
  sen.ipoc = 4208163634;
  sen.values = {0.0, 0.01 * 180.0 / 3.14159265358979323846, 0.0, 0.0, 0.0, 0.0, 0.0};
  EXPECT_EQ(write_sen(rsi_configuration(), sen), kGoldenSen);
}

TEST(RsiMessages, TheGoldenTranscriptIsRead) {
  const auto sen = parse_sen(rsi_configuration(), kGoldenSen);
  ASSERT_TRUE(sen.message) << sen.fault;
  EXPECT_EQ(sen.message->ipoc, 4208163634U);
  EXPECT_EQ(sen.message->values[0], 0.0);
  EXPECT_EQ(sen.message->values[1], 0.572958);
  EXPECT_TRUE(sen.unknown.empty());
  const auto rob = parse_rob(rsi_configuration(), kGoldenRob);
  ASSERT_TRUE(rob.message) << rob.fault;
  EXPECT_EQ(rob.message->actual_axes, golden_rob().actual_axes);
  EXPECT_EQ(rob.message->actual_pose, golden_rob().actual_pose);
  EXPECT_EQ(rob.message->ipoc, 4208163634U);
}

TEST(RsiMessages, ThePositionalReaderOfTheVendorsClientGetsEveryNumber) {
  EXPECT_EQ(read_by_position(kGoldenRob), read_by_position(write_rob(rsi_configuration(), golden_rob())));
  EXPECT_FALSE(read_by_position(kGoldenRob).empty());
  // Mutation of the sheet: without EIPos the client fails.
  const auto without =
      rsi_configuration(with(kRsiXml, R"(<ELEMENT TAG="DEF_EIPos" TYPE="DOUBLE" INDX="INTERNAL" />)", ""));
  EXPECT_TRUE(read_by_position(write_rob(without, golden_rob())).empty());
}

TEST(RsiMessages, TheDefaultMessageFitsIntoTheClientsBufferAtTheLargestNumbers) {
  Rob rob = golden_rob();
  rob.actual_pose = {-12345.678901, -12345.678901, -12345.678901, -179.999999, -179.999999, -179.999999};
  rob.actual_axes = rob.actual_external_axes = {-359.999999, -359.999999, -359.999999,
                                                -359.999999, -359.999999, -359.999999};
  EXPECT_LT(write_rob(rsi_configuration(), rob).size(), 1024U);
}

TEST(RsiMessages, OrderBlanksAndUnknownElementsDoNotMatter) {
  const std::string text =
      " <?xml version=\"1.0\"?>\n<Sen  Type='KROSHU' >\n <IPOC> 4208163634 </IPOC><New "
      "x=\"1\"><deep/></New>\r\n"
      "<AK A6=\"6\"  A1 = '1.5' A9=\"0\" /><Stop>\n1 </Stop></Sen>\n";
  const auto sen = parse_sen(rsi_configuration(), text);
  ASSERT_TRUE(sen.message) << sen.fault;
  EXPECT_EQ(sen.message->ipoc, 4208163634U);
  EXPECT_EQ(sen.message->values[0], 1.0);
  EXPECT_EQ(sen.message->values[1], 1.5);
  EXPECT_FALSE(sen.message->values[2]);
  EXPECT_EQ(sen.message->values[6], 6.0);
  EXPECT_THAT(sen.unknown, ElementsAre("New.x", "AK.A9"));
  const auto rob = parse_rob(rsi_configuration(), with(kGoldenRob, "Type", "TYPE"));
  EXPECT_TRUE(rob.message) << rob.fault;
}

TEST(RsiMessages, ChannelsWhoseNameIsANumberAreReadAndWritten) {
  const auto configuration = rsi_configuration(with(
      with(
          kRsiXml, R"(<ELEMENT TAG="DEF_Delay" TYPE="LONG"   INDX="INTERNAL" />)",
          R"(<ELEMENT TAG="DEF_Delay" TYPE="LONG" INDX="INTERNAL" /><ELEMENT TAG="GPIO.01" TYPE="BOOL" INDX="1"/>
                   <ELEMENT TAG="GPIO.02" TYPE="LONG" INDX="2"/><ELEMENT TAG="Force" TYPE="DOUBLE" INDX="3"/>)"),
      R"(<ELEMENT TAG="Stop")",
      R"(<ELEMENT TAG="GPIO.01" TYPE="BOOL" INDX="8" HOLDON="1"/><ELEMENT TAG="Stop")"));
  Rob rob = golden_rob();
  rob.values = {0, 0, 0, 0, 1.0, 2.4, -0.5};
  EXPECT_THAT(write_rob(configuration, rob),
              HasSubstr(R"(<Delay D="0"/><GPIO 01="1" 02="2"/><Force>-0.500000</Force><IPOC>)"));
  const auto sen = parse_sen(configuration, R"(<Sen Type="KROSHU"><GPIO 01="1"/><IPOC>7</IPOC></Sen>)");
  ASSERT_TRUE(sen.message) << sen.fault;
  EXPECT_EQ(sen.message->values[0], 1.0);
  EXPECT_TRUE(sen.unknown.empty());
}

TEST(RsiMessages, AMessageCutAtAnyByteIsNone) {
  for (std::size_t length = 0; length < kGoldenSen.size(); ++length) {
    const auto sen = parse_sen(rsi_configuration(), kGoldenSen.substr(0, length));
    EXPECT_FALSE(sen.message) << length;
    EXPECT_FALSE(sen.fault.empty()) << length;
  }
  for (std::size_t length = 0; length < kGoldenRob.size(); ++length)
    EXPECT_FALSE(parse_rob(rsi_configuration(), kGoldenRob.substr(0, length)).message) << length;
}

TEST(RsiMessages, InvalidMessagesAreRefusedWithTheReason) {
  const auto fault = [](const std::string& text) { return parse_sen(rsi_configuration(), text).fault; };
  EXPECT_THAT(fault(with(kGoldenSen, "0.572958", "nan")), HasSubstr("AK.A1: found 'nan'"));
  EXPECT_THAT(fault(with(kGoldenSen, "0.572958", "1e999")), HasSubstr("AK.A1"));
  EXPECT_THAT(fault(with(kGoldenSen, "0.572958", "0,57")), HasSubstr("AK.A1"));
  EXPECT_THAT(fault(with(kGoldenSen, "4208163634", "-1")), HasSubstr("IPOC"));
  EXPECT_THAT(fault(with(kGoldenSen, "4208163634", "99999999999999999999999")), HasSubstr("IPOC"));
  EXPECT_THAT(fault(with(kGoldenSen, "IPOC", "IPO")), HasSubstr("IPOC is missing"));
  EXPECT_THAT(fault(with(kGoldenSen, "Sen", "Rob")), HasSubstr("expected: Sen"));
  EXPECT_THAT(fault(std::string(9000, 'x')), HasSubstr("9000 bytes"));
  EXPECT_THAT(fault(""), HasSubstr("empty"));
  std::string deep;
  for (int i = 0; i < 1000; ++i) deep += "<a>";
  EXPECT_FALSE(fault("<Sen>" + deep).empty());
  EXPECT_THAT(parse_rob(rsi_configuration(), with(kGoldenRob, "A6=", "A7=")).fault,
              HasSubstr("AIPos.A6 is missing"));
}

TEST(RsiMessages, AMessageThatIsCutAtAnyByteIsRefused) {
  const auto configuration = rsi_configuration();
  const std::string sen = kGoldenSen, rob = kGoldenRob;
  for (std::size_t cut = 0; cut < sen.find_last_of('>'); ++cut)
    EXPECT_FALSE(parse_sen(configuration, sen.substr(0, cut)).message) << cut;
  for (std::size_t cut = 0; cut < rob.find_last_of('>'); ++cut)
    EXPECT_FALSE(parse_rob(configuration, rob.substr(0, cut)).message) << cut;
}

TEST(RsiMessages, RandomChangesOfBytesNeverGiveANumberThatIsNotFinite) {
  std::mt19937 random(7);
  const auto configuration = rsi_configuration();
  for (int round = 0; round < 20000; ++round) {
    std::string text = round % 2 == 0 ? kGoldenSen : kGoldenRob;
    for (auto changes = random() % 6 + 1; changes > 0; --changes) {
      const std::size_t at = random() % text.size();
      if (random() % 3 == 0)
        text.erase(at, random() % 9);
      else if (random() % 2 == 0)
        text.insert(at, 1, static_cast<char>(random()));
      else
        text[at] = static_cast<char>(random());
      if (text.empty()) break;
    }
    if (const auto sen = parse_sen(configuration, text); sen.message) {
      for (const auto& value : sen.message->values) ASSERT_TRUE(std::isfinite(value.value_or(0.0))) << text;
    }
    if (const auto rob = parse_rob(configuration, text); rob.message) {
      for (const double value : rob.message->actual_axes) ASSERT_TRUE(std::isfinite(value)) << text;
    }
  }
}

TEST(RsiConfiguration, TheFileOfTheVendorIsRead) {
  const auto configuration = rsi_configuration();
  EXPECT_EQ(configuration.port, 59152);
  EXPECT_EQ(configuration.sentype, "KROSHU");
  EXPECT_FALSE(configuration.only_send);
  ASSERT_EQ(configuration.send.size(), 4U);
  ASSERT_EQ(configuration.receive.size(), 7U);
  EXPECT_EQ(configuration.receive[1].element, "AK");
  EXPECT_EQ(configuration.receive[1].attribute, "A1");
  EXPECT_EQ(configuration.receive[1].index, 2);
  EXPECT_TRUE(configuration.receive[1].hold);
  EXPECT_FALSE(configuration.receive[0].hold);
}

TEST(RsiConfiguration, EveryMistakeIsReportedWithFileAndLine) {
  const auto error = [](const std::string& from, const std::string& to) -> std::string {
    try {
      (void)rsi_configuration(with(kRsiXml, from, to));
    } catch (const ConfigurationError& fault) {
      return fault.what();
    }
    return "no error";
  };
  EXPECT_THAT(error("59152", "70000"),
              HasSubstr("rsi.xml:4: PORT: found '70000'; allowed: a whole number from 1 to 65535"));
  EXPECT_THAT(error("FALSE", "maybe"), HasSubstr("rsi.xml:6: ONLYSEND"));
  EXPECT_THAT(error("DEF_RIst", "DEF_Rist"),
              HasSubstr("rsi.xml:10: TAG: found 'DEF_Rist'; allowed: DEF_RIst"));
  EXPECT_THAT(error("INDX=\"7\"", "INDX=\"65\""), HasSubstr("rsi.xml:24: INDX"));
  EXPECT_THAT(error("AK.A2", "AK.A1"), HasSubstr("rsi.xml:20: TAG: 'AK.A1' is there twice"));
  EXPECT_THAT(error("TYPE=\"BOOL\"", "TYPE=\"BIT\""), HasSubstr("TYPE: found 'BIT'"));
  EXPECT_THAT(error("<SEND>", "<SEND"), HasSubstr("no valid XML"));
  EXPECT_THAT(error("ROOT", "TOP"), HasSubstr("ROOT"));
  EXPECT_THAT(error("AK.A1", "A<"), HasSubstr("rsi.xml:19: TAG: found 'A<'"));
  EXPECT_THAT(error("KROSHU", "&quot;"), HasSubstr("SENTYPE"));
}

}  // namespace
}  // namespace takt::test::rsi_messages
