#include <CLI/CLI.hpp>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <functional>

#include "client_lib/tools/takt/commands.h"
#include "client_lib/view/addresses.h"
#include "client_lib/view/file_source.h"
#include "client_lib/view/live_source.h"
#include "client_lib/view/metrics.h"
#include "client_lib/view/scene_channel.h"
#include "client_lib/view/web_server.h"
#include "idl/command_line/numbers.h"
#include "idl/command_line/package_folders.h"

namespace takt::tool {
namespace {

struct ViewOptions {
  std::string file;  ///< recording; empty: the running cell
  std::string address = "127.0.0.1";
  std::uint16_t port = 8765;
  bool observer = false;
  std::vector<std::string> files;  ///< folders of mesh files of robots
  std::string page;                ///< directory of the built page; empty: where takt was installed or built
};

/// Beside the program: ../share/takt/view, where it is installed and in the build tree.
std::filesystem::path page_directory(const std::string& given) {
  std::error_code problem;
  if (!given.empty()) return given;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", problem);
  const auto page = program.parent_path().parent_path() / "share" / "takt" / "view";
  return std::filesystem::is_regular_file(page / "index.html", problem) ? page : std::filesystem::path();
}

sigset_t ending_signals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  return signals;
}

void serve(const Common& common, const ViewOptions& options, view::Stream& stream, view::WebOptions web,
           view::Control control, const std::function<void()>& end = {}) {
  web.address = options.address;
  web.port = options.port;
  web.page = page_directory(options.page);
  web.control = !options.observer;
  web.files = view::RobotFiles(command_line::package_folders(options.files));
  web.metadata.emplace_back("files", web.files.any() ? "true" : "false");
  const view::SceneChannel scene(stream);
  const view::WebServer server(stream, std::move(web), std::move(control));
  const std::string host = view::host_in_url(options.address);
  if (common.json)
    std::printf("{\"url\": \"http://%s:%u/\"}\n", host.c_str(), server.port());
  else
    std::printf("http://%s:%u/    (Ctrl-C ends it; Foxglove connects to ws://%s:%u/)\n", host.c_str(),
                server.port(), host.c_str(), server.port());
  std::fflush(stdout);
  int signal = 0;
  const sigset_t signals = ending_signals();
  sigwait(&signals, &signal);
  if (end) end();
}

int view(const Common& common, const ViewOptions& options) {
  // The main thread waits for them; no thread made from here on may get one.
  const sigset_t signals = ending_signals();
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  view::Stream stream;
  view::WebOptions web;
  if (!options.file.empty()) {
    view::FileSource source(options.file, stream);
    if (!source.recording().cut_off().empty())
      std::fprintf(stderr, "takt: note: %s\n", source.recording().cut_off().c_str());
    web.name = std::filesystem::path(options.file).filename().string();
    web.metadata = {{"source", "file"}};
    serve(common, options, stream, std::move(web), [&](const std::string& name, const Arguments& arguments) {
      return source.request(name, arguments);
    });
    return kOk;
  }
  view::LiveSource source(common.client, stream);
  view::Metrics metrics(stream, common.client.cell);
  web.name = common.client.cell;
  web.metadata = {{"source", "live"}, {"cell", common.client.cell}};
  web.metrics = [&metrics] { return metrics.text(); };
  serve(
      common, options, stream, std::move(web),
      [&](const std::string& name, const Arguments& arguments) { return source.request(name, arguments); },
      [&] { source.end(); });
  return kOk;
}

}  // namespace

void declare_view(CLI::App& app, const Common& common, int& result) {
  static ViewOptions options;
  auto* command = app.add_subcommand("view", "show the running cell, or a recording, in the browser");
  command->add_option("FILE", options.file, "recording (MCAP); without: the running cell")
      ->check(CLI::ExistingFile);
  command->add_option("--port", options.port, "port to listen on; 0: any free one")
      ->check(command_line::whole_number_from(0, 65535))
      ->capture_default_str();
  command
      ->add_option("--address", options.address,
                   "address to listen on; 127.0.0.1: this machine only, 0.0.0.0: every network (every "
                   "machine that reaches it can control the cell, unless --observer)")
      ->capture_default_str();
  command->add_flag("--observer", options.observer, "all viewers may observe, none may control");
  command->add_option("--page", options.page, "directory of the built page")->check(CLI::ExistingDirectory);
  command
      ->add_option(
          "--files,--packages", options.files,
          "folder of mesh files (STL, DAE, OBJ) that robots are drawn with, as their URDF names them "
          "(relative or package://); may be given several times; those of AMENT_PREFIX_PATH, "
          "ROS_PACKAGE_PATH, GZ_SIM_RESOURCE_PATH "
          "and GAZEBO_MODEL_PATH follow; nothing else is handed out")
      ->check(CLI::ExistingDirectory)
      ->type_size(1)
      ->allow_extra_args(false);
  command->callback([&] { result = view(common, options); });
}

}  // namespace takt::tool
