#pragma once
#include <string>
#include <string_view>

namespace takt {

/// The text as character data of an element: & < > are references, characters that XML does not have are spaces.
std::string xml_content(std::string_view text);
/// The same with " as a reference too: also for attributes in double quotes, in XML and HTML.
std::string xml_escaped(std::string_view text);

}  // namespace takt
