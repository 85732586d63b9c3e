#pragma once
#include <string>
#include <string_view>

namespace takt {

/// The text as character data of an XML element: & < > are references.
std::string xml_content(std::string_view text);

}  // namespace takt
