// takt load, reload, entities, spawn, move: the scenario and its entities.
#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <memory>

#include "client_lib/tools/takt/commands.h"
#include "idl/command_line/enumeration.h"
#include "idl/command_line/numbers.h"

namespace takt::tool {
namespace {

using takt_msgs::msg::Quaternion;
using takt_msgs::msg::Vector3;

/// Files are named as the person sees them; the server may have another working directory.
std::string as_the_server_sees_it(const std::string& file) {
  std::error_code unreadable;
  if (!std::filesystem::exists(file, unreadable)) return file;
  return std::filesystem::absolute(file).lexically_normal().string();
}

int say(const Common& common, const std::string& sentence, nlohmann::json document) {
  document["message"] = sentence;
  std::printf("%s\n", common.json ? recording::json_text(document).c_str() : sentence.c_str());
  return 0;
}

Vector3 vector(const std::vector<double>& v) {
  return {v.at(0), v.at(1), v.at(2)};
}

/// Where something is to be, as options of a command.
struct Place {
  std::vector<double> position, rpy_deg, quaternion;

  void declare(CLI::App& command, bool position_required) {
    command.add_option("--at", position, "x y z of its frame in the world, m")
        ->expected(3)
        ->check(command_line::finite())
        ->required(position_required);
    auto* angles = command.add_option("--rpy-deg", rpy_deg, "roll pitch yaw about fixed axes, degrees")
                       ->expected(3)
                       ->check(command_line::finite());
    command.add_option("--quaternion", quaternion, "orientation x y z w instead")
        ->expected(4)
        ->check(command_line::finite())
        ->excludes(angles);
  }
  std::optional<Quaternion> orientation() const {
    if (!quaternion.empty()) return Quaternion{quaternion[0], quaternion[1], quaternion[2], quaternion[3]};
    if (rpy_deg.empty()) return std::nullopt;
    const double degree = M_PI / 180.0;
    const Vector3 half{0.5 * degree * rpy_deg[0], 0.5 * degree * rpy_deg[1], 0.5 * degree * rpy_deg[2]};
    const double cr = std::cos(half.x), sr = std::sin(half.x), cp = std::cos(half.y), sp = std::sin(half.y),
                 cy = std::cos(half.z), sy = std::sin(half.z);
    return Quaternion{sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy, cr * cp * sy - sr * sp * cy,
                      cr * cp * cy + sr * sp * sy};
  }
};

nlohmann::json loaded_json(const CellInfo& info) {
  auto names = [](const auto& items) {
    auto list = nlohmann::json::array();
    for (const auto& item : items) list.push_back(item.name);
    return list;
  };
  return {{"cell", info.cell},
          {"scenario", info.scenario},
          {"scenario_generation", info.scenario_generation},
          {"components", names(info.components)},
          {"robots", names(info.robots)},
          {"grippers", names(info.grippers)},
          {"devices", names(info.devices)}};
}

int say_loaded(const Common& common, const CellInfo& info) {
  return say(common,
             "Scenario " + info.scenario + " is loaded: " + std::to_string(info.components.size()) +
                 " components, " + std::to_string(info.robots.size()) + " robots; the simulation is stopped.",
             loaded_json(info));
}

int entities(const Common& common, const std::string& filter, const std::string& type) {
  Session cell(common);
  const auto found = cell->call(requests::GetEntities{filter, enumerator_of<ComponentType>(type)});
  if (common.json) {
    print_json(recording::values_json(arguments_of<requests::GetEntitiesResponse>(found)).at("entities"));
    return 0;
  }
  for (const auto& entity : found.entities) {
    std::printf("%-24s %-8s", entity.name.c_str(), std::string(to_string(entity.type)).c_str());
    if (entity.mass && entity.hierarchy) std::printf(" %g kg, hierarchy %d", *entity.mass, *entity.hierarchy);
    std::printf("\n");
  }
  return 0;
}

/// Options that live as long as the command they belong to.
template <typename Options>
std::shared_ptr<Options> kept() {
  return std::make_shared<Options>();
}

void declare_scenarios(CLI::App& app, const Common& common, int& result) {
  struct Load {
    std::string file;
    LoadOptions options;
  };
  auto load = kept<Load>();
  auto* command = app.add_subcommand("load", "load another scenario in the running server");
  command->add_option("SCENARIO", load->file, "scenario file (YAML)")->required();
  command->add_option("--set", load->options.overrides, "override a key, e.g. solver.step_s=0.0005")
      ->option_text("KEY=VALUE ...")
      ->allow_extra_args(false);
  command->add_option("--lod", load->options.level_of_detail, "level of detail of every process")
      ->check(command_line::whole_number_from(1, 3));
  command->callback([&common, &result, load] {
    Session cell(common);
    result = say_loaded(common, *cell->load_scenario(as_the_server_sees_it(load->file), load->options));
  });
  app.add_subcommand("reload", "load the file of the present scenario again")->callback([&] {
    result = say_loaded(common, *Session(common)->reload_scenario());
  });
}

void declare_parts(CLI::App& app, const Common& common, int& result) {
  struct Names {
    std::string first, second;
  };
  auto listed = kept<Names>();
  auto* list = app.add_subcommand("entities", "names and kinds of all components");
  list->add_option("FILTER", listed->first, "name with * for any characters");
  list->add_option("--type", listed->second, "only these components")
      ->check(CLI::IsMember(command_line::words_of<ComponentType>()));
  list->callback([&common, &result, listed] { result = entities(common, listed->first, listed->second); });

  struct Spawn {
    requests::SpawnEntity request;
    Place place;
  };
  auto spawn = kept<Spawn>();
  auto* to_spawn = app.add_subcommand("spawn", "add a Part while the cell is stopped");
  auto& wanted = spawn->request;
  to_spawn->add_option("NAME", wanted.name, "what the new Part is called")->required();
  auto* mesh = to_spawn->add_option("--mesh", wanted.uri, "mesh file: OBJ, STL, GLB or DAE");
  to_spawn->add_option("--copy-of", wanted.copy_of, "or the Part that it is like")->excludes(mesh);
  to_spawn->add_option("--mass", wanted.mass, "kg; needed with --mesh")->check(command_line::positive());
  to_spawn->add_option("--scale", wanted.mesh_scale, "lengths of the mesh are multiplied by this")
      ->needs(mesh)
      ->check(command_line::positive());
  to_spawn->add_option("--hierarchy", wanted.hierarchy, "higher is further down the assembly")
      ->check(command_line::whole_number_from(0, std::numeric_limits<int>::max()));
  to_spawn->add_flag("--rename", wanted.allow_renaming, "add a number to a name that is taken");
  spawn->place.declare(*to_spawn, true);
  to_spawn->callback([&common, &result, spawn] {
    auto& request = spawn->request;
    request.position = vector(spawn->place.position);
    request.orientation = spawn->place.orientation().value_or(Quaternion{});
    if (request.uri) request.uri = as_the_server_sees_it(*request.uri);
    const std::string name = Session(common)->spawn_entity(request).entity;
    result = say(common, name + " is there now.", {{"entity", name}});
  });

  struct Move {
    std::string part;
    Place place;
    std::vector<double> velocity, angular_velocity;
  };
  auto move = kept<Move>();
  auto* to_move = app.add_subcommand("move", "put a Part elsewhere while the cell is paused or stopped");
  to_move->add_option("PART", move->part, "name of the Part")->required();
  move->place.declare(*to_move, false);
  to_move->add_option("--velocity", move->velocity, "of its origin in the world, m/s")
      ->expected(3)
      ->check(command_line::finite());
  to_move->add_option("--angular-velocity", move->angular_velocity, "in the world, rad/s")
      ->expected(3)
      ->check(command_line::finite());
  to_move->callback([&common, &result, move] {
    requests::SetEntityState placement{.entity = move->part};
    if (!move->place.position.empty()) placement.position = vector(move->place.position);
    placement.orientation = move->place.orientation();
    if (!move->velocity.empty()) placement.linear_velocity = vector(move->velocity);
    if (!move->angular_velocity.empty()) placement.angular_velocity = vector(move->angular_velocity);
    Session(common)->set_entity_state(placement);
    result = say(common, move->part + " is there now.", {{"entity", move->part}});
  });
}

}  // namespace

void declare_scenario_and_entities(CLI::App& app, const Common& common, int& result) {
  declare_scenarios(app, common, result);
  declare_parts(app, common, result);
}

}  // namespace takt::tool
