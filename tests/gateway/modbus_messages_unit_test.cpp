// Messages of Modbus TCP against the examples of the Modbus Application Protocol Specification 1.1b3, section 6.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "client_lib/gateway/modbus/client_watch.h"
#include "client_lib/gateway/modbus/messages.h"
#include "client_lib/gateway/modbus/poller.h"
#include "client_lib/gateway/modbus/table.h"

namespace takt::test::modbus_messages {
namespace {

using namespace gateway::modbus;
using testing::ElementsAre;
using testing::HasSubstr;

std::string bytes_of(std::initializer_list<int> values) {
  std::string bytes;
  for (const int value : values) bytes += static_cast<char>(value);
  return bytes;
}

/// Memory of the examples: 65536 addresses in each area.
class WholeMemory final : public Memory {
 public:
  std::vector<bool> coils = std::vector<bool>(kAddresses), inputs = std::vector<bool>(kAddresses);
  std::vector<std::uint16_t> holding = std::vector<std::uint16_t>(kAddresses),
                             input = std::vector<std::uint16_t>(kAddresses);

  bool read_bits(bool of_coils, std::size_t first, std::size_t count, std::vector<bool>& bits) override {
    const auto& all = of_coils ? coils : inputs;
    bits.assign(all.begin() + static_cast<std::ptrdiff_t>(first),
                all.begin() + static_cast<std::ptrdiff_t>(first + count));
    return true;
  }
  bool read_registers(bool of_holding, std::size_t first, std::size_t count,
                      std::vector<std::uint16_t>& values) override {
    const auto& all = of_holding ? holding : input;
    values.assign(all.begin() + static_cast<std::ptrdiff_t>(first),
                  all.begin() + static_cast<std::ptrdiff_t>(first + count));
    return true;
  }
  Exception write_coils(std::size_t first, const std::vector<bool>& bits) override {
    for (std::size_t i = 0; i < bits.size(); ++i) coils[first + i] = bits[i];
    return Exception::none;
  }
  Exception write_registers(std::size_t first, const std::vector<std::uint16_t>& values) override {
    for (std::size_t i = 0; i < values.size(); ++i) holding[first + i] = values[i];
    return Exception::none;
  }
};

void set_bits(std::vector<bool>& bits, std::size_t first, std::initializer_list<unsigned> bytes) {
  for (const unsigned byte : bytes)
    for (unsigned bit = 0; bit < 8; ++bit) bits[first++] = (byte >> bit & 1U) != 0;
}

WholeMemory example() {
  WholeMemory memory;
  set_bits(memory.coils, 0x13, {0xcd, 0x6b, 0x05});
  set_bits(memory.inputs, 0xc4, {0xac, 0xdb, 0x35});
  memory.holding[0x6b] = 0x022b, memory.holding[0x6d] = 0x0064;
  memory.input[8] = 0x000a;
  memory.holding[0x20] = 0x12;
  const std::uint16_t registers[] = {0x00fe, 0x0acd, 0x0001, 0x0003, 0x000d, 0x00ff};
  std::ranges::copy(registers, memory.holding.begin() + 3);
  return memory;
}

struct Example {
  std::string request, reply;
};
std::vector<Example> examples() {
  return {
      {bytes_of({1, 0, 0x13, 0, 0x13}), bytes_of({1, 3, 0xcd, 0x6b, 0x05})},
      {bytes_of({2, 0, 0xc4, 0, 0x16}), bytes_of({2, 3, 0xac, 0xdb, 0x35})},
      {bytes_of({3, 0, 0x6b, 0, 3}), bytes_of({3, 6, 2, 0x2b, 0, 0, 0, 0x64})},
      {bytes_of({4, 0, 8, 0, 1}), bytes_of({4, 2, 0, 0x0a})},
      {bytes_of({5, 0, 0xac, 0xff, 0}), bytes_of({5, 0, 0xac, 0xff, 0})},
      {bytes_of({6, 0, 1, 0, 3}), bytes_of({6, 0, 1, 0, 3})},
      {bytes_of({15, 0, 0x13, 0, 0x0a, 2, 0xcd, 1}), bytes_of({15, 0, 0x13, 0, 0x0a})},
      {bytes_of({16, 0, 1, 0, 2, 4, 0, 0x0a, 1, 2}), bytes_of({16, 0, 1, 0, 2})},
      {bytes_of({23, 0, 3, 0, 6, 0, 0x0e, 0, 3, 6, 0, 0xff, 0, 0xff, 0, 0xff}),
       bytes_of({23, 12, 0, 0xfe, 0x0a, 0xcd, 0, 1, 0, 3, 0, 0x0d, 0, 0xff})},
      {bytes_of({22, 0, 0x20, 0, 0xf2, 0, 0x25}), bytes_of({22, 0, 0x20, 0, 0xf2, 0, 0x25})},
  };
}

TEST(ModbusMessages, RepliesAreThoseOfTheSpecification) {
  WholeMemory memory = example();
  for (const Example& each : examples()) EXPECT_EQ(reply_to(each.request, memory), each.reply);
  EXPECT_TRUE(memory.coils[0xac]);
  EXPECT_EQ(memory.holding[1], 0x000a);  // function 16 comes after function 6
  EXPECT_EQ(memory.holding[2], 0x0102);
  EXPECT_EQ(memory.holding[0x10], 0x00ff);
  EXPECT_EQ(memory.holding[0x20], 0x17);
  EXPECT_TRUE(memory.coils[0x13]);
  EXPECT_TRUE(memory.coils[0x1b]);
  EXPECT_FALSE(memory.coils[0x1c]);
}

TEST(ModbusMessages, RequestsAreThoseOfTheSpecification) {
  const auto all = examples();
  EXPECT_EQ(read_request(Function::read_coils, 0x13, 0x13), all[0].request);
  EXPECT_EQ(write_coils_request(0x13, {true, false, true, true, false, false, true, true, true, false}),
            all[6].request);
  EXPECT_EQ(write_registers_request(1, {0x0a, 0x102}), all[7].request);
  EXPECT_EQ(read_write_request(3, 6, 0x0e, {0xff, 0xff, 0xff}), all[8].request);
  const Reply bits = parse_reply(all[0].request, all[0].reply);
  EXPECT_EQ(bits.fault, "");
  ASSERT_EQ(bits.bits.size(), 19U);
  EXPECT_TRUE(bits.bits[0]);
  EXPECT_FALSE(bits.bits[1]);
  EXPECT_TRUE(bits.bits[18]);
  EXPECT_THAT(parse_reply(all[2].request, all[2].reply).registers, ElementsAre(0x22b, 0, 0x64));
  EXPECT_THAT(parse_reply(all[8].request, all[8].reply).registers,
              ElementsAre(0xfe, 0xacd, 1, 3, 0x0d, 0xff));
}

TEST(ModbusMessages, ARequestThatCannotBeServedHasTheExceptionOfTheSpecification) {
  struct Case {
    std::string request;
    int exception;
  };
  const Case cases[] = {
      {bytes_of({99}), 1},
      {bytes_of({8, 0, 0, 0, 0}), 1},
      {bytes_of({1, 0, 0, 0, 0}), 3},        // no bit
      {bytes_of({1, 0, 0, 0x07, 0xd1}), 3},  // 2001 bits
      {bytes_of({3, 0, 0, 0, 126}), 3},      // 126 registers
      {bytes_of({3, 0xff, 0xff, 0, 2}), 2},  // beyond 65535
      {bytes_of({1, 0xff, 0xff, 0, 2}), 2},
      {bytes_of({3, 0, 0, 0}), 3},        // too short
      {bytes_of({3, 0, 0, 0, 1, 0}), 3},  // too long
      {bytes_of({5, 0, 0, 0xff, 1}), 3},  // neither FF00 nor 0000
      {bytes_of({6, 0, 0, 1}), 3},
      {bytes_of({15, 0, 0, 0, 9, 1, 0xff}), 3},  // one byte for nine bits
      {bytes_of({15, 0, 0, 0, 8, 1}), 3},
      {bytes_of({15, 0xff, 0xff, 0, 2, 1, 3}), 2},
      {bytes_of({16, 0, 0, 0, 1, 4, 0, 0, 0, 0}), 3},  // bytes of two registers
      {bytes_of({16, 0, 0, 0, 0, 0}), 3},
      {bytes_of({16, 0xff, 0xff, 0, 2, 4, 0, 0, 0, 0}), 2},
      {bytes_of({23, 0, 0, 0, 1, 0, 0, 0, 1, 4, 0, 0}), 3},
      {bytes_of({23, 0, 0, 0, 126, 0, 0, 0, 1, 2, 0, 0}), 3},
      {bytes_of({22, 0, 0, 0, 1, 0}), 3},
      {bytes_of({43}), 1},
      {bytes_of({43, 13, 0, 0}), 1},  // CANopen
      {bytes_of({43, 14, 0, 0}), 3},  // no such code
      {bytes_of({43, 14, 5, 0}), 3},
      {bytes_of({43, 14, 1}), 3},
      {bytes_of({43, 14, 4, 3}), 2},  // no such object
  };
  WholeMemory memory;
  for (const Case& each : cases) {
    const std::string reply = reply_to(each.request, memory);
    EXPECT_EQ(reply, bytes_of({static_cast<unsigned char>(each.request[0]) | 0x80, each.exception}))
        << testing::PrintToString(each.request);
  }
}

TEST(ModbusMessages, AServerNamesItselfByItsBasicObjects) {
  WholeMemory memory;
  const auto ask = [&](int code, int object) { return reply_to(bytes_of({43, 14, code, object}), memory); };
  const auto head = [](int code, int count) { return bytes_of({43, 14, code, 0x81, 0, 0, count}); };
  const std::string vendor = bytes_of({0, 4}) + "takt", product = bytes_of({1, 11}) + "takt-modbus";
  EXPECT_EQ(ask(4, 0), head(4, 1) + vendor);
  EXPECT_EQ(ask(4, 1), head(4, 1) + product);
  const std::string revision = ask(4, 2).substr(head(4, 1).size());
  EXPECT_GT(revision.size(), 2U);
  for (const int code : {1, 2, 3}) {
    EXPECT_EQ(ask(code, 0), head(code, 3) + vendor + product + revision);
    EXPECT_EQ(ask(code, 1), head(code, 2) + product + revision);
    EXPECT_EQ(ask(code, 77), ask(code, 0));
  }
}

TEST(ModbusMessages, AStreamMayBeCutAtEveryByte) {
  std::string stream;
  std::vector<std::string> wanted;
  std::uint16_t transaction = 65530;
  for (const Example& each : examples()) {
    stream += encode({transaction++, 17, each.request});
    wanted.push_back(each.request);
  }
  EXPECT_EQ(stream.substr(0, 12), bytes_of({0xff, 0xfa, 0, 0, 0, 6, 17, 1, 0, 0x13, 0, 0x13}));
  for (std::size_t cut = 0; cut <= stream.size(); ++cut) {
    FrameStream frames;
    std::vector<std::string> found;
    std::uint16_t next = 65530;
    for (const std::string& part : {stream.substr(0, cut), stream.substr(cut)}) {
      frames.add(part);
      while (const auto frame = frames.next()) {
        EXPECT_EQ(frame->transaction, next++);
        EXPECT_EQ(frame->unit, 17);
        found.push_back(frame->pdu);
      }
    }
    EXPECT_EQ(found, wanted) << "cut at " << cut;
    EXPECT_EQ(frames.fault(), "");
  }
}

TEST(ModbusMessages, BytesThatAreNoModbusEndTheStream) {
  const auto fault_of = [](const std::string& bytes) {
    FrameStream stream;
    stream.add(bytes);
    EXPECT_FALSE(stream.next());
    stream.add(encode({1, 1, bytes_of({1, 0, 0, 0, 1})}));
    EXPECT_FALSE(stream.next());
    return stream.fault();
  };
  EXPECT_THAT(fault_of(bytes_of({0, 1, 0, 1})), HasSubstr("protocol 1"));
  EXPECT_THAT(fault_of(bytes_of({0, 1, 0, 0, 0, 0})), HasSubstr("length 0"));
  EXPECT_THAT(fault_of(bytes_of({0, 1, 0, 0, 0, 1})), HasSubstr("length 1"));
  EXPECT_THAT(fault_of(bytes_of({0, 1, 0, 0, 0, 255})), HasSubstr("length 255"));
  EXPECT_THAT(fault_of(bytes_of({0, 1, 0, 0, 0xff, 0xff})), HasSubstr("length 65535"));
  EXPECT_THAT(fault_of("GET / HTTP/1.1\r\n"), HasSubstr("protocol"));
}

TEST(ModbusMessages, RandomRequestsHaveAReplyOfAtMost253Bytes) {
  std::mt19937 random(11);
  WholeMemory memory = example();
  for (int i = 0; i < 20000; ++i) {
    std::string pdu(1 + random() % 40, '\0');
    for (char& byte : pdu) byte = static_cast<char>(random());
    if (i % 2 == 0) pdu[0] = static_cast<char>(std::array{1, 2, 3, 4, 5, 6, 15, 16, 23}[random() % 9]);
    const std::string reply = reply_to(pdu, memory);
    ASSERT_GE(reply.size(), 2U);
    ASSERT_LE(reply.size(), kMostPdu_bytes);
    ASSERT_EQ(static_cast<unsigned char>(reply[0]) & 0x7fU, static_cast<unsigned char>(pdu[0]) & 0x7fU);
  }
}

TEST(ModbusNumbers, TakeTheirRegistersInTheOrderOfTheSetting) {
  bool beyond = false;
  const auto high = WordOrder::high_first, low = WordOrder::low_first;
  EXPECT_THAT(to_registers(1.0, NumberType::float32, high, beyond), ElementsAre(0x3f80, 0));  // IEEE 754
  EXPECT_THAT(to_registers(1.0, NumberType::float32, low, beyond), ElementsAre(0, 0x3f80));
  EXPECT_THAT(to_registers(-2, NumberType::int16, high, beyond), ElementsAre(0xfffe));
  EXPECT_THAT(to_registers(65535, NumberType::uint16, high, beyond), ElementsAre(0xffff));
  EXPECT_THAT(to_registers(-2, NumberType::int32, high, beyond), ElementsAre(0xffff, 0xfffe));
  EXPECT_THAT(to_registers(66000.4, NumberType::uint32, low, beyond), ElementsAre(464, 1));
  EXPECT_FALSE(beyond);
  EXPECT_THAT(to_registers(70000, NumberType::uint16, high, beyond), ElementsAre(0xffff));
  EXPECT_TRUE(beyond);
  beyond = false;
  EXPECT_THAT(to_registers(-1, NumberType::uint32, high, beyond), ElementsAre(0, 0));
  EXPECT_TRUE(beyond);
  beyond = false;
  EXPECT_THAT(to_registers(std::nan(""), NumberType::float32, high, beyond), ElementsAre(0, 0));
  EXPECT_TRUE(beyond);
  for (const NumberType type :
       {NumberType::int16, NumberType::uint16, NumberType::int32, NumberType::uint32, NumberType::float32})
    for (const WordOrder order : {high, low})
      for (const double number : {0.0, 1.0, 255.0, 256.0, 32767.0})
        EXPECT_EQ(from_registers(to_registers(number, type, order, beyond).data(), type, order), number);
}

TEST(ModbusTable, WritesAllOfARequestOrNothing) {
  Table table({{Area::holding_registers, 0, NumberType::uint16, WordOrder::high_first, 0, 100},
               {Area::holding_registers, 1, NumberType::float32, WordOrder::high_first, -1, 1},
               {Area::holding_registers, 5, NumberType::int16},
               {Area::coils, 3}});
  EXPECT_EQ(table.write_registers(0, {50, 0x3f00, 0}), Exception::none);  // 0.5
  EXPECT_THAT(table.take_written(), ElementsAre(0, 1));
  EXPECT_EQ(table.number(1), 0.5);
  EXPECT_EQ(table.write_registers(0, {60, 0x4000, 0}), Exception::illegal_value);  // 2.0
  EXPECT_EQ(table.number(0), 50);
  EXPECT_EQ(table.write_registers(0, {101}), Exception::illegal_value);
  EXPECT_EQ(table.write_registers(1, {0x7fc0, 0}), Exception::illegal_value);  // not a number
  EXPECT_EQ(table.write_registers(2, {0}), Exception::illegal_address);        // half of a float
  EXPECT_EQ(table.write_registers(5, {1, 2}), Exception::illegal_address);     // beyond the area
  EXPECT_TRUE(table.take_written().empty());
  EXPECT_EQ(table.write_registers(3, {7, 8, 9}), Exception::none);  // two free registers and an element
  EXPECT_THAT(table.take_written(), ElementsAre(2));
  std::vector<std::uint16_t> values;
  EXPECT_TRUE(table.read_registers(true, 3, 3, values));
  EXPECT_THAT(values, ElementsAre(7, 8, 9));
  EXPECT_EQ(table.write_coils(3, {true}), Exception::none);
  EXPECT_EQ(table.write_coils(4, {true}), Exception::illegal_address);
  EXPECT_EQ(table.number(3), 1.0);
}

/// Answers all that a poller sends, until it is idle.
void answer(Poller& poller, std::string messages, Memory& memory,
            std::vector<std::string>* requests = nullptr) {
  FrameStream stream;
  while (!messages.empty()) {
    stream.add(messages);
    messages.clear();
    while (const auto frame = stream.next()) {
      if (requests != nullptr) requests->push_back(frame->pdu);
      const std::string reply = encode({frame->transaction, frame->unit, reply_to(frame->pdu, memory)});
      for (const char byte : reply) messages += poller.receive(std::string_view(&byte, 1));
    }
  }
}

const std::vector<Element> kPolled{{Area::discrete_inputs, 2},
                                   {Area::discrete_inputs, 9},
                                   {Area::coils, 0},
                                   {Area::coils, 1},
                                   {Area::coils, 3},
                                   {Area::holding_registers, 10, NumberType::float32},
                                   {Area::holding_registers, 20, NumberType::int16},
                                   {Area::input_registers, 200, NumberType::uint16}};
const std::vector<bool> kPolledReads{true, true, false, false, false, true, false, true};

TEST(ModbusPoller, JoinsAddressesAndWritesNoneThatIsNotItsOwn) {
  Poller poller(kPolled, kPolledReads, {.unit = 7});
  WholeMemory plc;
  plc.inputs[9] = true;
  plc.holding[10] = 0x3f80;
  plc.input[200] = 77;
  plc.coils[2] = true;
  std::vector<std::string> requests;
  answer(poller, poller.begin({0, 0, 1, 0, 1, 0, -5, 0}), plc, &requests);
  EXPECT_THAT(requests, ElementsAre(bytes_of({15, 0, 0, 0, 2, 1, 1}), bytes_of({15, 0, 3, 0, 1, 1, 1}),
                                    bytes_of({16, 0, 20, 0, 1, 2, 0xff, 0xfb}), bytes_of({2, 0, 2, 0, 8}),
                                    bytes_of({3, 0, 10, 0, 2}), bytes_of({4, 0, 200, 0, 1})));
  EXPECT_TRUE(poller.idle());
  EXPECT_EQ(poller.fault(), "");
  EXPECT_EQ(poller.number(0), 0);
  EXPECT_EQ(poller.number(1), 1);
  EXPECT_EQ(poller.number(5), 1.0);
  EXPECT_EQ(poller.number(7), 77);
  EXPECT_TRUE(plc.coils[0] && !plc.coils[1] && plc.coils[2] && plc.coils[3]);
  EXPECT_EQ(plc.holding[20], 0xfffb);
  EXPECT_EQ(poller.counters().cycles, 1U);
  EXPECT_EQ(poller.counters().replies, 6U);
}

TEST(ModbusPoller, WritesAndReadsHoldingRegistersByOneRequestOfFunction23) {
  Poller poller(kPolled, kPolledReads, {.unit = 7, .combined = true});
  WholeMemory plc;
  plc.holding[10] = 0x3f80;
  std::vector<std::string> requests;
  answer(poller, poller.begin({0, 0, 1, 0, 1, 0, -5, 0}), plc, &requests);
  EXPECT_EQ(requests[2], bytes_of({23, 0, 10, 0, 2, 0, 20, 0, 1, 2, 0xff, 0xfb}));
  EXPECT_EQ(requests.size(), 5U);
  EXPECT_EQ(poller.number(5), 1.0);
  EXPECT_EQ(plc.holding[20], 0xfffb);
}

TEST(ModbusPoller, AnExceptionIsCountedAndItsValuesAreNotKnown) {
  Poller poller({{Area::input_registers, 0}, {Area::discrete_inputs, 0}}, {true, true}, {});
  Table plc({{Area::discrete_inputs, 0}});
  plc.set(0, 1);
  answer(poller, poller.begin({0, 0}), plc);
  EXPECT_TRUE(poller.idle());
  EXPECT_FALSE(poller.known(0));
  EXPECT_TRUE(poller.known(1));
  EXPECT_EQ(poller.counters().exceptions, 1U);
  EXPECT_EQ(poller.counters().exception,
            "The PLC answers function 4 at address 0 by the exception illegal address (2).");
}

TEST(ModbusPoller, AReplyToAnotherRequestIsAFault) {
  const auto fault_of = [](const Frame& reply) {
    Poller poller({{Area::input_registers, 0}}, {true}, {});
    poller.begin({0});
    EXPECT_EQ(poller.receive(encode(reply)), "");
    return poller.fault();
  };
  const std::string good = bytes_of({4, 2, 0, 1});
  EXPECT_EQ(fault_of({1, 1, good}), "");
  EXPECT_THAT(fault_of({0, 1, good}), HasSubstr("transaction 0 in the reply to transaction 1"));
  EXPECT_THAT(fault_of({1, 1, bytes_of({3, 2, 0, 1})}), HasSubstr("function 3"));
  EXPECT_THAT(fault_of({1, 1, bytes_of({4, 4, 0, 1, 0, 1})}), HasSubstr("number of bytes"));
  EXPECT_THAT(fault_of({1, 1, bytes_of({4, 2, 0})}), HasSubstr("number of bytes"));
  EXPECT_THAT(fault_of({1, 1, bytes_of({0x84})}), HasSubstr("without its code"));
  Poller poller({{Area::input_registers, 0}}, {true}, {});
  poller.receive(encode({0, 1, good}));
  EXPECT_THAT(poller.fault(), HasSubstr("without a request"));
}

TEST(ModbusClientWatch, OnlyAClientThatHasWrittenCanBeSilentAndOnce) {
  ClientWatch watch(1.0);
  watch.heard(1, "a", false, 0.0);
  EXPECT_FALSE(watch.silent(5.0));
  watch.heard(1, "a", true, 5.0);
  watch.heard(1, "a", false, 5.9);
  EXPECT_FALSE(watch.silent(6.8));
  EXPECT_EQ(watch.silent(6.9), "a");
  EXPECT_FALSE(watch.silent(9.0));
  // Back from the same address within the deadline.
  watch.heard(2, "b", true, 10.0);
  watch.closed(2);
  watch.heard(3, "b", true, 10.5);
  EXPECT_FALSE(watch.silent(11.2));
  EXPECT_EQ(watch.silent(11.5), "b");
  // One that closes and stays away.
  watch.heard(4, "c", true, 20.0);
  watch.closed(4);
  EXPECT_EQ(watch.silent(21.0), "c");
}

}  // namespace
}  // namespace takt::test::modbus_messages
