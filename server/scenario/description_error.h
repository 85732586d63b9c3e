#pragma once
// The error of files that describe robots and worlds: URDF and SDFormat.
#include <filesystem>
#include <stdexcept>
#include <string>

namespace takt {

/// what() has the file, the line, the element, the value found and the values allowed.
class DescriptionError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// "FILE: line LINE: ", where line 0 stands for the whole file.
std::string place_in(const std::filesystem::path& file, int line);

}  // namespace takt
