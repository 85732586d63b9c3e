// Foreign and damaged recordings and foreign message types: readable content is read, the rest is reported in
// a sentence.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <fstream>

#include "client_lib/recording/compression.h"
#include "client_lib/recording/mcap_format.h"
#include "client_lib/recording/mcap_reader.h"
#include "client_lib/recording/mcap_writer.h"
#include "client_lib/recording/sample.h"
#include "client_lib/recording/signals.h"
#include "tests/support/cdr_bytes.h"
#include "tests/support/temporary_directory.h"

namespace takt::recording {
namespace {

using mcap::Record;
using takt::test::CdrWriter;
using ::testing::HasSubstr;

template <typename Action>
std::string sentence_of(const Action& action) {
  try {
    action();
  } catch (const RecordingError& error) {
    return error.what();
  }
  return "no error";
}

TEST(ForeignTypes, Ros2TextIsReadAsOthersWriteIt) {
  MessageTypes types;
  types.add_ros2msg(
      "a/msg/T",
      "byte b\nchar c\r\n  int32 \t n  # how many\nfloat64 x 0.5\nint32 K = 5\nstring L=\"a=b\"\n"
      "Own own\nb/Far far\nb/msg/Long long_name\nx/action/Goal goal\nnothing\n\n"
      "string<=8[<=3] tags\n====\nMSG: a/Own\r\nuint8 v\n====\nMSG: b/Far\nuint8 v\n====\n"
      "MSG: b/Long\nuint8 v\n====\nMSG: x/action/Goal\nuint8[4] last");
  std::vector<std::string> found;
  for (const Field& field : types.at("a/msg/T").fields) found.push_back(field.name + " " + field.message);
  EXPECT_EQ(found, (std::vector<std::string>{"b ", "c ", "n ", "x ", "own a/msg/Own", "far b/msg/Far",
                                             "long_name b/msg/Long", "goal x/action/Goal", "tags "}));
  EXPECT_EQ(types.at("a/msg/T").fields[0].kind, Kind::uint8);
  EXPECT_EQ(types.at("a/msg/T").fields[1].kind, Kind::uint8);
  EXPECT_EQ(types.at("a/msg/T").fields[8].string_bound, 8U);
  EXPECT_EQ(types.at("x/action/Goal").fields.at(0).count, 4U);
  EXPECT_THAT(types.ros2msg("a/msg/T"), HasSubstr("MSG: x/action/Goal\nuint8[4] last\n"));
  for (const char* wrong : {"int32[x] n", "string<=y s", "x] n", "int32[99999999999999999999] n"})
    EXPECT_EQ(sentence_of([&] { types.add_ros2msg("a/msg/W", wrong); }),
              "The schema of 'a/msg/W' is not readable as ros2msg.")
        << wrong;
  EXPECT_EQ(sentence_of([&] { types.ros2msg("a/msg/None"); }),
            "The message type 'a/msg/None' is not described.");
  EXPECT_EQ(message_name("std_msgs::String_"), "");
  EXPECT_EQ(message_name("std_msgs::msg::dds_::String"), "");
  EXPECT_EQ(dds_type_name("String"), "");
}

TEST(ForeignSamples, SamplesOfEveryKindAreRead) {
  MessageTypes types;
  types.add_ros2msg(
      "a/msg/T",
      "int8 a\nuint16 b\nint64 c\nbool d\nuint32 e\nuint64 f\nfloat32 g\nint16[2] h\nuint8[] i\n"
      "string j\n");
  CdrWriter out;
  out.put(std::int8_t{-3});
  out.put(std::uint16_t{65535});
  out.put(std::int64_t{-5'000'000'000});
  out.put(std::uint8_t{1});
  out.put(std::uint32_t{4'000'000'000});
  out.put(std::uint64_t{18'000'000'000'000'000'000U});
  out.put(0.5F);
  out.put(std::int16_t{-1});
  out.put(std::int16_t{2});
  out.sequence(std::vector<std::uint8_t>{7, 8});
  out.put("end");
  EXPECT_EQ(to_json(types, "a/msg/T", out.bytes()).dump(),
            R"({"a":-3,"b":65535,"c":-5000000000,"d":true,"e":4000000000,"f":18000000000000000000,"g":0.5,)"
            R"("h":[-1,2],"i":[7,8],"j":"end"})");
  // Big endian, according to the first two bytes.
  types.add_ros2msg("a/msg/N", "uint16 n\n");
  EXPECT_EQ(to_json(types, "a/msg/N", std::string("\0\0\0\0\1\2", 6))["n"], 258);
  EXPECT_THAT(sentence_of([&] { to_json(types, "a/msg/N", std::string("\0\3\0\0\1\2", 6)); }),
              HasSubstr("an encoding other than plain CDR"));
  // A count that the sample cannot hold is no reason to make room for it.
  types.add_ros2msg("a/msg/L", "uint8[] n\n");
  EXPECT_THAT(sentence_of([&] { to_json(types, "a/msg/L", std::string("\0\1\0\0\xff\xff\xff\xff", 8)); }),
              HasSubstr("ends before its last member"));
}

TEST(ForeignSamples, SamplesOfARecursiveTypeAreRefused) {
  MessageTypes types;
  types.add_ros2msg("a/msg/T", "U u\nMSG: a/U\nT t\n");
  EXPECT_EQ(sentence_of([&] { to_json(types, "a/msg/T", std::string("\0\1\0\0", 4)); }),
            "The message type 'a/msg/T' holds itself.");
}

TEST(ForeignSignals, SignalsHaveTheNamesOfTheirDescription) {
  SignalNames names;
  std::vector<std::string> found;
  const auto visit = [&](const char* sample) {
    found.clear();
    names.visit(
        Json::parse(sample), [&](const std::string& name, double) { found.push_back(name); },
        [&](const std::string& name, const std::string& text) { found.push_back(name + ":" + text); });
    return found;
  };
  using Names = std::vector<std::string>;
  EXPECT_EQ(visit(R"({"components": [{"x": 1}], "on": true, "code": "late", "none": null})"),
            (Names{"components.0.x", "on", "code:late"}));
  names.describe(Json::parse(R"({"components": [{"name": "P", "vertices": [1]}, {"name": 5}],
    "robots": [{"name": "R", "joints": [{"name": 1}]}],
    "devices": [{"name": "Oven", "signals": [{"name": "heat"}, {"name": 7}]}], "count": 3})"));
  EXPECT_EQ(visit(R"({"devices": [{"values": [5, 6, 7]}]})"),
            (Names{"devices.Oven.values.heat", "devices.Oven.values.1", "devices.Oven.values.2"}));
  EXPECT_EQ(visit(R"({"components": [{"x": 1}, {"x": 2}, {"x": 3}], "count": [1, {"y": 2}]})"),
            (Names{"components.P.x", "components.1.x", "components.2.x", "count.0", "count.1.y"}));
  EXPECT_EQ(visit(R"({"robots": [{"position": [1, 2]}]})"),
            (Names{"robots.R.position.0", "robots.R.position.1"}));
  EXPECT_EQ(visit(R"({"contacts": [{"base": 0, "target": 1}, {"base": -1, "target": 0},
    {"base": 0, "target": 9}, {"base": "P", "area": 1}, {"target": "Q", "area": 2}]})"),
            (Names{"contacts.0.base", "contacts.0.target", "contacts.1.base", "contacts.1.target",
                   "contacts.2.base", "contacts.2.target", "contacts.3.base:P", "contacts.3.area",
                   "contacts.Q.target:Q", "contacts.Q.area"}));
  EXPECT_EQ(visit(R"({"corners": [1, 2], "pressures": [3], "area": 4})"), (Names{"area"}));
  EXPECT_EQ(visit(R"({"name": ["a", 2], "effort": [1, 2, 3]})"),
            (Names{"name.a:a", "name.1", "effort.a", "effort.1", "effort.2"}));
}

TEST(ForeignSignals, SignalsHaveTheTimeOfTheirSample) {
  EXPECT_EQ(sample_time_s(Json::parse(R"({"time": 1.5})")), 1.5);
  EXPECT_EQ(sample_time_s(Json::parse(R"({"stamp": {"sec": 2, "nanosec": 500000000}})")), 2.5);
  EXPECT_EQ(sample_time_s(Json::parse(R"({"time": "now", "header": {"stamp": {"sec": 3}}})")), 3.0);
  for (const char* none : {"[1]", "5", R"({"stamp": 5})", R"({"header": 5})", R"({"header": {}})",
                           R"({"stamp": {"sec": "late"}})", R"({"stamp": {"sec": 1, "nanosec": [1]}})"})
    EXPECT_FALSE(sample_time_s(Json::parse(none)).has_value()) << none;
  EXPECT_EQ(short_topic("/clock"), "clock");
  EXPECT_EQ(short_topic("clock"), "clock");
  EXPECT_EQ(short_topic("/cell/state"), "state");
}

/// An MCAP file by hand: one chunk with two messages on channel 1 and one on an unannounced channel.
struct Handmade {
  std::string schema = Record(mcap::kSchema)
                           .put(std::uint16_t{1})
                           .text("a/msg/N")
                           .text("ros2msg")
                           .text("uint16 n\nstring epoch\n")
                           .finished();
  std::string encoding = "cdr";
  std::uint16_t schema_number = 1;
  std::uint64_t chunk_size = 0, index_length = 0, index_place = 0;  ///< 0: as it is
  std::uint32_t chunk_crc = 0;
  bool index = true, statistics = true;
  std::uint32_t counted_chunks = 1;
  std::uint64_t summary_begin = 0;  ///< 0: as it is
  std::uint32_t summary_crc = 0;
  std::string behind_summary;

  std::string channel() const {
    return Record(mcap::kChannel)
        .put(std::uint16_t{1})
        .put(schema_number)
        .text("/cell/n")
        .text(encoding)
        .text("")
        .finished();
  }
  static std::string message(std::uint16_t channel, std::uint64_t time_ns) {
    CdrWriter sample;
    sample.put(static_cast<std::uint16_t>(time_ns));
    sample.put("x");
    return Record(mcap::kMessage)
        .put(channel)
        .put(std::uint32_t{1})
        .put(time_ns)
        .put(time_ns)
        .raw(sample.bytes())
        .finished();
  }
  std::string bytes() const {
    std::string file(mcap::kMagic);
    file += Record(mcap::kHeader).text("other").text("a test").finished();
    const std::uint64_t place = file.size();
    const std::string records = schema + channel() + message(1, 10) + message(1, 20) + message(2, 30);
    file += Record(mcap::kChunk)
                .put(std::uint64_t{10})
                .put(std::uint64_t{30})
                .put(chunk_size != 0 ? chunk_size : std::uint64_t{records.size()})
                .put(chunk_crc)
                .text("")
                .put(std::uint64_t{records.size()})
                .raw(records)
                .finished();
    const std::uint64_t length = file.size() - place;
    file += Record(mcap::kDataEnd).put(std::uint32_t{0}).finished();
    const std::uint64_t begin = file.size();
    file += schema + channel();
    if (statistics) {
      file += Record(mcap::kStatistics)
                  .put(std::uint64_t{3})
                  .put(std::uint16_t{1})
                  .put(std::uint32_t{1})
                  .put(std::uint32_t{0})
                  .put(std::uint32_t{0})
                  .put(counted_chunks)
                  .finished();
    }
    if (index) {
      file += Record(mcap::kChunkIndex)
                  .put(std::uint64_t{10})
                  .put(std::uint64_t{30})
                  .put(index_place != 0 ? index_place : place)
                  .put(index_length != 0 ? index_length : length)
                  .finished();
    }
    file += behind_summary;
    file += Record(mcap::kFooter)
                .put(summary_begin != 0 ? summary_begin : begin)
                .put(std::uint64_t{0})
                .put(summary_crc)
                .finished();
    return file + std::string(mcap::kMagic);
  }
};

class ForeignRecording : public testing::Test {
 protected:
  McapReader open(const std::string& bytes) {
    std::ofstream(file_, std::ios::binary) << bytes;
    return McapReader(file_);
  }
  static std::vector<std::uint64_t> times(McapReader& reader, std::uint64_t first = 0,
                                          std::uint64_t last = McapReader::kEver) {
    std::vector<std::uint64_t> found;
    reader.read(
        [&](const McapMessage& message) {
          found.push_back(message.log_time_ns);
          return true;
        },
        first, last);
    return found;
  }
  std::string refusal_to_open(const std::string& bytes) {
    return sentence_of([&] { open(bytes); });
  }

  const test::TemporaryDirectory directory_;
  const std::filesystem::path file_ = directory_ / "r.mcap";
};

using Times = std::vector<std::uint64_t>;

TEST_F(ForeignRecording, ARecordingIsReadWithAndWithoutItsSummary) {
  const Times all{10, 20};  // not those of the unannounced channel
  Handmade good;
  McapReader reader = open(good.bytes());
  EXPECT_EQ(reader.cut_off(), "");
  EXPECT_EQ(reader.profile(), "other");
  EXPECT_EQ(times(reader), all);
  EXPECT_EQ(times(reader, 11), Times{20});
  EXPECT_EQ(times(reader, 0, 19), Times{10});
  EXPECT_EQ(times(reader, 31), Times{});
  EXPECT_EQ(times(reader, 0, 9), Times{});
  EXPECT_EQ(times(reader, 11, 19), Times{});
  EXPECT_EQ(reader.channel("/cell/other"), nullptr);
  Handmade plain = good;
  plain.statistics = false;
  McapReader without_statistics = open(plain.bytes());
  EXPECT_EQ(without_statistics.cut_off(), "");
  EXPECT_EQ(times(without_statistics), all);
  plain.behind_summary = Record(mcap::kMetadata).raw("abc").finished();
  plain.behind_summary[1] = 100;  // longer than the file
  EXPECT_EQ(open(plain.bytes()).cut_off(), "");

  // Each of these summaries is useless; the data ahead of it are read.
  std::vector<Handmade> useless(6, good);
  useless[0].index = false;
  useless[1].counted_chunks = 2;
  useless[2].summary_begin = 1'000'000;
  useless[3].summary_crc = 1;
  useless[4].index = useless[4].statistics = false;
  useless[5].summary_begin = std::uint64_t{1} << 63U;
  for (const Handmade& file : useless) {
    McapReader scanned = open(file.bytes());
    EXPECT_THAT(scanned.cut_off(), HasSubstr("r.mcap' is not whole (its summary is not whole)"));
    EXPECT_EQ(scanned.profile(), "other");
    EXPECT_EQ(times(scanned), all);
  }
}

TEST_F(ForeignRecording, ADamagedRecordingIsRefusedOrReadUpToTheDamage) {
  EXPECT_THAT(sentence_of([&] { McapReader reader(directory_.path()); }), HasSubstr("cannot be read."));
  EXPECT_THAT(sentence_of([&] { McapReader reader(directory_ / "none"); }),
              HasSubstr("none' cannot be read."));
  EXPECT_THAT(refusal_to_open("\x89MCA"), HasSubstr("r.mcap' is no MCAP recording."));
  EXPECT_THAT(refusal_to_open("SQLite format 3"), HasSubstr("r.mcap' is no MCAP recording."));
  Handmade wrong;
  wrong.index_length = 5;
  EXPECT_THAT(refusal_to_open(wrong.bytes()), HasSubstr("r.mcap' has a damaged index of its chunks."));
  wrong = {};
  for (const std::uint64_t place : {std::uint64_t{100'000}, std::uint64_t{1} << 40U}) {
    wrong.index_place = place;
    McapReader elsewhere = open(wrong.bytes());
    EXPECT_THAT(sentence_of([&] { times(elsewhere); }),
                testing::AllOf(HasSubstr("r.mcap' names a place that is not in it; what was recorded from "),
                               testing::Not(HasSubstr("': '"))));
  }
  wrong = {};
  wrong.index_length = std::uint64_t{1} << 32U;
  McapReader too_long = open(wrong.bytes());
  EXPECT_THAT(sentence_of([&] { times(too_long); }), HasSubstr("names a place that is not in it; "));
  wrong = {};
  wrong.chunk_crc = 1;
  const auto damaged = HasSubstr("r.mcap': a chunk is damaged; what was recorded from ");
  McapReader altered = open(wrong.bytes());
  EXPECT_THAT(sentence_of([&] { times(altered); }), damaged);
  for (const std::uint64_t size : {std::uint64_t{7}, std::uint64_t{1} << 40U}) {
    wrong = {};
    wrong.chunk_size = size;
    McapReader other_size = open(wrong.bytes());
    EXPECT_THAT(sentence_of([&] { times(other_size); }), damaged);
    wrong.index = false;  // found by the scan of the file: none of its messages is delivered
    McapReader scanned = open(wrong.bytes());
    EXPECT_THAT(scanned.cut_off(),
                HasSubstr("(a chunk is damaged); read up to its last whole chunk, the 0."));
    EXPECT_EQ(times(scanned), Times{});
  }
  std::string short_schema = std::string(mcap::kMagic) + Record(mcap::kSchema).finished();
  EXPECT_THAT(refusal_to_open(short_schema), HasSubstr("r.mcap': A record ends before its last member."));
  // Not closed; schema and channel ahead of the chunks; a record of an impossible length.
  const Handmade good;
  std::string open_end(mcap::kMagic);
  open_end += good.schema + good.channel();
  McapReader announced = open(open_end);
  EXPECT_THAT(announced.cut_off(), HasSubstr("(the file was not closed)"));
  ASSERT_NE(announced.channel("/cell/n"), nullptr);
  EXPECT_EQ(announced.channel("/cell/n")->type, "a/msg/N");
  std::string endless = Record(mcap::kMetadata).finished();
  endless[8] = '\x7f';
  EXPECT_THAT(open(open_end + endless).cut_off(), HasSubstr("(the file ends within a record)"));
}

TEST_F(ForeignRecording, SignalsOfKnownTypesAreRead) {
  const auto names = [&](const Handmade& file) {
    McapReader reader = open(file.bytes());
    return signal_names(reader, {"n.*"});
  };
  Handmade file;
  // Its member `epoch` is a text, not takt's count of resets.
  EXPECT_EQ(names(file), std::vector<std::string>{"n.n"});
  file.encoding = "json";
  EXPECT_EQ(names(file), std::vector<std::string>{});
  file = {};
  file.schema_number = 7;
  EXPECT_EQ(names(file), std::vector<std::string>{});
  EXPECT_EQ(open(file.bytes()).channel("/cell/n")->type, "");
  file = {};
  file.schema = Record(mcap::kSchema).put(std::uint16_t{1}).text("a.N").text("protobuf").text("").finished();
  EXPECT_EQ(names(file), std::vector<std::string>{});
  EXPECT_EQ(open(file.bytes()).channel("/cell/n")->schema_encoding, "protobuf");
  McapReader reader = open(Handmade{}.bytes());
  EXPECT_TRUE(signal_names(reader, {"n.m"}).empty());
}

TEST(OwnRecording, ARecordingIsCompleteWithoutMessagesAndWithoutClose) {
  const test::TemporaryDirectory directory;
  const auto empty = directory / "empty.mcap", left = directory / "left.mcap";
  {
    McapWriter writer(empty, "a test");
    writer.add_channel("/clock", known_types(), "rosgraph_msgs/msg/Clock", {});
    writer.close();
    writer.close();
  }
  McapReader none(empty);
  EXPECT_EQ(none.cut_off(), "");
  EXPECT_EQ(none.chunk_count(), 0U);
  ASSERT_NE(none.channel("/clock"), nullptr);
  {
    McapWriter writer(left, "a test", Compression::none);
    const auto channel = writer.add_channel("/clock", known_types(), "rosgraph_msgs/msg/Clock", {});
    writer.flush();
    CdrWriter time;
    time.put(std::int32_t{1});
    time.put(std::uint32_t{2});
    writer.write(channel, 5, 5, time.bytes());
  }
  McapReader one(left);
  EXPECT_EQ(one.cut_off(), "");
  EXPECT_EQ(one.chunk_count(), 1U);
  { McapWriter writer(left, "nothing", Compression::lz4); }
  EXPECT_TRUE(McapReader(left).channels().empty());
  EXPECT_THAT(sentence_of([&] { McapWriter writer(directory / "no/such/r.mcap", "a test"); }),
              HasSubstr("no/such/r.mcap' cannot be written: No such file or directory."));
  EXPECT_EQ(sentence_of([] { McapWriter writer("/dev/full", "a test"); }),
            "The recording '/dev/full' cannot be written.");
}

TEST(OwnRecording, CompressionsHaveNamesAndRefuseOtherSizes) {
  EXPECT_EQ(compression_named("none"), Compression::none);
  EXPECT_EQ(compression_named("lz4"), Compression::lz4);
  EXPECT_EQ(compression_named("zstd"), Compression::zstd);
  EXPECT_FALSE(compression_named("brotli").has_value());
  std::string packed;
  compress(Compression::zstd, "abc", packed);
  EXPECT_EQ(decompress("zstd", packed, 3), "abc");
  EXPECT_THROW(decompress("zstd", packed, 4), RecordingError);
  EXPECT_THROW(decompress("zstd", packed, 2), RecordingError);
  EXPECT_THROW(decompress("zstd", "abc", 3), RecordingError);
  EXPECT_THROW(decompress("", "abc", 4), RecordingError);
  EXPECT_EQ(decompress("", "abc", 3), "abc");
}

}  // namespace
}  // namespace takt::recording
