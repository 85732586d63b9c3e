#pragma once
// Parameters of surface contact (thesis 2.2.2, 5.1.1): of a component, and of a pair.
//
// The printed thesis uses the letter d twice: (2.19) means the areal damping, (5.15) the depth of the elastic
// layer.
#include <cstdint>
#include <limits>

namespace takt {

enum class FrictionLaw : std::uint8_t {
  regularised,  ///< (2.21): no force without sliding, so held components creep
  stick,  ///< tangential spring per element that slips at mu times the normal force; holds without creep
};

/// How the penetration of elements is found, and which layers yield.
enum class DepthSource : std::uint8_t {
  polygonal,       ///< distance from the Target's triangles
  distance_field,  ///< from its distance field (DistanceField); one layer for both sides
  pressure_field,  ///< the same; each side has a layer of its own, at the same pressure (FieldElements)
};

/// Which of the two sides of a pair carries the contact elements, as far as the user chose.
enum class ContactRole : std::uint8_t { by_rule, base, target };

struct ContactParameters {
  double youngs_modulus_Pa = 1e6;            ///< E of (2.17)
  double poisson_ratio = 0.3;                ///< nu of (2.17), in [0, 0.5)
  double layer_depth_m = 0.001;              ///< b of (2.16)
  double areal_damping_N_s_per_m3 = 2.5e5;   ///< d of (2.19)
  double damping_depth_m = 2e-6;             ///< u_d of (2.19): damping grows linearly up to this penetration
  double friction = 0.3;                     ///< mu of (2.21)
  double friction_velocity_m_per_s = 0.001;  ///< v_eps of (2.21)
  FrictionLaw friction_law = FrictionLaw::stick;
  DepthSource depth = DepthSource::polygonal;
  /// Stick law: tangential stiffness over normal stiffness of an element (Mindlin: about 0.8 for nu = 0.3),
  /// and tangential damping over areal damping.
  double tangential_stiffness_ratio = 0.8;
  double tangential_damping_ratio = 0.5;
  bool operator==(const ContactParameters&) const = default;
};

/// Constants of the force elements of a pair.
struct ContactLaw {
  static constexpr double kHardening = 1000.0;
  double stiffness_Pa_per_m = 0.0;  ///< K / b, (2.16) and (2.17)
  /// (2.16) holds up to this penetration. Beyond it, with s = u / linear_depth_m - 1, the pressure
  /// additionally grows by kHardening K/b linear_depth_m s^4, so that bodies do not pass through walls; like
  /// (2.16) it has an energy. For a pair it is a share of the thinner wall (PolygonalContact::kLinearShare).
  double linear_depth_m = std::numeric_limits<double>::infinity();
  double areal_damping_N_s_per_m3 = 0.0;
  double damping_depth_m = 0.0;
  double friction = 0.0;
  double friction_velocity_m_per_s = 0.0;
  FrictionLaw friction_law = FrictionLaw::regularised;
  double tangential_stiffness_Pa_per_m = 0.0;
  double tangential_damping_N_s_per_m3 = 0.0;
};

/// (2.17): K of a linear elastic layer that cannot move sideways.
constexpr double layer_modulus(double youngs_modulus_Pa, double poisson_ratio) {
  return (1.0 - poisson_ratio) / ((1.0 + poisson_ratio) * (1.0 - 2.0 * poisson_ratio)) * youngs_modulus_Pa;
}

constexpr ContactLaw contact_law(const ContactParameters& p) {
  ContactLaw law;
  law.stiffness_Pa_per_m = layer_modulus(p.youngs_modulus_Pa, p.poisson_ratio) / p.layer_depth_m;
  law.areal_damping_N_s_per_m3 = p.areal_damping_N_s_per_m3;
  law.damping_depth_m = p.damping_depth_m;
  law.friction = p.friction;
  law.friction_velocity_m_per_s = p.friction_velocity_m_per_s;
  law.friction_law = p.friction_law;
  law.tangential_stiffness_Pa_per_m = p.tangential_stiffness_ratio * law.stiffness_Pa_per_m;
  law.tangential_damping_N_s_per_m3 = p.tangential_damping_ratio * p.areal_damping_N_s_per_m3;
  return law;
}

/// The elastic pressure of a law at a penetration, its slope, and its energy per area.
struct ElasticLayer {
  double pressure_Pa, slope_Pa_per_m, energy_J_per_m2;
};
inline ElasticLayer elastic_layer(const ContactLaw& law, double depth_m) {
  ElasticLayer layer{law.stiffness_Pa_per_m * depth_m, law.stiffness_Pa_per_m,
                     0.5 * law.stiffness_Pa_per_m * depth_m * depth_m};
  if (!(depth_m > law.linear_depth_m)) return layer;
  const double s = depth_m / law.linear_depth_m - 1.0, s3 = s * s * s;
  const double hardness = ContactLaw::kHardening * law.stiffness_Pa_per_m;
  layer.pressure_Pa += hardness * law.linear_depth_m * s3 * s;
  layer.slope_Pa_per_m += 4.0 * hardness * s3;
  layer.energy_J_per_m2 += 0.2 * hardness * law.linear_depth_m * law.linear_depth_m * s3 * s * s;
  return layer;
}

/// Throws std::invalid_argument with the name of the value, the value, and the values allowed.
void check_contact_law(const ContactLaw& law);

}  // namespace takt
