#include "server/devices/device_type.h"

#include <algorithm>
#include <iterator>

#include "server/simulation/step/cell_plant.h"

namespace takt {

SignalTable& signal_table(CellPlant& plant, int device) {
  return static_cast<SignalTable&>(plant.device(static_cast<std::size_t>(device)));
}

Pose DeviceBuilder::pose_of_ground(const std::string& ground) const {
  const int id = cell.description.find_component(ground);
  for (const GroundModel& model : cell.grounds)
    if (model.component == id) return model.X_WB;
  return {};
}

const DeviceType& device_type(const std::string& key) {
  const auto& types = device_types();
  return *std::find_if(types.begin(), types.end(), [&](const DeviceType& type) { return type.key == key; });
}

void describe_devices(Fields& f, std::vector<StatedDevice>& devices) {
  for (const DeviceType& type : device_types()) {
    if (type.owner != DeviceType::Owner::cell) continue;
    std::vector<StatedDevice> own;
    std::copy_if(devices.begin(), devices.end(), std::back_inserter(own),
                 [&](const StatedDevice& device) { return device.type == &type; });
    f.entries(
        type.key, own, type.doc, type.item_doc, kNamesTopics,
        [&] {
          return StatedDevice{"", &type, type.fresh()};
        },
        [&](StatedDevice& device) { type.describe(f, device.section); });
    if (!f.reading()) continue;
    for (StatedDevice& device : own) {
      f.add_name("devices", device.name);
      if (type.draws_energy) f.add_name("consumers", device.name);
      devices.push_back(std::move(device));
    }
  }
}

void describe_part_devices(Fields& f, const std::string& part, std::vector<StatedDevice>& devices) {
  for (const DeviceType& type : device_types()) {
    if (type.owner != DeviceType::Owner::part) continue;
    std::optional<std::any> section;
    for (const StatedDevice& device : devices)
      if (device.type == &type) section = device.section;
    if (f.informing() || (f.reading() && f.find(type.key))) section.emplace(type.fresh());
    if (!section) continue;
    const auto describe_it = [&](std::any& stated) {
      f.section(
          type.key, type.doc, [&] { type.describe(f, stated); }, kAlwaysWritten);
    };
    if (f.writing()) {
      f.note_defaults([&] {
        std::any usual = type.fresh();
        describe_it(usual);
      });
    }
    describe_it(*section);
    if (!f.reading()) continue;
    f.add_name("devices", part_device_name(part, type));
    devices.push_back({"", &type, std::move(*section)});
  }
}

std::string part_device_name(const std::string& part, const DeviceType& type) {
  return part + "_" + type.key;
}

}  // namespace takt
