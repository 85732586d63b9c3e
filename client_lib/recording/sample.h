#pragma once
// Samples decoded by their types: as JSON, and as signals. A signal is a number with a name.
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "client_lib/recording/message_types.h"
#include "idl/common/named_lists.h"

namespace takt::recording {

using Json = nlohmann::ordered_json;

/// Throws RecordingError for a sample of another type.
Json to_json(const MessageTypes& types, const std::string& type, std::string_view sample);

/// Samples of a recording as JSON. If the file describes a type of idl/takt_msgs.idl as this build does, its samples have
/// the names of message_json.h, by the newest description. Without a fitting description they have numbers and lists.
class JsonSamples {
 public:
  /// `types`: of the file; they outlive this.
  explicit JsonSamples(const MessageTypes& types) : types_(types) {}
  /// Throws RecordingError for a sample of another type.
  Json read(const std::string& type, std::string_view sample);

 private:
  const MessageTypes& types_;
  std::map<std::string, bool> is_ours_;  ///< by type
  Named names_;
};

/// Names for the numbers in samples. An element of a list has its own name or its name in the description of the cell;
/// without a name it has its number, from 0.
class SignalNames {
 public:
  /// Sets the takt_msgs/msg/CellDescription whose names the lists of later samples have.
  void describe(const Json& description);

  using Number = std::function<void(const std::string& name, double value)>;
  using Text = std::function<void(const std::string& name, const std::string& value)>;
  /// Calls `number` for each number (and truth value) of a sample, `text` for each text. A name is the path to
  /// the member, e.g. components.P.position.x, robots.Robot1.effort.elbow_joint, contacts.P-C.normal_force.
  void visit(const Json& sample, const Number& number, const Text& text = {}) const;

 private:
  struct Place;
  void walk(const Json& value, const std::string& name, const Place& place, const Number& number,
            const Text& text) const;
  std::string element_name(const Json& element, std::size_t index, const Place& place) const;

  Json description_;
};

}  // namespace takt::recording
