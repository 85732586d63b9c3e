// Messages as samples and back: every struct of the IDL, both byte orders, and the limits of samples.
#include "idl/common/cdr.h"

#include <gtest/gtest.h>

#include <bit>
#include <random>

#include "foxglove_msgs.h"
#include "ros2_action_msgs.h"
#include "ros2_service_msgs.h"
#include "takt_msgs.h"
#include "tests/support/random_message.h"

namespace takt {
namespace {

using Bytes = std::vector<std::uint8_t>;

template <Message Type>
Bytes written(const Type& message) {
  Bytes bytes(cdr::size(message));
  EXPECT_EQ(cdr::write(message, bytes), bytes.size());
  return bytes;
}

template <typename... Types>
void expect_round_trips(MessageList<Types...>) {
  const auto round_trip = [](auto message) {
    using Type = decltype(message);
    for (unsigned seed = 0; seed < 20; ++seed) {
      const Type sent = test::RandomMessage(seed).make<Type>();
      const Bytes bytes = written(sent);
      Type received;
      ASSERT_TRUE(cdr::read(bytes, received)) << message_info<Type>().name;
      EXPECT_TRUE(received == sent) << message_info<Type>().name;
      // Each sample that ends earlier is refused: every byte of it is needed.
      Bytes cut = bytes;
      while (!cut.empty()) {
        cut.pop_back();
        EXPECT_FALSE(cdr::read(cut, received)) << message_info<Type>().name << " of " << cut.size();
      }
      Bytes small(bytes.size() - 1);
      EXPECT_EQ(cdr::write(sent, small), 0U);
    }
  };
  (round_trip(Types{}), ...);
}

TEST(Cdr, EveryMessageComesBackAsItWas) {
  expect_round_trips(TaktMsgs{});
  expect_round_trips(Ros2Msgs{});
  expect_round_trips(Ros2ServiceMsgs{});
  expect_round_trips(Ros2ActionMsgs{});
  expect_round_trips(FoxgloveMsgs{});
}

template <typename... Types>
void expect_nothing_left_of_earlier_ones(MessageList<Types...>) {
  const auto read_one_after_the_other = [](auto received) {
    using Type = decltype(received);
    for (unsigned seed = 0; seed < 20; ++seed) {
      const Type sent = test::RandomMessage(seed).make<Type>();
      Bytes bytes = written(sent);
      ASSERT_TRUE(cdr::read(bytes, received));
      EXPECT_TRUE(received == sent) << message_info<Type>().name << " behind another one";
      bytes.resize(bytes.size() / 2);
      (void)cdr::read(bytes, received);  // refused: partly filled
    }
  };
  (read_one_after_the_other(Types{}), ...);
}

TEST(Cdr, AMessageIsReadOverAnEarlierOne) {
  expect_nothing_left_of_earlier_ones(TaktMsgs{});
  expect_nothing_left_of_earlier_ones(Ros2Msgs{});
}

/// Plain XCDR1 in either byte order, written number by number.
class ByHand {
 public:
  explicit ByHand(bool big) : big_(big), bytes_{0, static_cast<std::uint8_t>(big ? 0 : 1), 0, 0} {}
  ByHand& number(std::uint64_t value, std::size_t size) {
    while ((bytes_.size() - 4) % size != 0) bytes_.push_back(0);
    for (std::size_t i = 0; i < size; ++i)
      bytes_.push_back(static_cast<std::uint8_t>(value >> 8 * (big_ ? size - 1 - i : i)));
    return *this;
  }
  ByHand& text(const std::string& value) {
    number(value.size() + 1, 4);
    bytes_.insert(bytes_.end(), value.begin(), value.end());
    bytes_.push_back(0);
    return *this;
  }
  Bytes& all() { return bytes_; }

 private:
  bool big_;
  Bytes bytes_;
};

/// Two points with one position, no velocities, two accelerations.
ByHand trajectory(bool big, std::uint64_t claimed_points) {
  ByHand bytes(big);
  bytes.number(3, 4).number(5, 4).text("frame").number(2, 4).text("a").text("joint").number(claimed_points,
                                                                                            4);
  for (int i = 0; i < 2; ++i)
    bytes.number(1, 4)
        .number(7, 8)
        .number(0, 4)
        .number(2, 4)
        .number(1, 8)
        .number(2, 8)
        .number(0, 4)
        .number(1, 4)
        .number(2, 4);
  return bytes;
}

TEST(Cdr, BothByteOrdersAreReadAndClaimsAreNeverLargerThanTheSample) {
  for (const bool big : {false, true}) {
    trajectory_msgs::msg::JointTrajectory read;
    ByHand good = trajectory(big, 2);
    ASSERT_TRUE(cdr::read(good.all(), read));
    EXPECT_EQ(read.header, (std_msgs::msg::Header{{3, 5}, "frame"}));
    EXPECT_EQ(read.joint_names, (std::vector<std::string>{"a", "joint"}));
    ASSERT_EQ(read.points.size(), 2U);
    EXPECT_EQ(read.points[1].accelerations.size(), 2U);
    EXPECT_EQ(read.points[1].time_from_start, (builtin_interfaces::msg::Duration{1, 2}));
    if (!big) {
      EXPECT_EQ(written(read), good.all());
    }
    good.all().push_back(0);  // bytes behind the last field are ignored
    EXPECT_TRUE(cdr::read(good.all(), read));
    for (const std::uint64_t claimed : {3U, 100'000'000U, 0xFFFFFFFFU}) {
      trajectory_msgs::msg::JointTrajectory refused;
      EXPECT_FALSE(cdr::read(trajectory(big, claimed).all(), refused));
      EXPECT_LT(refused.points.capacity(), 10U);
    }
  }
}

/// Elements of numbers alone are written and read in one piece.
TEST(Cdr, ElementsOfNumbersAloneAreLaidOutNumberByNumber) {
  for (const bool big : {false, true}) {
    ByHand bytes(big);
    bytes.number(3, 4).number(5, 4).number(0, 8).number(11, 8).number(2, 4).number(9, 4).number(77, 8);
    bytes.number(2, 4);  // components
    for (unsigned i = 0; i < 2; ++i) {
      for (unsigned k = 0; k < 19; ++k) bytes.number(std::bit_cast<std::uint64_t>(100.0 * i + k), 8);
      bytes.number(i, 1).number(40 + i, 4);
    }
    for (int list = 0; list < 4; ++list) bytes.number(0, 4);  // robots, grippers, devices, applied commands
    takt_msgs::msg::CellState read;
    ASSERT_TRUE(cdr::read(bytes.all(), read));
    ASSERT_EQ(read.components.size(), 2U);
    EXPECT_EQ(read.components[1].position.x, 100.0);
    EXPECT_EQ(read.components[1].orientation.w, 106.0);
    EXPECT_EQ(read.components[1].torque.z, 118.0);
    EXPECT_EQ(static_cast<int>(read.components[1].state), 1);
    EXPECT_EQ(read.components[1].partner, 41);
    EXPECT_EQ(read.components[0].partner, 40);
    if (!big) {
      EXPECT_EQ(written(read), bytes.all());
    }
    bytes.all()[4 + 8 + 8 + 8 + 8 + 8 + (big ? 3 : 0)] = 3;  // one more than there are
    EXPECT_FALSE(cdr::read(bytes.all(), read));
  }
}

TEST(Cdr, DamagedSamplesAreReadOrRefusedWithinTheirBytes) {
  std::mt19937 dice(7);
  for (int round = 0; round < 20'000; ++round) {
    Bytes bytes = trajectory(dice() % 2 == 0, dice() % 4).all();
    for (unsigned i = 0; i < 1 + dice() % 4; ++i)
      bytes[dice() % bytes.size()] = static_cast<std::uint8_t>(dice());
    trajectory_msgs::msg::JointTrajectory read;
    (void)cdr::read(bytes, read);  // under the sanitizers
    EXPECT_LE(read.points.capacity(), bytes.size());
  }
}

TEST(Cdr, BoundsOfTheIdlHoldInBothDirections) {
  takt_msgs::msg::ControlRequest request, read;
  Bytes room(10'000);
  request.arguments.resize(64);
  Bytes bytes = written(request);
  ASSERT_TRUE(cdr::read(bytes, read));
  request.arguments.resize(65);
  EXPECT_EQ(cdr::write(request, room), 0U);
  for (const std::uint64_t count : {64U, 65U}) {
    ByHand many(false);
    many.text("").number(0, 8).text("").number(count, 4);
    for (std::uint64_t i = 0; i < count; ++i)
      many.text("").number(0, 1).number(0, 1).number(0, 8).number(0, 8).text("").number(0, 4).number(0, 4);
    EXPECT_EQ(cdr::read(many.all(), read), count == 64) << count;
  }

  request.arguments.clear();
  request.request = std::string(64, 'x');
  ASSERT_TRUE(cdr::read(written(request), read));
  EXPECT_FALSE(
      cdr::read(ByHand(false).text("").number(0, 8).text(std::string(65, 'x')).number(0, 4).all(), read));
  request.request += 'x';
  EXPECT_EQ(cdr::write(request, room), 0U);
}

TEST(Cdr, BooleansStringsAndTheEncodingAreChecked) {
  takt_msgs::msg::SignalDescription signal;
  Bytes bytes = written(signal);
  const std::size_t commanded = 4 + 8 + 5;
  bytes[commanded] = 1;
  ASSERT_TRUE(cdr::read(bytes, signal));
  EXPECT_TRUE(signal.commanded);
  bytes[commanded] = 2;
  EXPECT_FALSE(cdr::read(bytes, signal));

  std_msgs::msg::String text;
  EXPECT_TRUE(cdr::read(Bytes{0, 1, 0, 0, 2, 0, 0, 0, 'a', 0}, text));
  EXPECT_EQ(text.data, "a");
  EXPECT_FALSE(cdr::read(Bytes{0, 1, 0, 0, 2, 0, 0, 0, 'a', 'b'}, text)) << "no final zero";
  EXPECT_TRUE(cdr::read(Bytes{0, 1, 0, 0, 0, 0, 0, 0}, text)) << "an empty string of some peers";
  EXPECT_EQ(text.data, "");
  EXPECT_FALSE(cdr::read(Bytes{0, 3, 0, 0, 1, 0, 0, 0, 0}, text)) << "a parameter list";
  EXPECT_FALSE(cdr::read(Bytes{0, 7, 0, 0, 1, 0, 0, 0, 0}, text)) << "XCDR2";
}

TEST(Cdr, ANumberWithoutNameStaysAsItArrived) {
  takt_msgs::msg::GripperCommand command;
  command.action = static_cast<GripperAction>(200);
  takt_msgs::msg::GripperCommand read;
  ASSERT_TRUE(cdr::read(written(command), read));
  EXPECT_EQ(read.action, command.action);
  EXPECT_FALSE(is_known(read.action));
  EXPECT_EQ(to_string(read.action), "unknown");
  EXPECT_EQ(to_string(GripperAction::width), "width");
  EXPECT_EQ(enumerator_of<GripperAction>("close"), GripperAction::close);
  EXPECT_FALSE(enumerator_of<GripperAction>("clos").has_value());
  EXPECT_EQ(enumerator_names<Pace>(), "realtime, free, lockstep");
}

TEST(MessageTables, SayUnitFrameAndMeaning) {
  const FieldInfo& force = field_info<takt_msgs::msg::Contact>("force");
  EXPECT_EQ(force.unit, "N");
  EXPECT_EQ(force.frame, "W");
  EXPECT_EQ(force.doc, "on the component");
  EXPECT_EQ(force.message->name, "takt_msgs/msg/Vector3");
  EXPECT_EQ(message_info<takt_msgs::msg::CellState>().dds_type, "takt_msgs::msg::dds_::CellState_");
  EXPECT_EQ(annotation(field_info<takt_msgs::msg::Contact>("base").annotations, "index"), "components");
  EXPECT_EQ(field_info<takt_msgs::msg::Status>("state").enumeration->name, "SimulationState");
  // A comment that continues in the next line belongs to the same field.
  EXPECT_EQ(field_info<takt_msgs::msg::PowerConsumer>("mechanical_power").doc,
            "of each drive on its joint: the arm's joints, then left and right jaw of each gripper; empty "
            "for devices, "
            "whose other mechanical values are 0");
}

}  // namespace
}  // namespace takt
