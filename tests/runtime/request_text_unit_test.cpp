// Invalid UTF-8 and control characters: texts of requests are refused, those of replies replaced.
#include "server/runtime/requests/request_text.h"

#include <gtest/gtest.h>

#include "tests/support/text_requests.h"

namespace takt {
namespace {

TEST(RequestText, TheInvalidTextOfARequestIsNamed) {
  const auto fault = [](const std::string& request, const test::TextArguments& arguments) {
    return find_text_fault(test::text_request(1, request, arguments));
  };
  EXPECT_EQ(fault("load_scenario", {{"uri", "Größe.yaml"}, {"overrides", "a=1\nb=2"}}), "");
  const std::string name = fault("sto\xFFp", {});
  EXPECT_NE(name.find("The request's name 'sto?p'"), std::string::npos) << name;
  const std::string value = fault("explain_part", {{"part", "P\x1B[2J"}});
  EXPECT_NE(value.find("argument 'part' of the request 'explain_part' is no text: 'P?[2J'"),
            std::string::npos)
      << value;
  EXPECT_NE(fault("explain_part", {{"pa\nrt", "P"}}), "");
  const std::string listed = fault("register_controller", {{"targets", "Robot1,\x1BRobot2"}});
  EXPECT_NE(listed.find("'?Robot2'"), std::string::npos) << listed;
}

TEST(RequestText, AllTextsOfAReplyAreMadeValid) {
  ControlReply reply{1, ControlResult::ok, "d\xFFne"};
  reply.values = arguments_of_text("", {{"a", "b\x1B"}});
  reply.values.push_back({"names", {.kind = ValueKind::texts, .texts = {"\xC3\xA4", "\xC3"}}});
  const ControlReply valid = sanitize(reply);
  EXPECT_EQ(valid.message, "d?ne");
  EXPECT_EQ(test::value_of(valid, "a"), "b?");
  EXPECT_EQ(valid.values[1].value.texts, (std::vector<std::string>{"\xC3\xA4", "?"}));
}

}  // namespace
}  // namespace takt
