#pragma once
// Samples read by their description: as JSON, and as signals, which are numbers with a name.
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "client_lib/recording/message_types.h"

namespace takt::recording {

using Json = nlohmann::ordered_json;

/// Throws RecordingError for a sample that is not of that type.
Json to_json(const MessageTypes& types, const std::string& type, std::string_view sample);

/// Names for the numbers in samples: elements of lists are called by their name, where they have one or the
/// description of the cell gives them one, else by their number from 0.
class SignalNames {
 public:
  /// From here on, lists are named after this takt_msgs/msg/CellDescription.
  void describe(const Json& description);

  using Number = std::function<void(const std::string& name, double value)>;
  using Text = std::function<void(const std::string& name, const std::string& value)>;
  /// Calls `number` for each number (and truth value) of a sample, `text` for each text. A name is the way to
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
