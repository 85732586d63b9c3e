#pragma once
// Message types as data. They come from field tables (idl/common/message.h) or `ros2msg` text, are written as `ros2msg`
// text, and decode samples (CDR) of any type. Recordings and live streams contain their types: a file is read by its
// own types, not by those of this build.
#include <cstddef>
#include <map>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "idl/common/message.h"

namespace takt::recording {

/// A fault of a file, a schema or a sample, as a whole sentence.
class RecordingError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

using Kind = FieldKind;

struct Field {
  std::string name;
  Kind kind = Kind::message;
  std::string message;           ///< Kind::message: its type, as pkg/msg/Name
  std::size_t string_bound = 0;  ///< Kind::string: longest allowed, 0: any
  bool sequence = false;         ///< any number of them, counted in the sample
  std::size_t count = 0;         ///< sequence: most allowed, 0: any; else length of an array, 0: a single one
};

struct MessageType {
  std::string name;  ///< pkg/msg/Name
  std::vector<Field> fields;
};

class MessageTypes {
 public:
  /// Adds a message of idl/*.idl and the messages that it contains.
  void add(const MessageInfo& message);
  /// Adds a type and the types that it contains from `ros2msg` text. Throws RecordingError.
  void add_ros2msg(const std::string& name, std::string_view text);

  /// nullptr for an unknown type.
  const MessageType* find(const std::string& name) const;
  /// Throws RecordingError for an unknown type.
  const MessageType& at(const std::string& name) const;
  /// Text of the type, followed by the texts of the types that it contains. Throws RecordingError.
  std::string ros2msg(const std::string& name) const;

 private:
  std::map<std::string, MessageType> types_;
};

/// takt's own types and the standard ones it speaks (takt_msgs.idl, ros2_msgs.idl, states of goals of
/// ros2_action_msgs.idl); made on first use.
const MessageTypes& known_types();

/// takt_msgs/msg/CellState of takt_msgs::msg::dds_::CellState_, and back; empty for an invalid name.
std::string message_name(std::string_view dds_type);
std::string dds_type_name(std::string_view message);

}  // namespace takt::recording
