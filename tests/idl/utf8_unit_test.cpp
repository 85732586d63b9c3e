// External texts become UTF-8 without control characters; valid ones stay unchanged.
#include "idl/common/utf8.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <random>

#include "idl/common/fixed_string.h"

namespace takt {
namespace {

/// The verdict of a strict JSON reader.
bool is_utf8(const std::string& text) {
  try {
    (void)nlohmann::json(text).dump();
    return true;
  } catch (const nlohmann::json::exception&) {
    return false;
  }
}

TEST(Utf8, ValidTextStays) {
  for (const char* text : {"", "Robot1", "a \"quoted\" \\ name", "Größe", "部品", "\xF0\x9F\x94\xA9",
                           "\xF4\x8F\xBF\xBF", "\xED\x9F\xBF", "\xEE\x80\x80", "\xEF\xBF\xBD", "\xC2\xA0"}) {
    EXPECT_TRUE(validate_utf8(text)) << text;
    EXPECT_EQ(utf8_sanitize(text), text);
  }
  EXPECT_EQ(utf8_sanitize("a\nb\tc", 100, LineBreaks::allow), "a\nb\tc");
  EXPECT_TRUE(validate_utf8("a\nb\tc", LineBreaks::allow));
}

TEST(Utf8, InvalidBytesAndControlCharactersAreReplacedByteByByte) {
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
    EXPECT_EQ(utf8_sanitize(text), plain);
    EXPECT_FALSE(validate_utf8(text)) << plain;
    EXPECT_TRUE(validate_utf8(plain));
  }
  EXPECT_EQ(utf8_sanitize("a\r\n", 100, LineBreaks::allow), "a?\n");
}

TEST(Utf8, TextIsCutBetweenCharacters) {
  EXPECT_EQ(utf8_sanitize("\xC3\xA4\xC3\xB6", 4), "\xC3\xA4\xC3\xB6");
  EXPECT_EQ(utf8_sanitize("\xC3\xA4\xC3\xB6", 3), "\xC3\xA4");
  EXPECT_EQ(utf8_sanitize("\xF0\x9F\x94\xA9", 3), "");
  EXPECT_EQ(utf8_sanitize("\x80\x80\x80\x80\x80\x80", 5), "?????");
  FixedString<3> text("\xC3\xA4\xC3\xB6");
  EXPECT_EQ(text.view(), "\xC3\xA4");
  text.assign("abc");
  EXPECT_EQ(text.view(), "abc");
}

TEST(Utf8, AProgramCanReadTheSanitizedTextOfAnyBytes) {
  std::mt19937 dice(7);
  // Bytes that begin, continue and end characters come often.
  const std::string likely = "\x80\xBF\xC2\xE0\xED\xEF\xF0\xF4\xA0\x9F\x90 a\n\x1F";
  for (int round = 0; round < 20'000; ++round) {
    std::string text(dice() % 12, ' ');
    for (char& byte : text)
      byte = dice() % 4 == 0 ? static_cast<char>(dice() % 256) : likely[dice() % likely.size()];
    const std::string plain = utf8_sanitize(text);
    ASSERT_TRUE(is_utf8(plain) && validate_utf8(plain)) << round;
    ASSERT_EQ(plain.size(), text.size());
    ASSERT_EQ(validate_utf8(text), plain == text);
    if (!is_utf8(text)) {
      ASSERT_NE(plain, text);
    }
    ASSERT_TRUE(is_utf8(utf8_sanitize(text, dice() % 8)));
  }
}

}  // namespace
}  // namespace takt
