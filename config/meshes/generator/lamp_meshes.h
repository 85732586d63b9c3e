#pragma once
// An E27 lamp and its socket: round (knuckle) threads of IEC 60061. Metres.
#include <filesystem>

#include "config/meshes/generator/solid.h"

namespace takt::meshes {

struct LampParameters {
  double crest_radius = 0.013225, root_radius = 0.01213;  ///< of the cap
  double pitch = 0.0036286;                               ///< 7 turns per inch
  double clearance = 2e-4;                                ///< radial, of the cap in the socket
  double thread_length = 0.014;                           ///< of cap and socket
  double contact_edge = 2.9e-4;                           ///< of elements up and down the flanks
  int columns = 60;                                       ///< vertices around the cap; the socket has 12 more
};

/// Height of the cap's thread above the origin.
double thread_height(const LampParameters& p);
/// Play along the axis up and down from the middle, to where the flanks touch.
double axial_play(const LampParameters& p);

/// Cap and bulb. Origin: centre of the contact below, which is flat; a crest is at angle 0 at thread_height.
Solid make_lamp(const LampParameters& p);
/// A threaded tube. Origin: centre of the lower face. A groove is at angle 0 and z = 0.
Solid make_lamp_socket(const LampParameters& p);
/// The contact in the socket, a disc. Origin: centre of the top face.
Solid make_lamp_contact(const LampParameters& p);

/// lamp.obj, lamp_socket.obj and lamp_contact.obj.
void make_lamp_meshes(const std::filesystem::path& directory, const LampParameters& p = {});

}  // namespace takt::meshes
