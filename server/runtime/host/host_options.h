#pragma once
// How the host of a cell is set up.
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "server/runtime/loop/run_loop_options.h"

namespace takt {

class FmuOpener;  // server/devices/fmu_link.h

struct HostOptions {
  std::string cell = "cell";  ///< name of the server
  /// Of every loop; its state concerns the first one only. pause_at_s is set by the next one below,
  /// controllers by the host.
  RunLoopOptions loop{};
  bool end_at_duration = false;        ///< pause when the scenario's duration has been simulated
  int threads = 1;                     ///< for the collision checks
  std::filesystem::path snapshots{};   ///< directory of snapshots; empty: without snapshots
  std::filesystem::path log{};         ///< recording from the start; empty: without
  std::filesystem::path recordings{};  ///< directory of recordings by request; empty: they are refused
  std::filesystem::path scenarios{};   ///< the files that clients may name; empty: any (allowed_files.h)
  bool edit = false;                   ///< clients may replace the file of the loaded scenario
  std::string version{};               ///< of the server, for recordings
  std::shared_ptr<FmuOpener> fmus{};   ///< none: scenarios with FMUs are refused
  /// Where package://PACKAGE/PATH in URDF files is searched (idl/common/ros_packages.h).
  std::vector<std::filesystem::path> packages{};
  std::filesystem::path cache_directory{};  ///< of what is made from meshes; empty: without cache
  /// Called with each note about imported meshes and robots, by the thread that reads them; each note is also
  /// sent as an event.
  std::function<void(const std::string& sentence)> on_note{};
  /// Called by the same thread during a long import: component, and the finished share, from 0 to 1.
  std::function<void(const std::string& component, double part)> on_import{};
};

}  // namespace takt
