#include "config/meshes/generator/contact_meshes.h"

#include <fstream>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

#include "config/meshes/generator/block.h"
#include "config/meshes/generator/lattice_mesh.h"
#include "config/meshes/generator/shapes.h"
#include "config/meshes/generator/solid.h"

namespace takt::meshes {
namespace {

constexpr double kMm = 1e-3;
constexpr double kUm = 1e-6;
constexpr int kFacets = 24;       // of pegs and holes
constexpr int kManyFacets = 240;  // of the large ones
constexpr double kHoleRadius = 10 * kMm;

constexpr Thread kThread{8.5 * kMm, 0.5 * kMm, 4 * kMm, 8, 48, 16, 0.5 * kMm};
constexpr int kSocketTurns = 7;
constexpr double kThreadClearance = 0.1 * kMm;

template <typename Object>
void write(const std::filesystem::path& directory, const std::string& parameters, const std::string& name,
           const Object& object, const char* command = "takt-make-meshes OUTDIR") {
  const std::filesystem::path file = directory / (name + ".obj");
  std::ofstream out(file, std::ios::binary);
  write_obj(out, {std::string("Made by: ") + command + ". Metres, z up.", parameters}, object);
  out.close();
  if (!out) throw std::runtime_error("cannot write " + file.string());
}

void write_large(const std::filesystem::path& directory, const std::string& parameters, const Solid& solid) {
  write(directory, parameters, solid.name, solid, "takt-make-meshes --large OUTDIR");
}

void write_solid(const std::filesystem::path& directory, const std::string& parameters, const Solid& solid) {
  write(directory, parameters, solid.name, solid);
}

void write_box(const std::filesystem::path& directory, const std::string& name, double size_x, double size_y,
               double size_z, const std::string& parameters) {
  const Block block{name, Rectangle::around(0, 0, mm(size_x), mm(size_y)), mm(size_z), {}, 0, mm(1)};
  write(directory, parameters, name, std::vector<LatticeMesh>{make_block(block, mm(5))});
}

Thread socket_thread(Thread thread) {
  thread.turns = kSocketTurns;
  return thread;
}

Thread bolt_thread(Thread thread) {
  thread.radius -= kThreadClearance;
  return thread;
}

}  // namespace

void make_contact_meshes(const std::filesystem::path& directory) {
  std::filesystem::create_directories(directory);
  const std::string on_bottom = " Origin: centre of the bottom face.";
  write(directory, "600 x 400 x 20 mm. Origin: centre of the top face.", "plate",
        std::vector<LatticeMesh>{
            make_box("plate", {mm(-300), mm(-200), mm(-20)}, {mm(300), mm(200), 0}, mm(1e6))});
  write_box(directory, "block", 40, 40, 40,
            "40 x 40 x 40 mm, bottom edges chamfered by 1 mm. Element edge 5 mm." + on_bottom);
  write_box(directory, "slab", 60, 60, 20,
            "60 x 60 x 20 mm, bottom edges chamfered by 1 mm. Element edge 5 mm." + on_bottom);
  write_solid(directory, "Radius 25 mm, 5120 triangles, corners on the sphere. Origin: its centre.",
              make_icosphere("sphere", 25 * kMm, 4));
  write_solid(directory, "Slope of 20 degrees over 400 mm, 300 mm wide, falling towards +x from the origin.",
              make_wedge("wedge_20deg", std::numbers::pi / 9.0, 400 * kMm, 300 * kMm, 20 * kMm));

  const std::string facets = " 24 flats, radii over them.";
  write_solid(directory,
              "Hole of radius 10 mm, 30 mm deep, rim chamfered by 1 mm, in a block of radius 30 mm." +
                  facets + " Origin: centre of the hole's floor.",
              make_bush("hole", {kHoleRadius, 30 * kMm, 30 * kMm, 10 * kMm, 1 * kMm, kFacets, 5 * kMm}));
  for (const auto& [name, clearance] :
       {std::pair{"peg_100um", 100 * kUm}, {"peg_10um", 10 * kUm}, {"peg_1um", 1 * kUm}})
    write_solid(directory,
                "Radius 10 mm less the clearance in the name, 50 mm long, ends chamfered by 2 mm." + facets +
                    on_bottom,
                make_peg(name, {kHoleRadius - clearance, 50 * kMm, 2 * kMm, kFacets, 4 * kMm}));
  write_solid(
      directory,
      "Through hole of radius 10 mm, 30 mm long, rims chamfered by 1 mm, in a block of radius 20 mm." +
          facets + " Origin: centre of the lower face.",
      make_bush("bush", {kHoleRadius, 20 * kMm, 30 * kMm, 0.0, 1 * kMm, kFacets, 5 * kMm}));
  write_solid(directory, "Radius 10.01 mm, 60 mm long, ends chamfered by 2 mm." + facets + on_bottom,
              make_peg("press_peg", {kHoleRadius + 10 * kUm, 60 * kMm, 2 * kMm, kFacets, 2 * kMm}));

  write_solid(directory,
              "Wave of 0.5 mm around radius 8.4 mm, pitch 4 mm, 8 turns, right-handed, end chamfered; head "
              "of radius 13 mm, 6 "
              "mm high. Origin: lower end.",
              make_bolt("bolt", bolt_thread(kThread), 13 * kMm, 6 * kMm));
  write_solid(directory,
              "Wave of 0.5 mm around radius 8.5 mm, pitch 4 mm, 7 turns, right-handed, ends chamfered, "
              "through a block of "
              "radius 16 mm. Origin: lower end.",
              make_socket("socket", socket_thread(kThread), 16 * kMm, 4 * kMm));
  write_solid(directory,
              "Tube of radius 4 mm; shank of 60 mm above the origin, arc of radius 15 mm over 200 degrees "
              "below it, towards +x.",
              make_hook("hook", {4 * kMm, 15 * kMm, std::numbers::pi * 10.0 / 9.0, 60 * kMm, 32, 1 * kMm}));
  write_solid(directory, "Tube of radius 3 mm around a circle of radius 20 mm about z. Origin: its centre.",
              make_ring("ring", 20 * kMm, 3 * kMm, 128, 24));
}

void make_large_contact_meshes(const std::filesystem::path& directory) {
  std::filesystem::create_directories(directory);
  Thread thread = kThread;
  thread.around = 200;
  thread.per_turn = 31;
  write_large(directory, "The bolt of config/meshes/contact with 100 000 triangles.",
              make_bolt("bolt_100k", bolt_thread(thread), 13 * kMm, 6 * kMm));
  thread.per_turn = 35;
  write_large(directory, "The socket of config/meshes/contact with 100 000 triangles.",
              make_socket("socket_100k", socket_thread(thread), 16 * kMm, 4 * kMm));
  write_large(
      directory, "Radius 9.9 mm, else the pegs of config/meshes/contact, with 240 flats.",
      make_peg("peg_100um_100k", {kHoleRadius - 100 * kUm, 50 * kMm, 2 * kMm, kManyFacets, 0.33 * kMm}));
  write_large(
      directory, "The hole of config/meshes/contact with 240 flats.",
      make_bush("hole_100k", {kHoleRadius, 30 * kMm, 30 * kMm, 10 * kMm, 1 * kMm, kManyFacets, 0.61 * kMm}));
}

}  // namespace takt::meshes
