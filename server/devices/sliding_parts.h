#pragma once
// Parts that slide on the Ground that holds them, at levels of detail 1 and 2: a Part on a belt that runs against a stop stays
// there, Parts queue behind it, and a Ground that moves (a cylinder's gate, a pusher) pushes Parts aside.
//
// The substitute force holds a Part to one component and knows no second contact. Here, while a Ground or a belt moves, each
// Part that a Ground holds gets the velocity of its carrier, less what its contacts forbid:
//   u . n <= v . n   for each contact with normal n, from the Part to what it touches, which moves at v.
// The difference is the velocity at which the held pose slides in this step (Connections::slide). Grounds, and Parts that something
// else than a sliding connection holds, do not yield. Between two Parts the one that such a contact has stopped or pushed does not
// yield; else the one yields that runs into the other, so a belt does not push a Part along by another.
// There is no friction between the two sides of such a contact, and no turning: an edge that meets a stop does not turn the Part.
#include <vector>

#include "plant_models/plant_model.h"
#include "server/simulation/model/part_mechanism.h"

namespace takt {

class SlidingParts final : public PartMechanism {
 public:
  struct Model {};
  static constexpr const char* kName = "sliding parts";
  explicit SlidingParts(const Model& model) { static_cast<void>(model); }

  void start(ComponentInteraction& interaction) override;
  bool update(double h, const CellMotion& motion, CellPlant& plant,
              ComponentInteraction& interaction) override;
  void save(StateWriter&) const override {}
  void load(StateReader&) override {}

 private:
  /// A Part that a Ground holds.
  struct Slider {
    int part = -1;
    Vec3 carried_W = Vec3::Zero();  ///< velocity of its carrier, at its centre of mass
    Vec3 u_W = Vec3::Zero();
    Vec3 correction_W = Vec3::Zero();  ///< out of what it penetrates
    bool fixed = false;                ///< what does not yield has stopped or pushed it
  };
  struct Touch {
    std::size_t slider = 0;
    int other = -1;  ///< among the sliders, or -1: moves at v_W
    Vec3 v_W = Vec3::Zero(), n_W = Vec3::UnitX();
  };
  void find_sliders(const CellMotion& motion, const ComponentInteraction& interaction);
  void find_touches(double h, const CellMotion& motion, const ComponentInteraction& interaction);
  bool resolve(bool among_free);

  std::vector<Slider> sliders_;
  std::vector<int> slider_of_;  ///< by component, or -1
  std::vector<Touch> touches_;
};

}  // namespace takt
