/* A DC motor as a co-simulation FMU, of FMI 2.0 or 3.0 (FMI_VERSION):
     L di/dt = u - R i - k w,  J dw/dt = k i - d w - load,  dphi/dt = w.
   The parameter `trouble` makes it misbehave at the time `trouble_at`: see `enum`. */
#define _GNU_SOURCE
#include <fcntl.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>
#include <xmmintrin.h>

#include "harm.h"

#if FMI_VERSION == 2
#include "fmi2Functions.h"
#else
#include "fmi3Functions.h"
#endif

enum { none, crash, hang, allocate, control, discard, error, fatal, not_a_number, leave, write_file, network, chdir_away,
       others, abort_itself, stop_itself, block, close_all, big_file, garbage, print, thread };
enum { R, L, K, J, D, TROUBLE_AT, U, LOAD, CURRENT, SPEED, ANGLE, REALS };

typedef struct {
  double x[REALS];
  double time;
  int trouble, brake; /* brake: an input that stops the motor at once */
} Motor;
/* `result`: what a trouble found, as an output */
typedef struct {
  Motor m;
  int result;
} Instance;

static const double start_values[REALS] = {1.0, 0.01, 0.1, 0.001, 0.0001, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0};

static void set_up(Instance* s) {
  memset(s, 0, sizeof *s);
  memcpy(s->m.x, start_values, sizeof start_values);
}

static void rates(const Motor* m, const double y[3], double f[3]) {
  f[0] = (m->x[U] - m->x[R] * y[0] - m->x[K] * y[1]) / m->x[L];
  f[1] = (m->x[K] * y[0] - m->x[D] * y[1] - m->x[LOAD]) / m->x[J];
  f[2] = y[1];
}

static void advance(Motor* m, double h) {
  const int n = (int)ceil(h / 1e-4 - 1e-6);
  const double dt = h / n;
  for (int step = 0; step < n; ++step) {
    double y[3] = {m->x[CURRENT], m->x[SPEED], m->x[ANGLE]}, k[4][3], z[3];
    rates(m, y, k[0]);
    for (int stage = 1; stage < 4; ++stage) {
      for (int i = 0; i < 3; ++i) z[i] = y[i] + (stage == 3 ? dt : 0.5 * dt) * k[stage - 1][i];
      rates(m, z, k[stage]);
    }
    for (int i = 0; i < 3; ++i) y[i] += dt / 6.0 * (k[0][i] + 2.0 * k[1][i] + 2.0 * k[2][i] + k[3][i]);
    if (m->brake) y[1] = 0.0;
    m->x[CURRENT] = y[0], m->x[SPEED] = y[1], m->x[ANGLE] = y[2];
  }
  m->time += h;
}

/* Returns 0, or the number of the trouble that is an answer of the function. */
static int misbehave(Instance* s, double t) {
  if (s->m.trouble == none || t < s->m.x[TROUBLE_AT]) return 0;
  switch (s->m.trouble) {
    case crash: *(volatile int*)8 = 1; break;
    case hang:
      for (volatile int on = 1; on;) {
      }
      break;
    case allocate:
      for (;;) {
        char* more = malloc(1 << 20);
        memset(more, 1, 1 << 20);
      }
    case control: _mm_setcsr(_mm_getcsr() | 0x8040); break; /* denormal numbers are zero */
    case not_a_number: s->m.x[SPEED] = NAN; break;
    case leave: exit(7);
    case write_file: {
      const int file = open("/tmp/takt_fmu_was_here", O_CREAT | O_WRONLY, 0600);
      s->result = file >= 0;
      if (file >= 0) close(file);
      break;
    }
    case network: {
      const int inet = socket(AF_INET, SOCK_STREAM, 0);
      s->result = inet >= 0;
      if (inet >= 0) close(inet);
      break;
    }
    case chdir_away: s->result = chdir("/") == 0; break;
    case others: s->result |= harm_others(); break;
    case abort_itself: abort();
    case stop_itself: raise(SIGSTOP); break;
    case block:
      block_signals();
      for (volatile int on = 1; on;) {
      }
      break;
    case close_all:
      for (int i = 3; i < 256; ++i) close(i);
      break;
    case big_file: write_big_file(); break;
    case garbage: (void)!write(3, "what?", 5); break;
    case print: print_a_lot(); break;
    case thread: start_thread(); break;
    default: return s->m.trouble;
  }
  if (s->m.trouble == print || s->m.trouble == thread) s->m.trouble = none; /* once */
  return 0;
}

#if FMI_VERSION == 2
static fmi2CallbackLogger logger;
const char* fmi2GetTypesPlatform(void) { return "default"; }
const char* fmi2GetVersion(void) { return "2.0"; }
fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String* names) { (void)c, (void)on, (void)n, (void)names; return fmi2OK; }
fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources, const fmi2CallbackFunctions* f, fmi2Boolean visible, fmi2Boolean logging) {
  (void)name, (void)resources, (void)visible, (void)logging;
  if (type != fmi2CoSimulation || strcmp(guid, "motor") != 0) return NULL;
  logger = f->logger;
  Instance* s = malloc(sizeof *s);
  set_up(s);
  return s;
}
void fmi2FreeInstance(fmi2Component c) { free(c); }
fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean d, fmi2Real tol, fmi2Real t, fmi2Boolean e, fmi2Real stop) { (void)d, (void)tol, (void)e, (void)stop; ((Instance*)c)->m.time = t; return fmi2OK; }
fmi2Status fmi2EnterInitializationMode(fmi2Component c) { (void)c; return fmi2OK; }
fmi2Status fmi2ExitInitializationMode(fmi2Component c) { return misbehave(c, -1.0) ? fmi2Error : fmi2OK; }
fmi2Status fmi2Terminate(fmi2Component c) { (void)c; return fmi2OK; }
fmi2Status fmi2Reset(fmi2Component c) { set_up(c); return fmi2OK; }
fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference v[], size_t n, fmi2Real x[]) { for (size_t i = 0; i < n; ++i) x[i] = ((Instance*)c)->m.x[v[i]]; return fmi2OK; }
fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference v[], size_t n, const fmi2Real x[]) { for (size_t i = 0; i < n; ++i) ((Instance*)c)->m.x[v[i]] = x[i]; return fmi2OK; }
fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference v[], size_t n, fmi2Integer x[]) { for (size_t i = 0; i < n; ++i) x[i] = v[i] == 0 ? ((Instance*)c)->m.trouble : ((Instance*)c)->result; return fmi2OK; }
fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference v[], size_t n, const fmi2Integer x[]) { for (size_t i = 0; i < n; ++i) if (v[i] == 0) ((Instance*)c)->m.trouble = x[i]; return fmi2OK; }
fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference v[], size_t n, fmi2Boolean x[]) { (void)v; for (size_t i = 0; i < n; ++i) x[i] = ((Instance*)c)->m.brake; return fmi2OK; }
fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference v[], size_t n, const fmi2Boolean x[]) { (void)v; for (size_t i = 0; i < n; ++i) ((Instance*)c)->m.brake = x[i]; return fmi2OK; }
fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference v[], size_t n, fmi2String x[]) { (void)c, (void)v, (void)n, (void)x; return fmi2Error; }
fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference v[], size_t n, const fmi2String x[]) { (void)c, (void)v, (void)n, (void)x; return fmi2Error; }
fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean no_set) {
  Instance* s = c;
  (void)no_set;
  const int answer = misbehave(s, t);
  if (answer == discard) return fmi2Discard;
  if (answer == error || answer == fatal) {
    logger(NULL, "motor", fmi2Error, "error", "the brushes are worn at %g s", t);
    return answer == error ? fmi2Error : fmi2Fatal;
  }
  advance(&s->m, h);
  return fmi2OK;
}
fmi2Status fmi2CancelStep(fmi2Component c) { (void)c; return fmi2Error; }
fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind k, fmi2Status* x) { (void)c, (void)k, (void)x; return fmi2Discard; }
fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind k, fmi2Real* x) { (void)k; *x = ((Instance*)c)->m.time; return fmi2OK; }
fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind k, fmi2Integer* x) { (void)c, (void)k, (void)x; return fmi2Discard; }
fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind k, fmi2Boolean* x) { (void)c, (void)k; *x = fmi2False; return fmi2OK; }
fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind k, fmi2String* x) { (void)c, (void)k, (void)x; return fmi2Discard; }
#include "fmi2_instance_state.h"
#else
const char* fmi3GetVersion(void) { return "3.0"; }
fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging, fmi3Boolean event_mode, fmi3Boolean early, const fmi3ValueReference required[], size_t n, fmi3InstanceEnvironment e, fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update) {
  (void)name, (void)resources, (void)visible, (void)logging, (void)event_mode, (void)early, (void)required, (void)n, (void)e, (void)log, (void)update;
  if (strcmp(token, "motor") != 0) return NULL;
  Instance* s = malloc(sizeof *s);
  set_up(s);
  return s;
}
void fmi3FreeInstance(fmi3Instance c) { free(c); }
fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean d, fmi3Float64 tol, fmi3Float64 t, fmi3Boolean e, fmi3Float64 stop) { (void)d, (void)tol, (void)e, (void)stop; ((Instance*)c)->m.time = t; return fmi3OK; }
fmi3Status fmi3ExitInitializationMode(fmi3Instance c) { (void)c; return fmi3OK; }
fmi3Status fmi3Terminate(fmi3Instance c) { (void)c; return fmi3OK; }
fmi3Status fmi3Reset(fmi3Instance c) { (void)c; return fmi3Error; } /* so that takt has to instantiate it again */
fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference v[], size_t n, fmi3Float64 x[], size_t m) { (void)m; for (size_t i = 0; i < n; ++i) x[i] = ((Instance*)c)->m.x[v[i]]; return fmi3OK; }
fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference v[], size_t n, const fmi3Float64 x[], size_t m) { (void)m; for (size_t i = 0; i < n; ++i) ((Instance*)c)->m.x[v[i]] = x[i]; return fmi3OK; }
fmi3Status fmi3GetInt32(fmi3Instance c, const fmi3ValueReference v[], size_t n, fmi3Int32 x[], size_t m) { (void)m; for (size_t i = 0; i < n; ++i) x[i] = v[i] == 100 ? ((Instance*)c)->m.trouble : ((Instance*)c)->result; return fmi3OK; }
fmi3Status fmi3SetInt32(fmi3Instance c, const fmi3ValueReference v[], size_t n, const fmi3Int32 x[], size_t m) { (void)m; for (size_t i = 0; i < n; ++i) ((Instance*)c)->m.trouble = x[i]; (void)v; return fmi3OK; }
fmi3Status fmi3GetBoolean(fmi3Instance c, const fmi3ValueReference v[], size_t n, fmi3Boolean x[], size_t m) { (void)m, (void)v; for (size_t i = 0; i < n; ++i) x[i] = ((Instance*)c)->m.brake; return fmi3OK; }
fmi3Status fmi3SetBoolean(fmi3Instance c, const fmi3ValueReference v[], size_t n, const fmi3Boolean x[], size_t m) { (void)m, (void)v; for (size_t i = 0; i < n; ++i) ((Instance*)c)->m.brake = x[i]; return fmi3OK; }
#define NO_TYPE(NAME, TYPE) \
  fmi3Status fmi3Get##NAME(fmi3Instance c, const fmi3ValueReference v[], size_t n, TYPE x[], size_t m) { (void)c, (void)v, (void)n, (void)x, (void)m; return fmi3Error; } \
  fmi3Status fmi3Set##NAME(fmi3Instance c, const fmi3ValueReference v[], size_t n, const TYPE x[], size_t m) { (void)c, (void)v, (void)n, (void)x, (void)m; return fmi3Error; }
NO_TYPE(Float32, fmi3Float32)
NO_TYPE(Int8, fmi3Int8)
NO_TYPE(UInt8, fmi3UInt8)
NO_TYPE(Int16, fmi3Int16)
NO_TYPE(UInt16, fmi3UInt16)
NO_TYPE(UInt32, fmi3UInt32)
NO_TYPE(Int64, fmi3Int64)
NO_TYPE(UInt64, fmi3UInt64)
NO_TYPE(String, fmi3String)
fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 t, fmi3Float64 h, fmi3Boolean no_set, fmi3Boolean* event, fmi3Boolean* ended, fmi3Boolean* early, fmi3Float64* last) {
  Instance* s = c;
  (void)no_set;
  *event = *early = false;
  *ended = misbehave(s, t) == discard;
  if (!*ended) advance(&s->m, h);
  *last = *ended ? t : t + h;
  return fmi3OK;
}
fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState* to) { if (*to == NULL) *to = malloc(sizeof(Instance)); memcpy(*to, c, sizeof(Instance)); return fmi3OK; }
fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState from) { memcpy(c, from, sizeof(Instance)); return fmi3OK; }
fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState* state) { (void)c; free(*state); *state = NULL; return fmi3OK; }
fmi3Status fmi3SerializedFMUStateSize(fmi3Instance c, fmi3FMUState state, size_t* n) { (void)c, (void)state; *n = sizeof(Instance); return fmi3OK; }
fmi3Status fmi3SerializeFMUState(fmi3Instance c, fmi3FMUState state, fmi3Byte to[], size_t n) { (void)c; memcpy(to, state, n); return fmi3OK; }
fmi3Status fmi3DeserializeFMUState(fmi3Instance c, const fmi3Byte from[], size_t n, fmi3FMUState* state) { (void)c; if (n != sizeof(Instance)) return fmi3Error; *state = malloc(n); memcpy(*state, from, n); return fmi3OK; }
#endif
