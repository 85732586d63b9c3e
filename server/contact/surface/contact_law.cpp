#include "server/contact/surface/contact_law.h"

#include <cmath>
#include <stdexcept>
#include <string>

namespace takt {
namespace {

void check(bool good, const char* name, double value, const char* allowed) {
  if (!good)
    throw std::invalid_argument(std::string("contact law: ") + name + " is " + std::to_string(value) +
                                "; it must be " + allowed);
}

}  // namespace

void check_contact_law(const ContactLaw& law) {
  const auto positive = [](const char* name, double value) {
    check(value > 0.0 && std::isfinite(value), name, value, "positive");
  };
  const auto not_negative = [](const char* name, double value) {
    check(value >= 0.0 && std::isfinite(value), name, value, "zero or positive");
  };
  positive("stiffness_Pa_per_m", law.stiffness_Pa_per_m);
  check(law.linear_depth_m > 0.0, "linear_depth_m", law.linear_depth_m, "positive");
  not_negative("areal_damping_N_s_per_m3", law.areal_damping_N_s_per_m3);
  positive("damping_depth_m", law.damping_depth_m);
  not_negative("friction", law.friction);
  positive("friction_velocity_m_per_s", law.friction_velocity_m_per_s);
  if (law.friction_law == FrictionLaw::stick) {
    positive("tangential_stiffness_Pa_per_m", law.tangential_stiffness_Pa_per_m);
    not_negative("tangential_damping_N_s_per_m3", law.tangential_damping_N_s_per_m3);
  }
}

}  // namespace takt
