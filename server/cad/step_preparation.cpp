#include "server/cad/step_preparation.h"

#include <STEPCAFControl_Controller.hxx>

#include "server/cad/step_densities.h"
#include "server/cad/step_spheres.h"

namespace takt::cad {

namespace {

/// OpenCASCADE asks it for the reader of each file, with the file's model.
class Controller : public STEPCAFControl_Controller {
 public:
  Handle(Transfer_ActorOfTransientProcess)
      ActorRead(const Handle(Interface_InterfaceModel) & model) const override {
    if (!model.IsNull()) {
      state_densities_in_g_per_cm3(*model);
      turn_poles_from_borders(*model);
    }
    return STEPCAFControl_Controller::ActorRead(model);
  }
  DEFINE_STANDARD_RTTI_INLINE(Controller, STEPCAFControl_Controller)
};

}  // namespace

void prepare_models_of_transfers() {
  STEPCAFControl_Controller::Init();
  static const bool recorded = (Handle(Controller)(new Controller)->AutoRecord(), true);
  (void)recorded;
}

}  // namespace takt::cad
