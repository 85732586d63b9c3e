#pragma once
// The readers of external files, each as one function of bytes: for the fuzzer (files_fuzz.cpp) and for the
// test that repeats its findings (tests/scenario/fuzzed_files_regression_test.cpp).
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "server/geometry/mesh/import.h"
#include "server/scenario/scenario_reader.h"
#include "server/scenario/sdf_cell.h"
#include "server/scenario/urdf_collision.h"

namespace takt::test {

inline const std::vector<std::string> kFuzzedFormats{"obj", "stl", "glb", "dae", "urdf", "sdf", "yaml"};

namespace fuzzing {

inline void read_mesh(const std::filesystem::path& file) {
  const RepairedMesh mesh = import_and_repair(file, 0.001);
  for (const auto& t : mesh.mesh.triangles) {
    for (const std::uint32_t corner : t) {
      if (!mesh.mesh.vertices.at(corner).allFinite()) throw std::logic_error("a corner that is no number");
    }
  }
}

inline void read_urdf(const std::filesystem::path& file) {
  const UrdfArm arm = read_urdf_arm(file, "base_link", "tool0");
  (void)urdf_collision(arm);
  (void)urdf_inertias(arm);
}

}  // namespace fuzzing

/// Empty: the file was read. Else the text of the format's typed error. Any other exception passes through.
inline std::string read_fuzzed(const std::string& format, const std::filesystem::path& file) {
  try {
    if (format == "urdf") {
      fuzzing::read_urdf(file);
    } else if (format == "sdf") {
      (void)sdf_cell(read_sdf(file), file.parent_path());
    } else if (format == "yaml") {
      (void)read_scenario(file);
    } else {
      fuzzing::read_mesh(file);
    }
  } catch (const MeshError& error) {
    return error.what();
  } catch (const UrdfError& error) {
    return error.what();
  } catch (const ScenarioError& error) {
    return error.what();
  }
  return {};
}

/// Reads a file of bytes in a directory that contains the files which this format may name.
inline std::string read_fuzzed_bytes(const std::string& format, const std::filesystem::path& directory,
                                     std::string_view bytes) {
  const std::filesystem::path file = directory / ("fuzzed." + format);
  std::ofstream(file, std::ios::binary | std::ios::trunc)
      .write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  return read_fuzzed(format, file);
}

/// The files that a scenario, a robot or a world of the corpus may name: "part.obj", "arm.urdf", "model.sdf".
inline void write_named_files(const std::filesystem::path& directory) {
  std::ofstream(directory / "part.obj")
      << "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
  std::ofstream(directory / "arm.urdf")
      << "<robot name='r'><link name='base_link'/><link name='tool0'/>"
         "<joint name='j' type='revolute'><parent link='base_link'/><child link='tool0'/>"
         "<limit lower='-1' upper='1' velocity='1' effort='1'/></joint></robot>\n";
  std::ofstream(directory / "model.sdf")
      << "<sdf version='1.6'><model name='m'><link name='l'/></model></sdf>\n";
}

}  // namespace takt::test
