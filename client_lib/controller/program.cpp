#include "client_lib/controller/program.h"

#include <algorithm>

#include "client_lib/controller/cell_view.h"
#include "idl/common/text.h"

namespace takt::controller {

namespace {
/// Times of the program meet times of the simulation, which may have been rounded to nanoseconds on their
/// way.
constexpr double kTimeTolerance_s = 1e-9;
constexpr double kLongestPeriod_s = 1.0;
/// Beyond them a program would fill the memory outside of its own.
constexpr std::size_t kMaxSignals = 10'000;

std::string seconds(double time_s) {
  return fixed_text(time_s, 3) + " s";
}
}  // namespace

Program::Program(const std::string& text, const std::string& file, const ProgramContext& context)
    : context_(context), lua_(this) {
  open_program_library(lua_.state());
  lua_.run(text, file);
  read_period(file);
  check_parameters(file);
  if (routines_.empty()) {
    throw std::runtime_error(file +
                             ": the program has no routine; add routine(\"ROBOT\", function(r) ... end)");
  }
  std::sort(routines_.begin(), routines_.end(),
            [](const Routine& a, const Routine& b) { return a.robot < b.robot; });
}

void Program::read_period(const std::string& file) {
  lua_State* L = lua_.state();
  lua_pushglobaltable(L);
  lua_pushstring(L, "period_s");
  lua_rawget(L, -2);
  if (!lua_isnil(L, -1)) {
    const double period = lua_type(L, -1) == LUA_TNUMBER ? lua_tonumber(L, -1) : std::nan("");
    if (!(period > 0.0 && period <= kLongestPeriod_s)) {
      const char* found = luaL_tolstring(L, -1, nullptr);
      throw std::runtime_error(file + ": period_s = " + found +
                               " is not allowed; a number of seconds in (0, 1] is");
    }
    period_s_ = period;
  }
  lua_settop(L, 0);
}

void Program::check_parameters(const std::string& file) const {
  for (const auto& [name, value] : *context_.parameters) {
    if (parameters_.count(name) == 0)
      throw std::runtime_error(file + ": the program has no parameter '" + name + "'; it has " +
                               list_names(parameters_));
  }
}

std::vector<int> Program::driven_robots() const {
  std::vector<int> robots;
  for (const Routine& routine : routines_) robots.push_back(routine.robot);
  return robots;
}

bool Program::finished() const {
  return std::all_of(routines_.begin(), routines_.end(),
                     [](const Routine& routine) { return routine.wait == Wait::finished; });
}

const takt_msgs::msg::CellState& Program::state() const {
  if (state_ == nullptr) throw std::runtime_error("the state of the cell is known only while routines run");
  return *state_;
}

const takt_msgs::msg::CellState& Program::state(StatePart part, std::size_t component) const {
  (void)state();
  return source_->read(part, component);
}

void Program::run(StateSource& source) {
  source_ = &source;
  state_ = &source.read(StatePart::time, 0);
  lua_.refill();
  for (bool progress = true; progress;) {
    progress = false;
    for (Routine& routine : routines_) {
      if (!may_go_on(routine)) continue;
      resume(routine);
      progress = true;
    }
  }
}

bool Program::may_go_on(Routine& routine) {
  switch (routine.wait) {
    case Wait::nothing:
      return true;
    case Wait::arrival:
      return (*context_.robots)[static_cast<size_t>(routine.robot)].arrived(state_->time);
    case Wait::time:
      return state_->time >= routine.until_s - kTimeTolerance_s;
    case Wait::signal:
      return signals_[static_cast<size_t>(routine.signal)];
    case Wait::condition:
      return condition_holds(routine);
    case Wait::finished:
      return false;
  }
  return false;
}

bool Program::condition_holds(Routine& routine) {
  lua_State* L = lua_.state();
  lua_rawgeti(L, LUA_REGISTRYINDEX, routine.condition);
  push_cell(L);
  lua_.runs(L);
  if (lua_pcall(L, 1, 1, 0) != LUA_OK || lua_.exceeded())
    throw std::runtime_error(in_routine(routine, lua_.error_text(L)));
  const bool holds = lua_toboolean(L, -1) != 0;
  lua_pop(L, 1);
  if (holds) {
    luaL_unref(L, LUA_REGISTRYINDEX, routine.condition);
    routine.condition = LUA_NOREF;
  } else if (state_->time >= routine.until_s - kTimeTolerance_s) {
    throw std::runtime_error(located(routine.robot, "the condition waited for has not come true in time"));
  }
  return holds;
}

std::int64_t Program::begin_step(lua_State* L, const Routine& routine, std::string_view name, bool named) {
  if (context_.steps == nullptr) return -1;
  lua_Debug place{};
  if (lua_getstack(L, 1, &place) == 0 || lua_getinfo(L, "l", &place) == 0) place.currentline = 0;
  return context_.steps->begin(
      {routine.robot, std::string(name), place.currentline, named, state_->time, -1.0});
}

void Program::end_step(std::int64_t& step) {
  if (step >= 0) context_.steps->end(step, state_->time);
  step = -1;
}

void Program::resume(Routine& routine) {
  routine.wait = Wait::nothing;
  end_step(routine.call);
  current_ = &routine;
  int arguments = 0;
  if (!routine.begun) {
    routine.begun = true;
    push_routine_robot(routine.thread, routine.robot);  // above the routine's function
    arguments = 1;
  }
  int results = 0;
  lua_.runs(routine.thread);
  const int status = lua_resume(routine.thread, nullptr, arguments, &results);
  current_ = nullptr;
  if (lua_.exceeded()) throw std::runtime_error(in_routine(routine, lua_.error_text(routine.thread)));
  if (status == LUA_OK) {
    routine.wait = Wait::finished;
    end_step(routine.step);
  } else if (status != LUA_YIELD) {
    throw std::runtime_error(in_routine(routine, lua_.error_text(routine.thread)));
  }
  lua_pop(routine.thread, results);
}

int Program::signal_id(std::string_view name) {
  const auto found = signal_ids_.find(name);
  if (found != signal_ids_.end()) return found->second;
  if (signals_.size() >= kMaxSignals) throw std::runtime_error("a program may use 10000 names of signals");
  const int id = static_cast<int>(signals_.size());
  signal_ids_.emplace(name, id);
  signals_.push_back(false);
  return id;
}

std::string Program::in_routine(const Routine& routine, const std::string& reason) const {
  return reason + " (in the routine of " + (*context_.robots)[static_cast<size_t>(routine.robot)].name() +
         ", at " + seconds(state_->time) + ")";
}

std::string Program::located(int robot, const std::string& reason) const {
  const auto routine = std::find_if(routines_.begin(), routines_.end(),
                                    [robot](const Routine& candidate) { return candidate.robot == robot; });
  if (routine == routines_.end()) return reason;
  luaL_where(routine->thread, 1);  // level 0 is the function that waits, level 1 the program's line
  const std::string place = lua_tostring(routine->thread, -1);
  lua_pop(routine->thread, 1);
  return in_routine(*routine, place + reason);
}

}  // namespace takt::controller
