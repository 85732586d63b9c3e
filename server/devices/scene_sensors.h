#pragma once
// Sensors that see the bodies of the cell: light barriers, light curtains, proximity boxes, distance sensors, readers of identification.
//
// They see Parts and Grippers (palms and jaws) by the triangles of their meshes, exact up to rounding, and Grounds where
// said so. They do not see the links of robots, nor the body or gripper that carries them. They look once a step, at the
// motion at its beginning, so their signals come with the next instant; what crosses a beam within a step is not seen.
//
// Cost: a body that has not moved since the last look is not looked at again, unless the sensor has moved. Of a moved body
// its box is compared first, and its triangles only if the box meets the sensor's. No step allocates.
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "server/devices/device_type.h"
#include "server/devices/sensor_filter.h"
#include "server/geometry/mesh/mesh_rays.h"

namespace takt {

/// Where a sensor is: in the world, or with a component or the flange of a robot.
struct SensorPlace {
  std::string at{};  ///< empty: the world
  Pose X_PS;         ///< sensor frame S in that frame
};

struct ScenarioLightBarrier {
  SensorPlace place;
  Vec3 from = Vec3::Zero(), to = Vec3::Zero();  ///< in S
  bool sees_grounds = false;
  SwitchParameters output;
};
struct ScenarioLightCurtain {
  SensorPlace place;
  double width_m = 0.0, pitch_m = 0.0;
  int beams = 0;
  bool sees_grounds = false;
  SwitchParameters output;
};
struct ScenarioProximityBox {
  SensorPlace place;
  Vec3 size_m = Vec3::Zero();
  double hysteresis_m = 0.0;
  bool sees_grounds = false;
  SwitchParameters output;
};
struct ScenarioDistanceSensor {
  SensorPlace place;
  double range_m = 0.0;
  bool sees_grounds = true;
  MeasuringParameters measuring;
  std::optional<double> switch_m;
  double hysteresis_m = 0.0;
  SwitchParameters output;
};
struct ScenarioIdentificationReader {
  SensorPlace place;
  double range_m = 0.0, hysteresis_m = 0.0;
  SwitchParameters output;
};
DeviceType light_barrier_type();
DeviceType light_curtain_type();
DeviceType proximity_box_type();
DeviceType distance_sensor_type();
DeviceType identification_reader_type();

struct SceneSensorParameters {
  enum class Kind : std::uint8_t { barrier, curtain, box, distance, reader };
  Kind kind = Kind::barrier;
  int device = -1;
  int component = -1, robot = -1;  ///< that carry it; both -1: the world
  Pose X_PS;
  Vec3 from = Vec3::Zero(),
       to = Vec3::
           Zero();  ///< barrier: the beam; curtain: the first one; distance: the ray, as long as the range
  Vec3 pitch = Vec3::Zero();  ///< curtain: from beam to beam
  int beams = 1;
  Vec3 half_m = Vec3::Zero();  ///< of the box
  double range_m = 0.0, hysteresis_m = 0.0;
  MeasuringParameters measuring;
  bool switches = true;  ///< distance: has a switching output
  SwitchParameters output;
  std::vector<int> seen;  ///< components
};

class SceneSensors final : public PartMechanism {
 public:
  struct Model {
    std::vector<SceneSensorParameters> sensors;
    std::vector<std::shared_ptr<const MeshRays>> meshes;  ///< by component; null: no sensor sees it
    std::vector<std::pair<const SharedMesh*, std::size_t>>
        shared;  ///< meshes made so far: of which component
  };
  static constexpr const char* kName = "sensors of bodies";
  enum BarrierSignal : int { clear, blocked };
  enum CurtainSignal : int { broken_beams = 2, muting };
  enum BoxSignal : int { detected };
  enum DistanceSignal : int { distance, in_range, near };
  enum ReaderSignal : int { part, present, reads };

  /// `model` outlives it.
  explicit SceneSensors(const Model& model);

  void start(ComponentInteraction& interaction) override;
  bool update(double h, const CellMotion& motion, CellPlant& plant,
              ComponentInteraction& interaction) override;
  void save(StateWriter& out) const override;
  void load(StateReader& in) override;

 private:
  struct Sensor {
    MeasuringFilter measuring;
    SwitchFilter output;
    double reads = 0.0;
    int read = -1;  ///< reader: the Part that it has
    // What follows from the motion.
    Pose X_WS;
    double nearest =
        0.0;  ///< barrier, curtain, box: 0 if a body is there, else 1; others: distance (m), or infinite
    int nearest_seen = -1;              ///< place in `seen`
    std::vector<double> values;         ///< the same for each body in `seen`
    std::vector<std::uint64_t> broken;  ///< curtain: the beams that each body in `seen` breaks, one a bit
  };

  void note_moved(const CellMotion& motion, const CellPlant& plant);
  double look(const SceneSensorParameters& p, const Sensor& sensor, int component,
              const CellMotion& motion) const;
  std::uint64_t broken_by(const SceneSensorParameters& p, const Sensor& sensor, int component,
                          const CellMotion& motion) const;
  /// Looks at what has moved; false: nothing has.
  bool look_again(const SceneSensorParameters& p, Sensor& sensor, const CellMotion& motion);
  void report(const SceneSensorParameters& p, Sensor& sensor, double h, bool looked, CellPlant& plant) const;

  const Model& model_;
  std::vector<Sensor> sensors_;
  std::vector<Pose> last_;   ///< by component: at the last look
  std::vector<char> moved_;  ///< by component: since then
  std::vector<int> moved_list_;
  std::vector<int> watched_;  ///< that were active in the last step
  bool all_ = true;           ///< everything is looked at
  bool starting_ = false;     ///< the next update is that of the initial state, ahead of the first step
};

}  // namespace takt
