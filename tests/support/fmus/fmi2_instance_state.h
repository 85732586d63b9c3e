/* States of an FMU of FMI 2.0 as copies of its Instance, a struct without pointers that is defined where this is included. */
fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate* to) {
  if (*to == NULL) *to = malloc(sizeof(Instance));
  memcpy(*to, c, sizeof(Instance));
  return fmi2OK;
}
fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate from) {
  memcpy(c, from, sizeof(Instance));
  return fmi2OK;
}
fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate* state) {
  (void)c;
  free(*state);
  *state = NULL;
  return fmi2OK;
}
fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t* n) {
  (void)c, (void)state;
  *n = sizeof(Instance);
  return fmi2OK;
}
fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte to[], size_t n) {
  (void)c;
  memcpy(to, state, n);
  return fmi2OK;
}
fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte from[], size_t n, fmi2FMUstate* state) {
  (void)c;
  if (n != sizeof(Instance)) return fmi2Error;
  *state = malloc(n);
  memcpy(*state, from, n);
  return fmi2OK;
}
