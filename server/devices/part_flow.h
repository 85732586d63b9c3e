#pragma once
// Sources that bring Parts of a pool into the cell, and sinks that take them out, while it runs.
//
// The Parts of a pool exist from the start: the number of states is constant. A parked Part is out of the cell: it
// is left out of motion, contact and search, and costs no time. Parts are used in turn: the one that was taken out
// first comes back first. Sinks act before sources, sources in their order, at the begin of a step; the Part is in
// the step's decision on connections already. Nothing depends on clocks: the same commands give the same Parts at
// the same steps.
#include <string>
#include <vector>

#include "server/devices/device_type.h"

namespace takt {

/// The keys of a source in a scenario.
struct ScenarioSource {
  std::string pool;
  Pose X_WB;                       ///< of the Part that enters
  Twist V_WB;                      ///< of its origin
  double period_s = 0.0;           ///< 0: one Part for each rising edge of `release`
  bool released_at_start = false;  ///< initial value of `release`
};
DeviceType source_type();

/// A box.
struct ScenarioSinkRegion {
  Pose X_WV;  ///< centre
  Vec3 size_m = Vec3::Zero();
};

/// The keys of a sink in a scenario.
struct ScenarioSink {
  std::vector<std::string> pools;            ///< empty: all
  std::string ground;                        ///< `at`: takes Parts that this Ground holds
  std::optional<ScenarioSinkRegion> region;  ///< takes Parts whose centre of mass is inside
  bool held = false;                         ///< also Parts that a Gripper or an attachment holds
};
DeviceType sink_type();

class PartFlow final : public PartMechanism {
 public:
  struct Source {
    int device = -1;
    std::size_t pool = 0;
    Pose X_WB;
    Twist V_WB;
    double period_s = 0.0;
    bool released_at_start = false;
  };
  struct Sink {
    int device = -1;
    std::vector<std::size_t> pools;
    int ground = -1;  ///< component; -1: any holder
    bool bounded = false;
    Pose X_WV;
    Vec3 half_m = Vec3::Zero();
    bool held = false;
  };
  struct Model {
    std::vector<PartPool> pools;
    std::vector<char> is_gripper;  ///< by component, filled at the first use
    std::vector<int> jaws;
    std::vector<Source> sources;
    std::vector<Sink> sinks;
  };
  static constexpr const char* kName = "part flow";
  enum SourceSignal : int { release, released, available, blocked, entered, kSourceSignals };
  enum SinkSignal : int { enabled, removed, taken, kSinkSignals };

  /// `model` outlives it.
  explicit PartFlow(const Model& model);

  void start(ComponentInteraction& interaction) override;
  void begin_step(StepControl& control) override;
  bool update(double, const CellMotion&, CellPlant&, ComponentInteraction&) override { return false; }
  std::span<const DeviceNotice> notices() const override { return notices_; }
  void save(StateWriter& out) const override;
  void load(StateReader& in) override;

 private:
  struct Flow {               ///< of a pool
    std::vector<int> parked;  ///< a ring: places of `first`, `first + 1` and so on hold the next Parts
    std::size_t first = 0, count = 0;
    std::vector<int> present;  ///< in the order in which they entered
    void park(int part);
    int take();
  };
  struct Order {             ///< of a source
    bool commanded = false;  ///< value of `release` in the step before
    bool due = false;        ///< a Part shall enter as soon as its place is free
    double next_s = 0.0;     ///< with a period: when the next one is due
  };
  void take_out(const Sink& sink, StepControl& control);
  bool leaves(const Sink& sink, int part, StepControl& control) const;
  void bring_in(std::size_t source, StepControl& control);
  bool place_is_free(const Source& source, int part, StepControl& control) const;

  const Model& model_;
  std::vector<Flow> flows_;    ///< by pool
  std::vector<Order> orders_;  ///< by source
  std::vector<DeviceNotice> notices_;
};

}  // namespace takt
