// The samples that takt view keeps for its viewers, and the messages of Foxglove's protocol.
#include <gtest/gtest.h>

#include <cstring>

#include "client_lib/recording/json_text.h"
#include "client_lib/view/foxglove.h"
#include "client_lib/view/stream.h"

namespace {

using takt::view::Channel;
using takt::view::Sample;
using takt::view::Stream;
namespace foxglove = takt::view::foxglove;

Channel channel(const std::string& topic, bool each_counts = false) {
  return {0, topic, "cdr", "a/msg/T", "ros2msg", "float64 x\n", each_counts};
}

std::vector<std::string> after(Stream& stream, std::uint32_t id, std::uint64_t number) {
  std::vector<Sample> samples;
  stream.after(id, number, samples);
  std::vector<std::string> texts;
  for (const Sample& sample : samples) texts.push_back(std::to_string(sample.number) + " " + *sample.bytes);
  return texts;
}

TEST(ViewStream, ASlowReaderGetsTheNewestState) {
  Stream stream;
  const auto id = stream.add_channel(channel("/cell/state"));
  EXPECT_TRUE(after(stream, id, 0).empty());
  for (int i = 1; i <= 5; ++i) stream.push(id, 10U * static_cast<unsigned>(i), "s" + std::to_string(i));
  EXPECT_EQ(after(stream, id, 2), std::vector<std::string>{"5 s5"});
  EXPECT_TRUE(after(stream, id, 5).empty());
  // Two viewers share the bytes.
  std::vector<Sample> one, two;
  stream.after(id, 0, one);
  stream.after(id, 4, two);
  EXPECT_EQ(one.at(0).bytes, two.at(0).bytes);
  EXPECT_EQ(one.at(0).time_ns, 50U);
}

TEST(ViewStream, AThousandEventsAreKept) {
  Stream stream;
  const auto id = stream.add_channel(channel("/cell/events", true));
  for (int i = 1; i <= 3; ++i) stream.push(id, 0, "e" + std::to_string(i));
  EXPECT_EQ(after(stream, id, 1), (std::vector<std::string>{"2 e2", "3 e3"}));
  for (std::size_t i = 0; i < Stream::kHistory; ++i) stream.push(id, 0, "x");
  EXPECT_EQ(after(stream, id, 0).size(), Stream::kHistory);
  EXPECT_EQ(after(stream, id, 0).front(), "4 x");
  // A player that goes back starts again; numbers continue, so that old and new samples are distinct.
  stream.clear(id);
  EXPECT_TRUE(after(stream, id, 0).empty());
  stream.push(id, 0, "again");
  EXPECT_EQ(after(stream, id, 1003), std::vector<std::string>{"1004 again"});
}

TEST(ViewStream, FirstAndLastSubscriptionsOfAChannelAreReported) {
  Stream stream;
  const auto id = stream.add_channel(channel("/cell/state"));
  std::vector<std::string> reported;
  stream.on_wanted(&reported, [&](const Channel& of, bool wanted) {
    reported.push_back(of.topic + (wanted ? " wanted" : " left"));
  });
  stream.set_wanted(id, true);
  stream.set_wanted(id, true);
  stream.set_wanted(id, false);
  EXPECT_EQ(reported, std::vector<std::string>{"/cell/state wanted"});
  stream.set_wanted(id, false);
  EXPECT_EQ(reported.back(), "/cell/state left");
  stream.forget(&reported);
  stream.set_wanted(id, true);
  EXPECT_EQ(reported.size(), 2U);
}

TEST(FoxgloveProtocol, SubscriptionsAreReadAndInvalidOnesRefused) {
  const auto wanted =
      foxglove::read_text(R"({"op": "subscribe", "subscriptions": [{"id": 7, "channelId": 3}]})");
  ASSERT_TRUE(wanted);
  ASSERT_EQ(wanted->subscribe.size(), 1U);
  EXPECT_EQ(wanted->subscribe[0].id, 7U);
  EXPECT_EQ(wanted->subscribe[0].channel, 3U);
  EXPECT_EQ(foxglove::read_text(R"({"op": "unsubscribe", "subscriptionIds": [7]})")->unsubscribe,
            std::vector<std::uint32_t>{7});
  for (const char* text : {"", "{", "[]", R"({"op": 3})", R"({"op": "subscribe"})",
                           R"({"op": "subscribe", "subscriptions": [{"id": "x"}]})"})
    EXPECT_FALSE(foxglove::read_text(text)) << text;
}

TEST(FoxgloveProtocol, CallsAreReadAndCutOnesReported) {
  std::string call("\x02\x01\x00\x00\x00\x05\x00\x00\x00\x04\x00\x00\x00json", 17);
  const std::size_t head = call.size();
  call +=
      R"({"request": "step", "arguments": {"b": true, "d": {"a": 1}, "n": [1, 0.5], "steps": 10, "t": ["u"],
    "why": "a test", "x": 0.5}})";
  const auto read = foxglove::read_binary(call);
  ASSERT_TRUE(read);
  EXPECT_EQ(read->problem, "");
  EXPECT_EQ(read->call, 5U);
  EXPECT_EQ(read->request, "step");
  using takt::ValueKind;
  const takt::Arguments expected{{"b", {.kind = ValueKind::boolean, .flag = true}},
                                 {"d", {.kind = ValueKind::document, .text = R"({"a":1})"}},
                                 {"n", {.kind = ValueKind::numbers, .numbers = {1.0, 0.5}}},
                                 {"steps", {.kind = ValueKind::integer, .integer = 10}},
                                 {"t", {.kind = ValueKind::texts, .texts = {"u"}}},
                                 {"why", {.kind = ValueKind::text, .text = "a test"}},
                                 {"x", {.kind = ValueKind::number, .number = 0.5}}};
  EXPECT_EQ(read->arguments, expected);
  // An answer has the same form.
  const std::string response = foxglove::service_response(1, 5, {takt::ControlResult::ok, "Done.", expected});
  const auto answer = nlohmann::json::parse(response.substr(1 + 3 * 4 + 4));
  EXPECT_EQ(answer["result"], 1);
  EXPECT_EQ(answer["values"], nlohmann::json::parse(call.substr(head))["arguments"]);
  for (std::size_t length = 0; length < call.size(); ++length) {
    const auto cut = foxglove::read_binary(std::string_view(call).substr(0, length));
    EXPECT_EQ(cut.has_value(), length >= head) << length;
    if (cut.has_value()) {
      EXPECT_NE(cut->problem, "") << length;
    }
  }
  call[1] = 9;
  EXPECT_NE(foxglove::read_binary(call)->problem, "");
}

std::string called(std::size_t levels) {
  return std::string("\x02\x01\x00\x00\x00\x05\x00\x00\x00\x04\x00\x00\x00json", 17) +
         R"({"request": "x", "arguments": {"a": )" + std::string(levels, '[') + std::string(levels, ']') +
         "}}";
}

TEST(FoxgloveProtocol, DeepNestingAndRequestsOfObserversAreRefused) {
  EXPECT_EQ(foxglove::read_binary(called(30))->problem, "");
  EXPECT_NE(foxglove::read_binary(called(31))->problem, "");
  EXPECT_NE(foxglove::read_binary(called(400'000))->problem, "");
  const auto observed = foxglove::read_binary(called(400'000), false);
  EXPECT_EQ(observed->problem, "Observers may look, not touch.");
  EXPECT_EQ(observed->call, 5U);
  EXPECT_FALSE(foxglove::read_text(R"({"op": "x", "a": )" + std::string(400'000, '[') +
                                   std::string(400'000, ']') + "}"));
  EXPECT_FALSE(foxglove::read_text(std::string(1'000'000, '[')));
  EXPECT_FALSE(foxglove::read_text(R"({"op": "subscribe")" + std::string("\xff") + "}"));
}

TEST(JsonText, InvalidUtf8IsReplaced) {
  using takt::recording::json_text;
  EXPECT_EQ(json_text(nlohmann::json{{"name",
                                      "a\xff"
                                      "b"}}),
            "{\"name\":\"a\xef\xbf\xbd"
            "b\"}");
  EXPECT_EQ(json_text(nlohmann::ordered_json{{"b", 1}, {"a", "\xc3"}}, 1),
            "{\n \"b\": 1,\n \"a\": \"\xef\xbf\xbd\"\n}");
}

TEST(FoxgloveProtocol, SamplesCarryTheirSubscriptionAndTime) {
  const auto head = foxglove::sample_head(0x04030201, 0x0c0b0a0908070605);
  const char expected[] = "\x01\x01\x02\x03\x04\x05\x06\x07\x08\x09\x0a\x0b\x0c";
  EXPECT_EQ(std::memcmp(head.data(), expected, head.size()), 0);
}

}  // namespace
