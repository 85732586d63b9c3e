#pragma once
// The table's description of one key, as plain data. The JSON Schema for editors and the reference page are
// made from it.
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

namespace takt {

struct KeyInfo {
  enum class Kind : std::uint8_t { number, whole, flag, text, file, choice, list, section };

  Kind kind = Kind::section;
  std::string key{};  ///< "*": every name that the user chooses
  std::string doc{};
  std::string unit{};
  double lower = -std::numeric_limits<double>::infinity(), upper = std::numeric_limits<double>::infinity();
  bool lower_open = false;
  std::vector<std::string> choices{};
  std::size_t min_items = 0, max_items = 0;  ///< of a list; max_items 0: any number
  std::vector<KeyInfo> items{};              ///< fields of a section; the one element of a list
  std::vector<KeyInfo> other_forms{};        ///< alternative forms of the value
  std::string shared{};                      ///< name of a section that appears in several places
  std::string default_text{};                ///< as in a file; empty: without one
  bool required = false;
  bool scenario_names = false;  ///< the names that the user chooses are names of topics (scenario_names.h)
  bool in_model = true;         ///< the value enters the model hash
  /// The key is allowed where the key `when.key` has one of these words; `absent`: also without that key.
  struct Condition {
    std::string key{};
    std::vector<std::string> words{};
    bool absent = false;
  };
  Condition when{};
  std::string required_key{};  ///< required where that key has one of these words
  std::vector<std::string> required_for{};
  /// Of a section: at least and at most this many of these keys are given.
  struct Alternatives {
    std::vector<std::string> keys;
    std::size_t least = 0, most = 1;
    Condition when{};
  };
  std::vector<Alternatives> alternatives{};
  std::vector<std::vector<std::string>> together{};  ///< groups of keys of which all or none are given
};

}  // namespace takt
