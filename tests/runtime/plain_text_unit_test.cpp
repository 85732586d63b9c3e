// Texts from outside become UTF-8 without control characters; what is so already stays.
#include "server/runtime/requests/plain_text.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <random>

#include "idl/common/fixed_string.h"
#include "server/runtime/requests/document_reply.h"

namespace takt {
namespace {

/// What a program that reads JSON strictly says.
bool is_utf8(const std::string& text) {
  try {
    (void)nlohmann::json(text).dump();
    return true;
  } catch (const nlohmann::json::exception&) {
    return false;
  }
}

TEST(PlainText, ValidTextIsUnchanged) {
  for (const char* text : {"", "Robot1", "a \"quoted\" \\ name", "Größe", "部品", "\xF0\x9F\x94\xA9",
                           "\xF4\x8F\xBF\xBF", "\xED\x9F\xBF", "\xEE\x80\x80", "\xEF\xBF\xBD", "\xC2\xA0"}) {
    EXPECT_TRUE(is_plain(text)) << text;
    EXPECT_EQ(plain_text(text), text);
  }
  EXPECT_EQ(plain_text("a\nb\tc", 100, Lines::kept), "a\nb\tc");
  EXPECT_TRUE(is_plain("a\nb\tc", Lines::kept));
}

TEST(PlainText, InvalidBytesAreReplacedOneByOne) {
  const std::pair<std::string, std::string> cases[] = {
      {"x\"\\\n\xFF", "x\"\\??"},
      {std::string("a\0b", 3), "a?b"},
      {"\x1B[2J\x7F", "?[2J?"},
      {"\xC2\x9B", "??"},             // a control character beyond ASCII: terminals begin a command with it
      {"\x80", "?"},                  // continues nothing
      {"\xC3", "?"},                  // cut off, of two bytes
      {"\xE2\x82", "??"},             // of three
      {"\xF0\x9F\x94", "???"},        // of four
      {"\xE2\x82z", "??z"},           // cut off by another one
      {"\xC3\xC3\xA4", "?\xC3\xA4"},  // the second one is whole
      {"\xC0\xAF", "??"},             // '/' in two bytes
      {"\xC1\xBF", "??"},             // the longest of those
      {"\xE0\x9F\xBF", "???"},        // two bytes would do
      {"\xF0\x8F\xBF\xBF", "????"},   // three bytes would do
      {"\xED\xA0\x80", "???"},        // surrogates, first and last
      {"\xED\xBF\xBF", "???"},
      {"\xF4\x90\x80\x80", "????"},  // beyond U+10FFFF
      {"\xF8\x88\x80\x80\x80", "?????"},
      {"\xFE\xFF", "??"}};
  for (const auto& [text, plain] : cases) {
    EXPECT_EQ(plain_text(text), plain);
    EXPECT_FALSE(is_plain(text)) << plain;
    EXPECT_TRUE(is_plain(plain));
  }
  EXPECT_EQ(plain_text("a\r\n", 100, Lines::kept), "a?\n");
}

TEST(PlainText, TextIsCutBetweenCharacters) {
  EXPECT_EQ(plain_text("\xC3\xA4\xC3\xB6", 4), "\xC3\xA4\xC3\xB6");
  EXPECT_EQ(plain_text("\xC3\xA4\xC3\xB6", 3), "\xC3\xA4");
  EXPECT_EQ(plain_text("\xF0\x9F\x94\xA9", 3), "");
  EXPECT_EQ(plain_text("\x80\x80\x80\x80\x80\x80", 5), "?????");
  FixedString<3> text("\xC3\xA4\xC3\xB6");
  EXPECT_EQ(text.view(), "\xC3\xA4");
  text.assign("abc");
  EXPECT_EQ(text.view(), "abc");
}

TEST(PlainText, AnyBytesBecomeValidText) {
  std::mt19937 dice(7);
  // Bytes that begin, continue and end characters come often.
  const std::string likely = "\x80\xBF\xC2\xE0\xED\xEF\xF0\xF4\xA0\x9F\x90 a\n\x1F";
  for (int round = 0; round < 20'000; ++round) {
    std::string text(dice() % 12, ' ');
    for (char& byte : text)
      byte = dice() % 4 == 0 ? static_cast<char>(dice() % 256) : likely[dice() % likely.size()];
    const std::string plain = plain_text(text);
    ASSERT_TRUE(is_utf8(plain) && is_plain(plain)) << round;
    ASSERT_EQ(plain.size(), text.size());
    ASSERT_EQ(is_plain(text), plain == text);
    if (!is_utf8(text)) {
      ASSERT_NE(plain, text);
    }
    ASSERT_TRUE(is_utf8(plain_text(text, dice() % 8)));
  }
}

TEST(PlainText, InvalidTextInRequestsIsReported) {
  EXPECT_EQ(fault_of_texts({1, "load_scenario", {{"uri", "Größe.yaml"}, {"overrides", "a=1\nb=2"}}}), "");
  const std::string name = fault_of_texts({1, "sto\xFFp", {}});
  EXPECT_NE(name.find("The request's name 'sto?p'"), std::string::npos) << name;
  const std::string value = fault_of_texts({1, "explain_part", {{"part", "P\x1B[2J"}}});
  EXPECT_NE(value.find("argument 'part' of the request 'explain_part' is no text: 'P?[2J'"),
            std::string::npos)
      << value;
  EXPECT_NE(fault_of_texts({1, "explain_part", {{"pa\nrt", "P"}}}), "");
}

TEST(PlainText, DocumentsAreCutBetweenCharactersAndJoinAgain) {
  std::string text = "x";
  while (text.size() < 20'000) text += "\xC3\xA4\xE2\x82\xAC";
  ControlReply reply;
  ASSERT_TRUE(add_document(reply, text));
  const ControlReply plain = plain_reply(reply);
  EXPECT_EQ(plain.values, reply.values);
  std::string together;
  for (const auto& [name, value] : plain.values)
    if (name != "pieces") together += value;
  EXPECT_EQ(together, text);
  EXPECT_EQ(plain.values.front().second, std::to_string(plain.values.size() - 1));
}

}  // namespace
}  // namespace takt
