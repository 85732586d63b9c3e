#pragma once
// Numbers in texts that people write, the same in every locale.
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace takt {

/// Empty if the text is anything else than one finite number.
std::optional<double> finite_number(std::string_view text);
/// The finite numbers between these separators: {1, 2, 5} of "1:2:5" and "::". Empty for any other text.
std::optional<std::vector<double>> separated_numbers(std::string_view text, std::string_view separators);
/// "NAME=NUMBER". Empty for any other text.
std::optional<std::pair<std::string, double>> named_number(std::string_view text);

}  // namespace takt
