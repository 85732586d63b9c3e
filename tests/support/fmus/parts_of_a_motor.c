/* Parts of a DC motor as co-simulation FMUs of FMI 2.0; WINDING or ROTOR is defined. The equations of one step are solved
   exactly for inputs that are held, so that tests can say what a master must get.
     winding: L di/dt = u - R i - k w; tau = k i, heat = R i^2     inputs u, w
     rotor:   J dw/dt = tau - d w                                  input tau */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2Functions.h"

#ifdef WINDING
enum { R, L, K, U, W, I, TAU, HEAT, REALS };
static const char token[] = "winding";
static const double start_values[REALS] = {1.0, 0.01, 0.1};
static void outputs(double* x) { x[TAU] = x[K] * x[I], x[HEAT] = x[R] * x[I] * x[I]; }
static void advance(double* x, double h) {
  const double end = (x[U] - x[K] * x[W]) / x[R];
  x[I] = end + (x[I] - end) * exp(-x[R] / x[L] * h);
}
#else
enum { J, D, TAU, W, REALS };
static const char token[] = "rotor";
static const double start_values[REALS] = {0.001, 0.0001};
static void outputs(double* x) { (void)x; }
static void advance(double* x, double h) {
  const double end = x[TAU] / x[D];
  x[W] = end + (x[W] - end) * exp(-x[D] / x[J] * h);
}
#endif

typedef struct {
  double x[REALS];
} Instance;

static void set_up(Instance* s) { memcpy(s->x, start_values, sizeof start_values); }

const char* fmi2GetTypesPlatform(void) { return "default"; }
const char* fmi2GetVersion(void) { return "2.0"; }
fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String* names) { (void)c, (void)on, (void)n, (void)names; return fmi2OK; }
#ifdef PYTHON
int Py_IsInitialized(void); /* of an interpreter that this library does not name, as those of PythonFMU */
#endif
fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources, const fmi2CallbackFunctions* f, fmi2Boolean visible, fmi2Boolean logging) {
  (void)name, (void)resources, (void)f, (void)visible, (void)logging;
  if (type != fmi2CoSimulation || strcmp(guid, token) != 0) return NULL;
#ifdef PYTHON
  if (Py_IsInitialized()) return NULL;
#endif
  Instance* s = calloc(1, sizeof *s);
  set_up(s);
  return s;
}
void fmi2FreeInstance(fmi2Component c) { free(c); }
fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean d, fmi2Real tol, fmi2Real t, fmi2Boolean e, fmi2Real stop) { (void)c, (void)d, (void)tol, (void)t, (void)e, (void)stop; return fmi2OK; }
fmi2Status fmi2EnterInitializationMode(fmi2Component c) { (void)c; return fmi2OK; }
fmi2Status fmi2ExitInitializationMode(fmi2Component c) { outputs(((Instance*)c)->x); return fmi2OK; }
fmi2Status fmi2Terminate(fmi2Component c) { (void)c; return fmi2OK; }
fmi2Status fmi2Reset(fmi2Component c) { set_up(c); return fmi2OK; }
fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference v[], size_t n, fmi2Real x[]) { for (size_t i = 0; i < n; ++i) x[i] = ((Instance*)c)->x[v[i]]; return fmi2OK; }
fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference v[], size_t n, const fmi2Real x[]) { for (size_t i = 0; i < n; ++i) ((Instance*)c)->x[v[i]] = x[i]; return fmi2OK; }
fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean no_set) {
  (void)t, (void)no_set;
  advance(((Instance*)c)->x, h);
  outputs(((Instance*)c)->x);
  return fmi2OK;
}
#define NO_TYPE(NAME, TYPE) \
  fmi2Status fmi2Get##NAME(fmi2Component c, const fmi2ValueReference v[], size_t n, TYPE x[]) { (void)c, (void)v, (void)n, (void)x; return fmi2Error; } \
  fmi2Status fmi2Set##NAME(fmi2Component c, const fmi2ValueReference v[], size_t n, const TYPE x[]) { (void)c, (void)v, (void)n, (void)x; return fmi2Error; }
NO_TYPE(Integer, fmi2Integer)
NO_TYPE(Boolean, fmi2Boolean)
NO_TYPE(String, fmi2String)
fmi2Status fmi2CancelStep(fmi2Component c) { (void)c; return fmi2Error; }
fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind k, fmi2Status* x) { (void)c, (void)k, (void)x; return fmi2Discard; }
fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind k, fmi2Real* x) { (void)c, (void)k, (void)x; return fmi2Discard; }
fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind k, fmi2Integer* x) { (void)c, (void)k, (void)x; return fmi2Discard; }
fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind k, fmi2Boolean* x) { (void)c, (void)k, (void)x; return fmi2Discard; }
fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind k, fmi2String* x) { (void)c, (void)k, (void)x; return fmi2Discard; }
#include "fmi2_instance_state.h"
