#pragma once
// Requests and responses as named typed values, as they are transmitted (takt_msgs::msg::Argument), and back.
// The field table of a request (idl/takt_requests.idl) defines the values allowed of an argument; an error is
// a sentence with the argument, the value found, the values allowed, and the nearest valid name.
//
//   field                             value
//   boolean                           boolean
//   whole number                      integer; 2^63 - 1 for more than that
//   double                            number (an integer is taken too)
//   string                            text
//   enumeration                       text, the name (its number as an integer is taken too)
//   Vector3, Quaternion               numbers: x y z, x y z w
//   sequence of numbers, of strings   numbers, texts
//   other message, sequence of them   document: JSON; enumerations by name, vectors as arrays, values without
//   content as
//                                     null
//   an @optional field without value  is omitted
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "idl/vocabulary/request.h"
#include "takt_msgs.h"
#include "takt_request_table.h"

namespace takt {

using Value = takt_msgs::msg::Value;
using Arguments = std::vector<takt_msgs::msg::Argument>;

struct ArgumentFault {
  ControlResult result = ControlResult::failed;
  std::string sentence;
};

/// The existing names of a kind (@names): component, target, process.
using KnownNames = std::function<std::vector<std::string>(std::string_view kind)>;

// For each request and each response:

template <typename Message>
Arguments arguments_of(const Message& message);

/// Reads the arguments of the request or the values of the reply called `name`. std::nullopt on success.
/// `known`: checks the @names of a request. In a reply, unknown values are ignored, and missing ones keep
/// their defaults, so that programs of different versions work together.
template <typename Message>
std::optional<ArgumentFault> read_arguments(std::string_view name, const Arguments& arguments,
                                            Message& message, const KnownNames& known = {});

/// The row of a name, or nullptr.
const RequestInfo* find_request(std::string_view name);
/// "This server has no request 'x'; it has a, b, c. Did you mean 'y'?"
std::string unknown_request(std::string_view name);

/// A request of any kind by its name.
std::optional<ArgumentFault> read_request(std::string_view name, const Arguments& arguments,
                                          requests::Any& request, const KnownNames& known = {});

/// Arguments as typed by a user: numbers, true and false, numbers separated by spaces or commas, texts
/// separated by commas outside of brackets. A word that is not readable as the request's type stays a text,
/// which the server refuses.
Arguments arguments_of_text(std::string_view request,
                            const std::vector<std::pair<std::string, std::string>>& texts);

/// For people: "0.5", "true", "1 0 0".
std::string text_of(const Value& value);

/// The values allowed of an argument: "a whole number from 1 to 3".
std::string allowed_of(const FieldInfo& field);

}  // namespace takt
