#pragma once
// Message types as data: read from our IDL or from `ros2msg` text, written as `ros2msg` text, and used to
// read samples (CDR) without generated code. So recordings and live streams describe themselves, and what is
// read of a file is what the file says, not what this build knows.
#include <cstddef>
#include <map>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace takt::recording {

/// What is wrong with a file, a schema or a sample; a whole sentence.
class RecordingError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

enum class Kind {
  boolean,
  int8,
  uint8,
  int16,
  uint16,
  int32,
  uint32,
  int64,
  uint64,
  float32,
  float64,
  string,
  message,
};

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
  /// Adds the structs of an IDL text of the form used in idl/: modules, @final structs, sequences, strings,
  /// comments; #include lines are passed over. Throws RecordingError with the line.
  void add_idl(std::string_view text);
  /// Adds a type and what it is made of from `ros2msg` text. Throws RecordingError.
  void add_ros2msg(const std::string& name, std::string_view text);

  /// nullptr where there is none.
  const MessageType* find(const std::string& name) const;
  /// Throws RecordingError where there is none.
  const MessageType& at(const std::string& name) const;
  /// Text of the type, followed by that of each type it is made of. Throws RecordingError.
  std::string ros2msg(const std::string& name) const;

 private:
  std::map<std::string, MessageType> types_;
};

/// takt's own types and the standard ones it speaks, from idl/; made on first use.
const MessageTypes& known_types();

/// takt_msgs/msg/CellState of takt_msgs::msg::dds_::CellState_, and back; empty where it is no such name.
std::string message_name(std::string_view dds_type);
std::string dds_type_name(std::string_view message);

}  // namespace takt::recording
