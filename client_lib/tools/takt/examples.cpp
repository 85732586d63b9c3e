// Examples at the end of each command's help.
#include <CLI/CLI.hpp>
#include <map>
#include <string>

#include "client_lib/tools/takt/commands.h"

namespace takt::tool {
namespace {

const std::map<std::string, std::string>& examples() {
  static const std::map<std::string, std::string> texts{
      {"list",
       "  takt list                          all cells on domain 0, after 2 s\n"
       "  takt --domain 3 list --timeout 5\n"
       "  takt list --json | jq -r '.[].cell'"},
      {"status",
       "  takt status\n"
       "  takt status --json | jq .real_time_factor"},
      {"state",
       "  takt state\n"
       "  takt state --json | jq '.components.P.position'\n"
       "  takt state --json | jq '.devices.Furnace | .signals.temperature, .units.temperature, .limits'"},
      {"signals",
       "  takt signals                       all inputs and outputs\n"
       "  takt signals --json | jq '.[] | select(.forced)'\n"
       "  takt request force_signal Barrier1.blocked 1; takt request release_signal all"},
      {"explain",
       "  takt explain P                     what holds P, by which rule, since when\n"
       "  takt explain Gripper1 --json       what Gripper1 holds"},
      {"power",
       "  takt lod 2; takt power             what each robot draws now\n"
       "  takt power --watch --json          one line of JSON per 0.1 s of simulated time"},
      {"contacts",
       "  takt lod 3; takt contacts\n"
       "  takt contacts --until 12 --json"},
      {"lod",
       "  takt lod 2                         robots with drives and masses, in every process\n"
       "  takt lod 3 assembly                surface contact, in this process"},
      {"watch",
       "  takt watch                         a line that renews itself; Ctrl-C ends it\n"
       "  takt watch --until 42 --json       one line of JSON per change; exit code 1 when a fault comes "
       "first"},
      {"events",
       "  takt events                        follow them\n"
       "  takt events --count 1 --json       wait for the next one"},
      {"echo",
       "  takt echo status\n"
       "  takt echo contacts --count 10 | jq -c .contacts\n"
       "  takt echo joint_states Robot1"},
      {"record",
       "  takt record run.mcap               all samples of all topics, until Ctrl-C\n"
       "  takt record run.mcap --period 0.01 --duration 10\n"
       "  takt record run.mcap --compression lz4 --pressures 'P-*'\n"
       "  takt record run.csv --duration 10\n"
       "  takt record - --until 42 --period 0.1"},
      {"view",
       "  takt view                          then open http://127.0.0.1:8765/\n"
       "  takt view --observer --address 0.0.0.0\n"
       "  takt view run.mcap --port 0"},
      {"replay",
       "  takt --domain 5 replay run.mcap    as it was\n"
       "  takt replay run.mcap --rate 10"},
      {"export",
       "  takt export run.mcap --list\n"
       "  takt export run.mcap --csv run.csv\n"
       "  takt export run.mcap --csv - --signals 'state.components.P.position.*' 'power.*'\n"
       "  takt export run.mcap --json | jq -c 'select(.topic == \"/cell/events\").sample.message'"},
      {"plot",
       "  takt plot run.mcap state.components.P.position.z\n"
       "  takt plot run.mcap 'state.robots.Robot1.effort.*' -o torques.svg"},
      {"check", "  takt check config/scenarios/block_assembly.yaml && echo 'all there'"},
      {"step", "  takt pause; takt step 100          100 steps, returns when they are done"},
      {"play", "  takt play"},
      {"pause", "  takt pause"},
      {"reset", "  takt reset                         the epoch counts up"},
      {"quit", "  takt quit                          ends takt-server"},
      {"pace",
       "  takt pace realtime --factor 0.5    half as fast as real time\n"
       "  takt pace free                     as fast as possible\n"
       "  takt pace lockstep                 in step with registered controllers"},
      {"load",
       "  takt load my.yaml\n"
       "  takt load my.yaml --lod 2 --set solver.step_s=0.0005 --set parts.P.mass_kg=0.4"},
      {"reload", "  takt reload                        after the file was edited"},
      {"unload", "  takt unload"},
      {"entities",
       "  takt entities\n"
       "  takt entities 'P*' --type part --json"},
      {"spawn",
       "  takt spawn P2 --copy-of P --at 0.2 0.3 0.7\n"
       "  takt spawn Box --mesh box.stl --scale 0.001 --mass 0.4 --at 0 0 1 --rpy-deg 0 0 90\n"
       "The cell must be stopped: takt request set_state state=stopped"},
      {"delete", "  takt delete P2"},
      {"move",
       "  takt pause; takt move P --at 0.2 0.3 0.7\n"
       "  takt move P --velocity 0 0 1       only its velocity"},
      {"attach", "  takt attach P Gripper1             P goes with the gripper, closed or not"},
      {"detach", "  takt detach P"},
      {"snapshot", "  takt snapshot before_insertion"},
      {"restore",
       "  takt restore before_insertion\n"
       "  takt restore                       the newest periodic snapshot"},
      {"request",
       "  takt request get_features\n"
       "  takt request set_state state=stopped\n"
       "  takt request set_level_of_detail level_of_detail=2 process=all --json"},
      {"completion",
       "  source <(takt completion bash)     in this shell\n"
       "  takt completion bash > ~/.local/share/bash-completion/completions/takt"},
  };
  return texts;
}

}  // namespace

void add_examples(CLI::App& app) {
  for (CLI::App* command : app.get_subcommands({})) {
    const auto found = examples().find(command->get_name());
    if (found != examples().end()) command->footer("\nExamples:\n" + found->second);
  }
}

}  // namespace takt::tool
