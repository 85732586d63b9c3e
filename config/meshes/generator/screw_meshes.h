#pragma once
// Screws and gears: bolts and nuts with ISO metric threads, spur gears with involute teeth. Metres.
#include <filesystem>

#include "config/meshes/generator/solid.h"

namespace takt::meshes {

/// A hexagon bolt and its nut with the basic profile of ISO 68-1: flanks at 30 degrees to the normal of the
/// axis, a helix of one start. The nut has the basic profile, the bolt that profile moved inwards.
struct ScrewParameters {
  double diameter = 0.016;  ///< nominal
  double pitch = 0.002;     ///< also the lead
  double clearance = 1e-4;  ///< radial, between the profiles; the play along the axis is 2 tan(30 deg) of it
  double length = 0.026;    ///< of the bolt's thread, from the head
  double head_height = 0.010;    ///< (ISO 4017)
  double across_flats = 0.024;   ///< of head and nut (ISO 4032)
  double nut_height = 0.0148;    ///< (ISO 4032)
  double spacer_height = 0.010;  ///< of the ring between head and nut
  double contact_edge = 3.5e-4;  ///< of elements up and down the flanks
  /// Vertices around, multiples of 12: different ones, so that corners do not all pass corners at once.
  int bolt_columns = 84, nut_columns = 96;
};

/// M8, M10, M12, M16 or M20 with the coarse pitch of ISO 261. Throws std::invalid_argument for others.
ScrewParameters iso_metric(int size);

/// Origin: centre of the bearing face of the head, at z = 0; the thread goes up to z = length. A crest is at
/// angle 0 and z = 0.
Solid make_bolt(const ScrewParameters& p);
/// Origin: centre of the lower face; the axis is z. A groove is at angle 0 and z = 0: placed k pitches above
/// the bolt's origin it has the same play up and down.
Solid make_nut(const ScrewParameters& p);

/// A ring with the clearance hole of ISO 273 (medium, for M16), twice as wide as the thread: what the screw clamps.
/// Origin: centre of its lower face.
Solid make_spacer(const ScrewParameters& p);

/// Spur gear with involute teeth, full depth (ISO 53: addendum 1 module, dedendum 1.25 modules).
struct GearParameters {
  double module = 0.002;
  double pressure_angle = 0.3490658503988659;  ///< 20 degrees
  double width = 0.010;
  double bore_radius = 0.006;
  double backlash = 5e-5;       ///< by which each tooth is thinner on the pitch circle
  double pin_clearance = 2e-5;  ///< radial, of the pin in the bore
  double contact_edge = 5e-4;   ///< of elements along flanks and width
  int pinion_teeth = 17, wheel_teeth = 34;
};

/// Origin: centre of the lower face; the axis is z, the middle of a tooth at angle 0. Two gears at the
/// distance module (teeth_1 + teeth_2) / 2 mesh if one is turned by half a tooth against the other.
Solid make_gear(const std::string& name, int teeth, const GearParameters& p);

/// A pin for the bores, twice as long as the gears are wide. Origin: centre of its lower end.
Solid make_gear_pin(const GearParameters& p);

/// bolt.obj, nut.obj, spacer.obj, pinion.obj, wheel.obj and gear_pin.obj.
void make_screw_meshes(const std::filesystem::path& directory, const ScrewParameters& screw = {},
                       const GearParameters& gear = {});

}  // namespace takt::meshes
