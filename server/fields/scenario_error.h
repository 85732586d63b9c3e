#pragma once
// Errors of scenarios. Each names file, line, column, key, the value found and the values allowed.
#include <stdexcept>

namespace takt {

class ScenarioError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A scenario names a file that does not exist.
class MissingFileError : public ScenarioError {
 public:
  using ScenarioError::ScenarioError;
};

}  // namespace takt
