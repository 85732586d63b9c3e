#pragma once
// The IDL files of idl/ as text; made at build time (idl_texts.cpp.in).
#include <string_view>
#include <vector>

namespace takt::recording {
std::vector<std::string_view> idl_texts();
}
