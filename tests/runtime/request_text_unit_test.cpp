// Texts of requests are refused, and those of replies replaced, where they are not UTF-8 without control characters.
#include "server/runtime/requests/request_text.h"

#include <gtest/gtest.h>

#include "server/runtime/requests/document_reply.h"

namespace takt {
namespace {

TEST(RequestText, TheInvalidTextOfARequestIsNamed) {
  EXPECT_EQ(find_text_fault({1, "load_scenario", {{"uri", "Größe.yaml"}, {"overrides", "a=1\nb=2"}}}), "");
  const std::string name = find_text_fault({1, "sto\xFFp", {}});
  EXPECT_NE(name.find("The request's name 'sto?p'"), std::string::npos) << name;
  const std::string value = find_text_fault({1, "explain_part", {{"part", "P\x1B[2J"}}});
  EXPECT_NE(value.find("argument 'part' of the request 'explain_part' is no text: 'P?[2J'"),
            std::string::npos)
      << value;
  EXPECT_NE(find_text_fault({1, "explain_part", {{"pa\nrt", "P"}}}), "");
}

TEST(RequestText, DocumentsAreCutBetweenCharactersAndCanBePutTogether) {
  std::string text = "x";
  while (text.size() < 20'000) text += "\xC3\xA4\xE2\x82\xAC";
  ControlReply reply;
  ASSERT_TRUE(add_document(reply, text));
  const ControlReply plain = sanitize(reply);
  EXPECT_EQ(plain.values, reply.values);
  std::string together;
  for (const auto& [name, value] : plain.values)
    if (name != "pieces") together += value;
  EXPECT_EQ(together, text);
  EXPECT_EQ(plain.values.front().second, std::to_string(plain.values.size() - 1));
}

}  // namespace
}  // namespace takt
