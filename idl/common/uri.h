#pragma once
// Names of files in robot descriptions are addresses: a blank in them is %20.
#include <string>
#include <string_view>

namespace takt {

/// The text with the characters that %XX stands for.
std::string without_escapes(std::string_view text);

}  // namespace takt
