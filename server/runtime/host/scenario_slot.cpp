#include "server/runtime/host/scenario_slot.h"

#include <filesystem>
#include <stdexcept>
#include <utility>

#include "server/runtime/host/scenario_edit.h"
#include "server/scenario/note_sentences.h"
#include "server/scenario/scenario_builder.h"
#include "server/scenario/scenario_reader.h"

namespace takt {

ScenarioSlot::ScenarioSlot(const HostOptions& options, std::shared_ptr<OutboundQueue> outbound,
                           std::function<bool()> given_up)
    : options_(options),
      outbound_(std::move(outbound)),
      given_up_(std::move(given_up)),
      pace_(options.loop.pace),
      factor_(options.loop.factor) {
  if (options_.threads > 1) pool_.emplace(options_.threads, options_.loop.realtime_priority);
}

std::shared_ptr<LoadedScenario> ScenarioSlot::build(std::shared_ptr<CellModel> model, double duration_s) {
  model->description.cell = options_.cell;
  model->description.scenario_generation = generation_ + 1;
  if (listener_ != nullptr) listener_->check(model->description);
  auto loaded = std::make_shared<LoadedScenario>(std::move(model));
  if (pool_) loaded->simulation.set_executor(&*pool_);
  if (options_.end_at_duration && duration_s > 0.0) loaded->pause_at_s = duration_s;
  return loaded;
}

std::shared_ptr<LoadedScenario> ScenarioSlot::build(const Scenario& scenario) {
  const auto on_import = [this](const std::string& component, double part) {
    if (given_up_()) throw std::runtime_error("The server ends; the import was given up.");
    if (options_.on_import) options_.on_import(component, part);
  };
  auto model = std::make_shared<CellModel>(*build_cell(
      scenario, {options_.cache_directory, nullptr, on_import, options_.fmus.get(), options_.packages}));
  if (options_.on_note)
    for (const std::string& sentence : note_sentences(model->import_notes)) options_.on_note(sentence);
  for (const ImportNote& note : model->import_notes)
    outbound_->events.post(events::ImportNote{note.component, note.sentence});
  auto loaded = build(std::move(model), scenario.duration_s);
  loaded->as_loaded = loaded->content = scenario;
  return loaded;
}

std::shared_ptr<LoadedScenario> ScenarioSlot::build(const ScenarioSource& source) {
  auto loaded = build(read_scenario(source.file, source.options));
  loaded->source = source;
  // A server that starts again may have another working directory.
  loaded->source->file = std::filesystem::absolute(source.file);
  return loaded;
}

std::shared_ptr<LoadedScenario> ScenarioSlot::build(const ScenarioSource& source,
                                                    std::vector<requests::Any> changes) {
  auto loaded = build(source);
  if (changes.empty()) return loaded;
  auto changed = build(with_changes(*loaded->content, changes));
  changed->source = loaded->source;
  changed->as_loaded = loaded->as_loaded;
  changed->changes = std::move(changes);
  return changed;
}

std::uint32_t ScenarioSlot::exchange(std::shared_ptr<LoadedScenario> next,
                                     std::optional<SimulationState> state, bool keep_controllers) {
  RunLoopOptions options = options_.loop;
  options.outbound = outbound_;
  if (std::shared_ptr<LoadedScenario> old = set_loaded(nullptr)) {
    old->loop->stop();
    old->writer.reset();  // writes the last state of the old scenario ahead of the new one's
    set_pace(old->loop->pace(), old->loop->pace_factor());
    if (keep_controllers) options.controllers = old->loop->controllers();
    if (listener_ != nullptr) listener_->closed(*old->loop);
    old.reset();
  }
  if (generation_ > 0) options.state = SimulationState::stopped;
  ++generation_;
  if (next) {
    options.pace = pace();
    options.factor = pace_factor();
    options.state = state.value_or(options.state);
    if (next->pause_at_s) options.pause_at_s = next->pause_at_s;
    next->loop.emplace(next->simulation, std::move(options));
    next->loop->set_on_quit(on_quit_);
    // Clients that learn of the scenario by the listener may ask at once: the loop keeps requests until it starts.
    set_loaded(next);
    try {
      if (listener_ != nullptr) listener_->opened(*next->loop);
      on_exchange_(next.get());
    } catch (...) {
      set_loaded(nullptr);
      throw;
    }
    if (!given_up_()) next->loop->start();
  } else {
    if (listener_ != nullptr) {
      CellDescription nothing;
      nothing.cell = options_.cell;
      nothing.scenario_generation = generation_;
      listener_->idle(nothing);
    }
    on_exchange_(nullptr);
  }
  outbound_->news.post();
  return generation_;
}

std::shared_ptr<LoadedScenario> ScenarioSlot::set_loaded(std::shared_ptr<LoadedScenario> next) {
  const std::lock_guard lock(mutex_);
  return std::exchange(loaded_, std::move(next));
}

std::shared_ptr<LoadedScenario> ScenarioSlot::loaded() const {
  const std::lock_guard lock(mutex_);
  return loaded_;
}

Pace ScenarioSlot::pace() const {
  const std::lock_guard lock(mutex_);
  return pace_;
}

double ScenarioSlot::pace_factor() const {
  const std::lock_guard lock(mutex_);
  return factor_;
}

void ScenarioSlot::set_pace(Pace pace, double factor) {
  const std::lock_guard lock(mutex_);
  pace_ = pace;
  factor_ = factor;
}

}  // namespace takt
