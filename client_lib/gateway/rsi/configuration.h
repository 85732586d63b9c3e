#pragma once
// The Ethernet configuration of KUKA's RobotSensorInterface: the XML file of the ETHERNET object, which lists the
// elements of both messages. takt reads the file that the robot controller has.
//
//   <ROOT>
//     <CONFIG> <IP_NUMBER/> <PORT/> <SENTYPE/> <ONLYSEND/> </CONFIG>
//     <SEND><ELEMENTS> <ELEMENT TAG TYPE INDX/> ... </ELEMENTS></SEND>               controller to sensor PC
//     <RECEIVE><ELEMENTS> <ELEMENT TAG TYPE INDX HOLDON/> ... </ELEMENTS></RECEIVE>  sensor PC to controller
//   </ROOT>
//
// Sources: kroshu/kuka-external-control-sdk and kroshu/kuka_drivers (GitHub).
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace takt::gateway::rsi {

/// The sentence has file, line, key, value, and the values allowed.
class ConfigurationError : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

enum class ValueType { boolean, text, integer, real };

/// What the controller fills in itself (INDX="INTERNAL").
enum class Internal {
  none,  ///< a channel of an RSI object
  actual_pose,
  planned_pose,
  actual_axes,
  planned_axes,
  actual_external_axes,
  planned_external_axes,
  axis_currents,
  external_axis_currents,
  delay,
  technology,  ///< ten parameters of a function generator
  message,     ///< DEF_EStr, of the sensor PC
};

/// One ELEMENT. A tag without a point is an element with a text, "GPIO.01" the attribute 01 of the element GPIO.
struct Channel {
  std::string tag;
  std::string element;
  std::string attribute;  ///< empty: the text of the element
  ValueType type = ValueType::real;
  Internal internal = Internal::none;
  int index = 0;      ///< INDX, 1 to 64; 0 for internal ones
  bool hold = false;  ///< HOLDON: the last value stays while packets are missing; false: 0
};

struct Configuration {
  std::string address;  ///< IP_NUMBER, of the sensor PC
  int port = 49152;
  std::string sentype = "ImFree";  ///< SENTYPE: attribute Type of the answers
  bool only_send = false;          ///< ONLYSEND: the controller expects no answer
  std::vector<Channel> send, receive;

  /// Place of a tag in one of the lists, or -1.
  static int find(const std::vector<Channel>& channels, std::string_view tag);
};

/// Reads the text of a configuration; `file` is its name in errors. Throws ConfigurationError.
Configuration parse_configuration(const std::string& text, const std::string& file);

}  // namespace takt::gateway::rsi
