// RTDE byte by byte. The golden bytes are a transcript that the vendor's Python client accepted.
#include <gtest/gtest.h>

#include <random>

#include "client_lib/gateway/rtde/client_session.h"
#include "client_lib/gateway/rtde/server_session.h"

namespace {

using namespace takt::rtde;

/// Bytes of hexadecimal digits; blanks are left out, and text stands in quotes.
std::string bytes(std::string_view text) {
  std::string result;
  bool quoted = false;
  int digit = -1;
  for (const char c : text) {
    if (c == '"') {
      quoted = !quoted;
    } else if (quoted) {
      result.push_back(c);
    } else if (c != ' ') {
      const int value = c <= '9' ? c - '0' : c - 'a' + 10;
      if (digit >= 0) result.push_back(static_cast<char>(16 * digit + value));
      digit = digit >= 0 ? -1 : value;
    }
  }
  return result;
}

struct Controller {
  Table outputs = output_table(), inputs = input_table();
  InputOwners owners{inputs.variables().size()};
  std::vector<std::vector<ServerSession::Written>> written{};
  std::unique_ptr<ServerSession> session(std::uint64_t connection = 1) {
    return std::make_unique<ServerSession>(outputs, inputs, owners, connection,
                                           ControllerVersion{5, 16, 0, 0}, 0.002,
                                           [this](const auto& values) { written.push_back(values); });
  }
};

const std::string kVersion2 = bytes("0005 56 0002");
const std::string kOutputs = bytes(
    "0068 4f 405f400000000000 "
    "\"timestamp,target_q,actual_digital_output_bits,runtime_state,robot_mode,output_bit_register_64\"");
const std::string kInputs =
    bytes("0050 49 \"standard_digital_output_mask,standard_digital_output,input_double_register_24\"");
const std::string kStart = bytes("0003 53");
const std::string kData = bytes(
    "004d 55 01 4059000000000000 0000000000000000 bff91eb851eb851f 3ff91eb851eb851f bff91eb851eb851f "
    "bff91eb851eb851f "
    "0000000000000000 0000000000010001 00000002 00000007 01");
const std::string kWrite = bytes("000e 55 01 01 01 3fd0000000000000");

void set_golden_values(Table& outputs) {
  outputs.set("timestamp", 100.0);
  const double q[6] = {0.0, -1.57, 1.57, -1.57, -1.57, 0.0};
  outputs.set_vector("target_q", q);
  outputs.set_whole("actual_digital_output_bits", 0x10001);
  outputs.set_whole("runtime_state", 2);
  outputs.set_whole("robot_mode", 7);
  outputs.set_whole("output_bit_register_64", 1);
}

TEST(RtdeServer, GoldenTranscript) {
  Controller controller;
  const auto session = controller.session();
  EXPECT_EQ(session->receive(kVersion2), bytes("0004 56 01"));
  EXPECT_EQ(session->receive(bytes("0003 76")), bytes("0013 76 00000005 00000010 00000000 00000000"));
  EXPECT_EQ(session->receive(kOutputs), bytes("002c 4f 01 \"DOUBLE,VECTOR6D,UINT64,UINT32,INT32,BOOL\""));
  EXPECT_EQ(session->receive(kInputs), bytes("0016 49 01 \"UINT8,UINT8,DOUBLE\""));
  EXPECT_EQ(session->receive(kStart), bytes("0004 53 01"));
  set_golden_values(controller.outputs);
  EXPECT_EQ(session->data(8), kData);
  EXPECT_EQ(session->receive(kWrite), "");
  ASSERT_EQ(controller.written.size(), 1U);
  ASSERT_EQ(controller.written[0].size(), 3U);
  EXPECT_EQ(controller.inputs.variables()[controller.written[0][2].variable].name,
            "input_double_register_24");
  EXPECT_EQ(controller.written[0][0].value.whole[0], 1);
  EXPECT_EQ(controller.written[0][2].value.real[0], 0.25);
  EXPECT_EQ(session->receive(bytes("0003 50")), bytes("0004 50 01"));
  EXPECT_EQ(session->data(12), "");
  EXPECT_EQ(session->receive(bytes("001b 4f 405f400000000000 \"timestamp,nosuch\"")),
            bytes("0014 4f 00 \"DOUBLE,NOT_FOUND\""));
  EXPECT_EQ(session->receive(kStart), bytes("0004 53 00"));
}

TEST(RtdeServer, ADataPackageMayLeaveOutTheLastInputsOfItsRecipe) {
  Controller controller;
  const auto session = controller.session();
  session->receive(kVersion2 + kInputs);
  EXPECT_EQ(session->receive(bytes("0005 55 01 07")), "");
  ASSERT_EQ(controller.written.size(), 1U);
  ASSERT_EQ(controller.written[0].size(), 1U);
  EXPECT_EQ(controller.written[0][0].value.whole[0], 7);
  // None at all, a number that is cut, and one byte too many.
  for (const char* wrong : {"0004 55 01", "0007 55 01 07 07 3f", "000f 55 01 07 07 3fd0000000000000 00"}) {
    EXPECT_NE(session->receive(bytes(wrong)), "") << wrong;
    EXPECT_EQ(controller.written.size(), 1U) << wrong;
  }
}

TEST(RtdeServer, SendsEachSoManyCycles) {
  Controller controller;
  const auto session = controller.session();
  session->receive(kVersion2 + kOutputs + kStart);  // 125 Hz of 500 Hz
  for (std::uint64_t cycle = 0; cycle < 12; ++cycle)
    EXPECT_EQ(session->data(cycle).empty(), cycle % 4 != 0) << cycle;
}

TEST(RtdeServer, ProtocolOneHasNoRecipeNumbers) {
  Controller controller;
  const auto session = controller.session();
  EXPECT_EQ(session->receive(bytes("000e 4f \"timestamp\"").replace(1, 1, 1, '\x0c')),
            bytes("0009 4f \"DOUBLE\""));
  EXPECT_EQ(session->receive(kStart), bytes("0004 53 01"));
  controller.outputs.set("timestamp", 100.0);
  EXPECT_EQ(session->data(1), bytes("000b 55 4059000000000000"));
}

TEST(RtdeServer, RepliesDoNotDependOnHowBytesAreCut) {
  const std::string stream =
      kVersion2 + bytes("0003 76") + kOutputs + kInputs + kStart + kWrite + bytes("0003 50");
  Controller whole;
  const std::string expected = whole.session()->receive(stream);
  for (std::size_t cut = 1; cut < stream.size(); ++cut) {
    Controller controller;
    const auto session = controller.session();
    std::string replies = session->receive(stream.substr(0, cut));
    replies += session->receive(stream.substr(cut));
    ASSERT_EQ(replies, expected) << "cut at byte " << cut;
    ASSERT_EQ(controller.written.size(), 1U) << "cut at byte " << cut;
  }
}

TEST(RtdeServer, AWrittenVariableIsInUseUntilItsConnectionEnds) {
  Controller controller;
  auto first = controller.session(1);
  const auto second = controller.session(2);
  first->receive(kVersion2 + kInputs);
  second->receive(kVersion2);
  EXPECT_EQ(second->receive(kInputs), bytes("0018 49 00 \"IN_USE,IN_USE,IN_USE\""));
  first.reset();
  EXPECT_EQ(second->receive(kInputs), bytes("0016 49 01 \"UINT8,UINT8,DOUBLE\""));
}

TEST(RtdeServer, AStreamThatIsNoRtdeEnds) {
  for (const char* hostile : {"0002 56", "0000 00", "0003 41", "ffff 7a"}) {
    Controller controller;
    const auto session = controller.session();
    EXPECT_EQ(session->receive(bytes(hostile)), "") << hostile;
    EXPECT_TRUE(session->broken()) << hostile;
  }
}

TEST(RtdeServer, DataOfAWrongSizeOrOfNoNumberIsNotTaken) {
  Controller controller;
  const auto session = controller.session();
  session->receive(kVersion2 + kInputs);
  for (const char* data :
       {"000d 55 01 01 01 3fd00000000000", "000f 55 01 01 01 3fd0000000000000 00",
        "000e 55 02 01 01 3fd0000000000000", "000e 55 01 01 01 7ff8000000000000", "0003 55"})
    EXPECT_EQ(session->receive(bytes(data)).substr(2, 1), "M") << data;
  EXPECT_TRUE(controller.written.empty());
}

TEST(RtdeServer, RandomBytesLeaveItWhole) {
  std::mt19937 random(1);
  const std::string good = kVersion2 + kOutputs + kInputs + kStart + kWrite;
  for (int run = 0; run < 2000; ++run) {
    Controller controller;
    const auto session = controller.session();
    std::string hostile = good;
    for (int change = 0; change < 3; ++change)
      hostile[random() % hostile.size()] = static_cast<char>(random());
    const std::string replies = session->receive(hostile + hostile);
    EXPECT_LT(replies.size(), 1000U);
    for (std::uint64_t cycle = 0; cycle < 8; ++cycle) session->data(cycle);
  }
}

TEST(RtdeClient, GoldenTranscript) {
  ClientSession client(
      {"timestamp", "target_q", "actual_digital_output_bits", "runtime_state", "robot_mode",
       "output_bit_register_64"},
      {"standard_digital_output_mask", "standard_digital_output", "input_double_register_24"}, 125.0);
  int packages = 0;
  const auto on_data = [&] { ++packages; };
  EXPECT_EQ(client.begin(), kVersion2);
  EXPECT_EQ(client.receive(bytes("0004 56 01"), on_data), kOutputs);
  EXPECT_EQ(client.receive(bytes("002c 4f 01 \"DOUBLE,VECTOR6D,UINT64,UINT32,INT32,BOOL\""), on_data),
            kInputs);
  EXPECT_EQ(client.receive(bytes("0016 49 01 \"UINT8,UINT8,DOUBLE\""), on_data), kStart);
  EXPECT_EQ(client.receive(bytes("0004 53 01") + kData + kData, on_data), "");
  EXPECT_EQ(packages, 1) << "of a backlog the newest package counts";
  EXPECT_EQ(client.value("target_q").real[1], -1.57);
  EXPECT_EQ(client.value("actual_digital_output_bits").whole[0], 0x10001);
  EXPECT_EQ(client.value("output_bit_register_64").whole[0], 1);
  std::vector<Value> inputs(3);
  inputs[0].whole[0] = inputs[1].whole[0] = 1;
  inputs[2].real[0] = 0.25;
  EXPECT_EQ(client.inputs(inputs), kWrite);
}

TEST(RtdeClient, NamesTheVariableThatAnotherClientWrites) {
  ClientSession client({"timestamp"}, {"input_double_register_24"}, 125.0);
  client.receive(bytes("0004 56 01") + bytes("000a 4f 01 \"DOUBLE\"") + bytes("000a 49 00 \"IN_USE\""),
                 [] {});
  EXPECT_NE(client.failure().find("IN_USE for input_double_register_24"), std::string::npos)
      << client.failure();
}

}  // namespace
