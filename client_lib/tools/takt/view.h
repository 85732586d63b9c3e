#pragma once
// takt view: a running cell or a recording in the browser.
#include <cstdint>
#include <string>
#include <vector>

#include "client_lib/tools/takt/commands.h"

namespace takt::tool {

struct ViewOptions {
  std::string file;  ///< recording; empty: the running cell
  std::string address = "127.0.0.1";
  std::uint16_t port = 8765;
  bool observer = false;
  std::vector<std::string> files;  ///< folders of mesh files of robots
  std::string page;                ///< directory of the built page; empty: where takt was installed or built
};
int view(const Common& common, const ViewOptions& options);

void declare_view(CLI::App& app, const Common& common, int& result);

}  // namespace takt::tool
