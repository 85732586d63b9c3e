#pragma once
// What the text of a STEP file (ISO 10303-21) contains that OpenCASCADE passes over.
#include <string>
#include <string_view>
#include <vector>

namespace takt::cad {

/// Signs of a damaged file, one sentence each: entities that are missing, incomplete, or used by none.
std::vector<std::string> damage_of_step_text(std::string_view text);

/// Says that solids and shells are given as triangles alone (AP242: TESSELLATED_SOLID, TESSELLATED_SHELL without a link to
/// exact faces), which OpenCASCADE 7.6 does not read. Empty: there are none.
std::string unread_tessellation(std::string_view text);

/// The text with doubled apostrophes within strings written \X\27, which means the same: OpenCASCADE 7.6 ends a string
/// at an apostrophe that a comma or `)` follows, and loses the entity. Empty: there are none, or a string has no end.
std::string with_encoded_apostrophes(std::string_view text);

}  // namespace takt::cad
