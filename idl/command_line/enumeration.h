#pragma once
// Words of an enumeration of the IDL on the command lines of all programs, e.g. for CLI::IsMember.
#include <string>
#include <vector>

#include "idl/common/enumeration.h"

namespace takt::command_line {

/// All names, in the order of the IDL.
template <TabledEnumeration Enumeration>
std::vector<std::string> words_of() {
  std::vector<std::string> words;
  for (const EnumeratorInfo& one : kEnumeration<Enumeration>.enumerators) words.emplace_back(one.name);
  return words;
}

}  // namespace takt::command_line
