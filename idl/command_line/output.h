#pragma once
// Standard output of a program at its end.
#include <string>

namespace takt::command_line {

/// Flushes standard output. Returns `code`; if output was lost, as on a full disk, reports it on standard
/// error and returns 1 in place of 0. A pipe closed by its reader is no loss.
int with_output_written(const std::string& program, int code);

}  // namespace takt::command_line
