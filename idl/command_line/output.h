#pragma once
// Standard output of a program at its end.
#include <string>

namespace takt::command_line {

/// Flushes standard output. Returns `code`; where something that was written is lost, as on a full disk,
/// tells that on standard error and returns 1 in place of 0. A reader that has closed its pipe has seen
/// enough: nothing is lost.
int with_output_written(const std::string& program, int code);

}  // namespace takt::command_line
