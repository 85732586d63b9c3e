#pragma once
// Kinds of devices: components that are neither Part, Ground, robot nor gripper. A kind is two files in this
// room and a line in device_types.cpp. Its files contain
// - a struct with the keys of one device in a scenario, and describe(Fields&, S&), the table of these keys;
// - the plant model (DeviceModel), with its parameters;
// - the table of its signals (kind_signals.h);
// - build(const S&, DeviceBuilder&), which makes the model from the struct.
// A device belongs to the cell (a section of its own, NAME: {...}) or to a Part (a key of the Part); then its
// name is PART_key.
#include <any>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "plant_models/device_model.h"
#include "server/devices/fmu_link.h"
#include "server/devices/kind_signals.h"
#include "server/devices/signal_table.h"
#include "server/fields/fields.h"
#include "server/geometry/surface/shared_mesh.h"
#include "server/simulation/model/cell_model.h"
#include "server/simulation/model/model_digest.h"

namespace takt {

/// A Part that its device fixes to another component. A struct of a scenario with a member `held_by` of this
/// type makes its device such a device.
struct HeldBy {
  std::string component;  ///< a Part without such a device, or a Ground
  std::string place;      ///< in the file
};

/// An input that follows another signal, as text (server/scenario/wires.h).
struct StatedWire {
  std::string to, text;
  std::string place{};  ///< in the file
};

/// Arguments and results of the construction of a device, while a cell is built.
class DeviceBuilder {
 public:
  DeviceBuilder(const SharedMeshes& meshes_by_component, double temperature_degC, CellModel& model)
      : meshes(meshes_by_component), surroundings_degC(temperature_degC), cell(model) {}

  std::string name;            ///< of the device
  std::string type{};          ///< its key in a scenario
  int component = -1;          ///< the Part that the device belongs to
  const SharedMeshes& meshes;  ///< by component
  double surroundings_degC;
  CellModel& cell;
  /// Parts that have a temperature.
  struct Heated {
    int body = -1;
    double surface_m2 = 0.0, emissivity = 0.0;
  };
  std::vector<Heated> heated{};
  std::set<std::pair<std::size_t, std::size_t>> torques{};  ///< joints with one, by robot and joint
  /// Called in order when all devices of the cell are built, e.g. to find signals of others.
  std::vector<std::function<void()>> when_built{};
  std::vector<StatedWire> wires{};  ///< ahead of those of the scenario
  FmuOpener* fmus = nullptr;        ///< none: FMUs are not allowed

  /// Adds a plant model with its signals; every member of its parameters enters the model hash. Returns the
  /// device.
  template <class Model, class Parameters>
  int add(const Parameters& parameters, std::vector<SignalDescription> signals) {
    AuxiliaryModel entry;
    entry.name = name;
    entry.make = [parameters] { return std::make_unique<Model>(parameters); };
    entry.device = static_cast<int>(cell.description.devices.size());
    entry.digest = (ModelDigest() << parameters).value();
    cell.auxiliary_models.push_back(std::move(entry));
    cell.description.devices.push_back({name, std::move(signals), type});
    return cell.auxiliary_models.back().device;
  }
  /// The same for signals that are plain numbers (SignalTable), which a mechanism reads and writes;
  /// `parameters` enter the model hash.
  template <class Parameters>
  int add_signal_table(const Parameters& parameters, std::vector<SignalDescription> signals,
                       const std::vector<double>& initial = {}) {
    SignalTableParameters board;
    board.count = signals.size();
    std::copy(initial.begin(), initial.end(), board.initial.begin());
    const int device = add<SignalTable>(board, std::move(signals));
    cell.auxiliary_models.back().digest = (ModelDigest() << parameters).value();
    return device;
  }
  /// The model of a mechanism (PartMechanism) shared by several devices; made at the first call.
  template <class Mechanism>
  typename Mechanism::Model& mechanism() {
    for (const MechanismModel& entry : cell.mechanisms)
      if (entry.name == Mechanism::kName)
        return *std::static_pointer_cast<typename Mechanism::Model>(entry.model);
    auto model = std::make_shared<typename Mechanism::Model>();
    cell.mechanisms.push_back(
        {Mechanism::kName, model, [model] { return std::make_unique<Mechanism>(*model); }});
    return *model;
  }
  Pose pose_of_ground(const std::string& ground) const;
};

struct DeviceType {
  enum class Owner { cell, part } owner = Owner::cell;
  const char* key = "";                   ///< in the file
  const char* doc = "";                   ///< of the section
  const char* item_doc = "";              ///< of one device
  bool draws_energy = false;              ///< has a signal `energy` (J)
  std::span<const KindSignal> signals{};  ///< of every device of this kind
  const char* further_signals = "";  ///< a sentence for the reference: those that each device has its own
  std::any (*fresh)() = nullptr;
  void (*describe)(Fields&, std::any&) = nullptr;
  void (*build)(const std::any&, DeviceBuilder&) = nullptr;
  const HeldBy* (*held_by)(const std::any&) = nullptr;  ///< nullptr: the device fixes no Part
};

template <class S>
DeviceType device_type(DeviceType::Owner owner, const char* key, const char* doc, const char* item_doc,
                       bool draws_energy, std::span<const KindSignal> signals,
                       const char* further_signals = "") {
  DeviceType type{owner, key, doc, item_doc, draws_energy, signals, further_signals};
  type.fresh = [] { return std::any(S{}); };
  type.describe = [](Fields& f, std::any& stated) { describe(f, *std::any_cast<S>(&stated)); };
  type.build = [](const std::any& stated, DeviceBuilder& b) { build(*std::any_cast<S>(&stated), b); };
  if constexpr (requires(S s) { s.held_by; })
    type.held_by = [](const std::any& stated) -> const HeldBy* {
      return &std::any_cast<S>(&stated)->held_by;
    };
  return type;
}

/// A device as stated in a scenario.
struct StatedDevice {
  std::string name{};  ///< of one that belongs to a Part: empty
  const DeviceType* type = nullptr;
  std::any section{};  ///< the struct of the type

  const HeldBy* held_by() const { return type->held_by != nullptr ? type->held_by(section) : nullptr; }
};

/// All kinds, in the order in which devices are built: a device follows those that it depends on.
const std::vector<DeviceType>& device_types();
const DeviceType& device_type(const std::string& key);

/// The devices of the cell, as sections of the scenario.
void describe_devices(Fields& f, std::vector<StatedDevice>& devices);
/// The devices of a Part, as keys of the Part.
void describe_part_devices(Fields& f, const std::string& part, std::vector<StatedDevice>& devices);
/// PART_key.
std::string part_device_name(const std::string& part, const DeviceType& type);

}  // namespace takt
