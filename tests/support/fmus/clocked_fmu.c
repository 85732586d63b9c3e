/* An FMU of FMI 3.0 that runs with event mode alone. At each tick of its clock, at 0.1 s + k * 0.2 s, it takes its input:
     y = the input at the last tick, count = number of ticks, level = y after its own event at 0.52 s, before it 0.
   At each tick of the clock trigger held = sample, and the clock tock ticks. It ends at 3 s.
   Every call in the wrong mode is an error. */
#include <stdlib.h>
#include <string.h>

#include "fmi3Functions.h"

enum { CLOCK = 1, U, Y, COUNT, LEVEL, TRIGGER, SAMPLE, HELD, TOCK };
typedef struct {
  double u, y, time, sample, held;
  int count, ticked, triggered, in_event, had_event;
} Instance;

const char* fmi3GetVersion(void) { return "3.0"; }
fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                         fmi3Boolean logging, fmi3Boolean event_mode, fmi3Boolean early,
                                         const fmi3ValueReference required[], size_t n, fmi3InstanceEnvironment e,
                                         fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update) {
  (void)name, (void)token, (void)resources, (void)visible, (void)logging, (void)early, (void)required, (void)n, (void)e, (void)update;
  if (event_mode) return calloc(1, sizeof(Instance));
  log(e, fmi3Error, "error", "it has clocks and needs event mode");
  return NULL;
}
fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean d, fmi3Float64 tol, fmi3Float64 t, fmi3Boolean e,
                                       fmi3Float64 stop) {
  (void)c, (void)d, (void)tol, (void)t, (void)e, (void)stop;
  return fmi3OK;
}
fmi3Status fmi3ExitInitializationMode(fmi3Instance c) { ((Instance*)c)->in_event = 1; return fmi3OK; }
fmi3Status fmi3EnterEventMode(fmi3Instance c) {
  Instance* s = c;
  if (s->in_event) return fmi3Error;
  s->in_event = 1;
  return fmi3OK;
}
fmi3Status fmi3EnterStepMode(fmi3Instance c) {
  Instance* s = c;
  if (!s->in_event || s->ticked || s->triggered) return fmi3Error;
  s->in_event = 0;
  return fmi3OK;
}
fmi3Status fmi3SetClock(fmi3Instance c, const fmi3ValueReference v[], size_t n, const fmi3Clock x[]) {
  Instance* s = c;
  if (!s->in_event || n != 1 || (v[0] != CLOCK && v[0] != TRIGGER) || !x[0]) return fmi3Error;
  *(v[0] == CLOCK ? &s->ticked : &s->triggered) = 1;
  return fmi3OK;
}
fmi3Status fmi3GetClock(fmi3Instance c, const fmi3ValueReference v[], size_t n, fmi3Clock x[]) {
  const Instance* s = c;
  if (!s->in_event || n != 1 || v[0] != TOCK) return fmi3Error;
  x[0] = s->triggered;
  return fmi3OK;
}
fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean* again, fmi3Boolean* ended, fmi3Boolean* nominals,
                                    fmi3Boolean* values, fmi3Boolean* has_next, fmi3Float64* next) {
  Instance* s = c;
  if (!s->in_event) return fmi3Error;
  *again = s->ticked; /* once more, without a tick */
  *ended = *nominals = *values = *has_next = false;
  *next = 0.0;
  if (s->ticked) s->y = s->u, ++s->count, s->ticked = 0;
  if (s->triggered) s->held = s->sample, s->triggered = 0;
  if (s->time > 0.52) s->had_event = 1;
  return fmi3OK;
}
fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference v[], size_t n, const fmi3Float64 x[], size_t m) {
  Instance* s = c;
  if (!s->in_event || n != 1 || m != 1) return fmi3Error; /* the inputs are discrete */
  if (v[0] != U && !(v[0] == SAMPLE && s->triggered)) return fmi3Error;
  *(v[0] == U ? &s->u : &s->sample) = x[0];
  return fmi3OK;
}
fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference v[], size_t n, fmi3Float64 x[], size_t m) {
  const Instance* s = c;
  if (n != 1 || m != 1) return fmi3Error;
  x[0] = v[0] == Y ? s->y : v[0] == LEVEL ? (s->had_event ? s->y : 0.0) : v[0] == HELD ? s->held : s->u;
  return fmi3OK;
}
fmi3Status fmi3GetInt32(fmi3Instance c, const fmi3ValueReference v[], size_t n, fmi3Int32 x[], size_t m) {
  if (n != 1 || m != 1 || v[0] != COUNT) return fmi3Error;
  x[0] = ((Instance*)c)->count;
  return fmi3OK;
}
fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 t, fmi3Float64 h, fmi3Boolean no_set, fmi3Boolean* event, fmi3Boolean* ended,
                      fmi3Boolean* early, fmi3Float64* last) {
  Instance* s = c;
  (void)no_set;
  if (s->in_event) return fmi3Error;
  *event = t <= 0.52 && t + h > 0.52;
  *ended = t + h > 2.99;
  *early = false;
  *last = s->time = t + h;
  return fmi3OK;
}
