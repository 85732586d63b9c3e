// takt-make-meshes OUTDIR: writes the meshes of the scenarios as OBJ files (README.md in config/meshes).
// takt-make-meshes --large OUTDIR: the meshes that are too large to be committed.
// takt-make-meshes --cells OUTDIR [--set NAME=VALUE]...: those of the chainsaw, rotor, furnace and screw cells (too
// large as well), with other parameters (clearances, interference, chamfers, element sizes).
// takt-make-meshes --families OUTDIR: shapes from coarse to fine, for verification reports.
// takt-make-meshes --parameters: their names, defaults, and the values allowed.
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <stdexcept>
#include <string>
#include <vector>

#include "config/meshes/generator/block.h"
#include "config/meshes/generator/chainsaw_meshes.h"
#include "config/meshes/generator/contact_meshes.h"
#include "config/meshes/generator/lattice_mesh.h"
#include "config/meshes/generator/mesh_families.h"
#include "config/meshes/generator/mesh_parameters.h"
#include "config/meshes/generator/rotor_meshes.h"

namespace takt::meshes {
namespace {

constexpr std::int64_t kEdge = mm(5);  // of the meshed faces
constexpr std::int64_t kChamfer = mm(2);
constexpr std::int64_t kNotMeshed = mm(1e6);  // an edge length that leaves a face in one piece

/// Inserted parts are 0.5 mm smaller than their pockets on each side.
const Block kB{"B",
               Rectangle::around(0, 0, mm(220), mm(120)),
               mm(60),
               {{Rectangle::around(mm(-60), 0, mm(60), mm(80)), mm(20)},
                {Rectangle::around(mm(40), 0, mm(80), mm(80)), mm(20)}},
               kChamfer,
               0};
const Block kC{"C", Rectangle::around(0, 0, mm(59), mm(79)), mm(80), {}, 0, kChamfer};
const Block kO{"O",      Rectangle::around(0, 0, mm(79), mm(79)),
               mm(80),   {{Rectangle::around(mm(15), 0, mm(30), mm(30)), mm(30)}},
               kChamfer, kChamfer};
const Block kP{"P", Rectangle::around(0, 0, mm(29), mm(29)), mm(80), {}, 0, kChamfer};

std::vector<LatticeMesh> make_table() {
  std::vector<LatticeMesh> boxes{
      make_box("top", {mm(-450), mm(-350), mm(-40)}, {mm(450), mm(350), 0}, kNotMeshed)};
  int leg = 0;
  for (const std::int64_t x : {mm(-400), mm(400)})
    for (const std::int64_t y : {mm(-300), mm(300)})
      boxes.push_back(make_box("leg_" + std::to_string(++leg), {x - mm(25), y - mm(25), mm(-700)},
                               {x + mm(25), y + mm(25), mm(-40)}, kNotMeshed));
  return boxes;
}

void write(const std::filesystem::path& directory, const std::string& name, const std::string& parameters,
           const std::vector<LatticeMesh>& objects) {
  const std::filesystem::path file = directory / (name + ".obj");
  std::ofstream out(file, std::ios::binary);
  write_obj(out, {"Made by: takt-make-meshes OUTDIR. Metres, z up.", parameters}, objects);
  out.close();
  if (!out) throw std::runtime_error("cannot write " + file.string());
}

void write_convex(const std::filesystem::path& directory, const Block& block) {
  const std::vector<LatticeMesh> pieces = make_convex_pieces(block);
  double volume = 0.0;
  for (const LatticeMesh& piece : pieces) volume += piece.volume();
  char error[32];
  std::snprintf(error, sizeof(error), "%+.4f",
                100.0 * (volume / make_block(block, kNotMeshed).volume() - 1.0));
  write(directory, block.name + "_convex",
        block.name +
            " in convex pieces. The rim chamfers of the walls along x run through from end to end: volume " +
            error + " % against " + block.name + ".obj.",
        pieces);
}

void make_all(const std::filesystem::path& directory) {
  std::filesystem::create_directories(directory);
  const std::string origin = " Origin: centre of the bottom face. Element edge 5 mm.";
  write(directory, "B",
        "220 x 120 x 60 mm; pockets 60 x 80 x 40 deep at x = -60 and 80 x 80 x 40 deep at x = 40; rims "
        "chamfered by "
        "2 mm." +
            origin,
        {make_block(kB, kEdge)});
  write(directory, "C", "59 x 79 x 80 mm; bottom edges chamfered by 2 mm." + origin, {make_block(kC, kEdge)});
  write(
      directory, "O",
      "79 x 79 x 80 mm; pocket 30 x 30 x 50 deep at x = 15; rim and bottom edges chamfered by 2 mm." + origin,
      {make_block(kO, kEdge)});
  write(directory, "P", "29 x 29 x 80 mm; bottom edges chamfered by 2 mm." + origin, {make_block(kP, kEdge)});
  write_convex(directory, kB);
  write_convex(directory, kO);
  write(directory, "table",
        "Top 900 x 700 x 40 mm, four legs 50 x 50 x 660 mm. Origin: centre of the top face.", make_table());
  write(directory, "gripper_body", "80 x 170 x 80 mm. Origin: centre of the flange side.",
        {make_box("gripper_body", {mm(-40), mm(-85), 0}, {mm(40), mm(85), mm(80)}, kNotMeshed)});
  write(directory, "gripper_jaw",
        "Pad 30 x 15 x 120 mm of the jaw on the +y side; inner face at y = 0, z from the flange. Element "
        "edge 5 mm.",
        {make_box("gripper_jaw", {mm(-15), 0, mm(80)}, {mm(15), mm(15), mm(200)}, kEdge)});
}

}  // namespace
}  // namespace takt::meshes

namespace {

void make_cells(const std::string& directory, const std::vector<std::string>& settings) {
  takt::meshes::CellParameters parameters;
  for (const std::string& text : settings) takt::meshes::set_parameter(parameters, text);
  std::filesystem::create_directories(directory);
  takt::meshes::make_chainsaw_meshes(directory, parameters.chainsaw);
  takt::meshes::make_rotor_meshes(directory, parameters.rotor);
  takt::meshes::make_screw_meshes(directory, parameters.screw, parameters.gear);
  takt::meshes::make_cap_screw_meshes(directory, parameters.cap_screw);
  takt::meshes::make_lamp_meshes(directory, parameters.lamp);
}

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::string> words(argv + 1, argv + argc);
  std::vector<std::string> settings;
  bool usable = !words.empty();
  for (std::size_t i = 2; i < words.size(); i += 2) {
    usable = usable && words[0] == "--cells" && words[i] == "--set" && i + 1 < words.size();
    if (usable) settings.push_back(words[i + 1]);
  }
  const bool named =
      words.size() > 1 && (words[0] == "--large" || words[0] == "--cells" || words[0] == "--families");
  const bool listed = words.size() == 1 && words[0] == "--parameters";
  usable = usable &&
           (named ? !words[1].starts_with('-') : words.size() == 1 && (listed || !words[0].starts_with('-')));
  if (!usable) {
    std::cerr << "usage: takt-make-meshes [--large | --families] OUTDIR\n"
                 "       takt-make-meshes --cells OUTDIR [--set NAME=VALUE]...\n"
                 "       takt-make-meshes --parameters\n";
    return 2;
  }
  try {
    if (listed) {
      takt::meshes::list_parameters(std::cout, {});
    } else if (words[0] == "--large") {
      takt::meshes::make_large_contact_meshes(words[1]);
    } else if (words[0] == "--families") {
      takt::meshes::make_mesh_families(words[1]);
    } else if (words[0] == "--cells") {
      make_cells(words[1], settings);
    } else {
      takt::meshes::make_all(words[0]);
      takt::meshes::make_contact_meshes(std::filesystem::path(words[0]) / "contact");
    }
  } catch (const std::invalid_argument& error) {
    std::cerr << "takt-make-meshes: " << error.what() << '\n';
    return 2;
  } catch (const std::exception& error) {
    std::cerr << "takt-make-meshes: " << error.what() << '\n';
    return 1;
  }
  return 0;
}
