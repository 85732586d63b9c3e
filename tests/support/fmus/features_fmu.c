/* An FMU of FMI 3.0 with what others use more rarely: arrays of a chosen size, texts, enumerations, files among its resources,
   one instance in a process, a long first step, and a library without the functions that it does not need:
     y[i] = factor(mode) * u[i] + offset, with the offset of the file that the parameter `file` names. */
#define _GNU_SOURCE
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "fmi3Functions.h"

enum { N = 1, U, Y, MODE, FILE_NAME, LONG_START, LENGTH, MOST = 100 };

static struct {
  unsigned long long n;
  double u[MOST], y[MOST], offset, long_start_s;
  long long mode;
  char folder[1024], file[256];
  int instances, configured, configuring, steps;
} s = {.n = 2, .mode = 1, .file = "usual.txt"};

const char* fmi3GetVersion(void) { return "3.0"; }

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                         fmi3Boolean logging, fmi3Boolean event_mode, fmi3Boolean early,
                                         const fmi3ValueReference required[], size_t n, fmi3InstanceEnvironment e,
                                         fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update) {
  (void)name, (void)visible, (void)logging, (void)event_mode, (void)early, (void)required, (void)n, (void)update;
  if (s.instances++ > 0) {
    log(e, fmi3Error, "error", "there is an instance in this process");
    return NULL;
  }
  if (strcmp(token, "features") != 0) return NULL;
  snprintf(s.folder, sizeof s.folder, "%s", resources);
  return &s;
}

fmi3Status fmi3EnterConfigurationMode(fmi3Instance c) { (void)c; s.configuring = 1; return fmi3OK; }
fmi3Status fmi3ExitConfigurationMode(fmi3Instance c) { (void)c; s.configuring = 0, s.configured = 1; return fmi3OK; }

static void compute(void) {
  for (unsigned long long i = 0; i < s.n; ++i) s.y[i] = (s.mode == 2 ? -1.0 : 1.0) * s.u[i] + s.offset;
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean d, fmi3Float64 tol, fmi3Float64 t, fmi3Boolean e,
                                       fmi3Float64 stop) {
  (void)c, (void)d, (void)tol, (void)t, (void)e, (void)stop;
  char path[2048];
  snprintf(path, sizeof path, "%s%s", s.folder, s.file);
  FILE* file = fopen(path, "r");
  if (file == NULL || fscanf(file, "%lf", &s.offset) != 1) return fmi3Error;
  fclose(file);
  /* As programs for temporary files do. */
  const char* temporary = getenv("TMPDIR");
  snprintf(path, sizeof path, "%s/scratch", temporary != NULL ? temporary : "/tmp");
  file = fopen(path, "w");
  if (file == NULL) return fmi3Error;
  fclose(file);
  compute();
  return fmi3OK;
}
fmi3Status fmi3ExitInitializationMode(fmi3Instance c) { (void)c; return fmi3OK; }

fmi3Status fmi3SetUInt64(fmi3Instance c, const fmi3ValueReference v[], size_t n, const fmi3UInt64 x[], size_t m) {
  (void)c;
  if (!s.configuring || n != 1 || m != 1 || v[0] != N || x[0] > MOST) return fmi3Error;
  s.n = x[0];
  return fmi3OK;
}
fmi3Status fmi3SetInt64(fmi3Instance c, const fmi3ValueReference v[], size_t n, const fmi3Int64 x[], size_t m) {
  (void)c;
  if (n != 1 || m != 1 || v[0] != MODE) return fmi3Error;
  s.mode = x[0];
  return fmi3OK;
}
fmi3Status fmi3SetString(fmi3Instance c, const fmi3ValueReference v[], size_t n, const fmi3String x[], size_t m) {
  (void)c;
  if (n != 1 || m != 1 || v[0] != FILE_NAME) return fmi3Error;
  snprintf(s.file, sizeof s.file, "%s", x[0]);
  return fmi3OK;
}
fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference v[], size_t n, const fmi3Float64 x[], size_t m) {
  (void)c;
  if (n == 1 && m == 1 && v[0] == LONG_START) return s.long_start_s = x[0], fmi3OK;
  if (n != 1 || m != s.n || v[0] != U) return fmi3Error; /* an array is set as a whole */
  memcpy(s.u, x, m * sizeof *x);
  return fmi3OK;
}
fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference v[], size_t n, fmi3Float64 x[], size_t m) {
  (void)c;
  if (n == 1 && m == 1 && v[0] == LENGTH) return x[0] = (double)s.n, fmi3OK;
  if (n != 1 || m != s.n || v[0] != Y) return fmi3Error;
  memcpy(x, s.y, m * sizeof *x);
  return fmi3OK;
}

fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 t, fmi3Float64 h, fmi3Boolean no_set, fmi3Boolean* event, fmi3Boolean* ended,
                      fmi3Boolean* early, fmi3Float64* last) {
  (void)c, (void)no_set;
  if (s.steps++ == 0 && s.long_start_s > 0.0) {
    const struct timespec wait = {(time_t)s.long_start_s, (long)(1e9 * (s.long_start_s - (double)(time_t)s.long_start_s))};
    nanosleep(&wait, NULL);
  }
  *event = *ended = *early = false;
  *last = t + h;
  compute();
  return fmi3OK;
}
