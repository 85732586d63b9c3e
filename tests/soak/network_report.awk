# Report of network.sh on its phases (file `phases`: begin|end|kB of the server|what line.py did|name), from the seconds
# that the client reports. `reply` is the slowest answer to a request, `effect` the longest time from a command's sending
# until a state said that it was the newest applied (over a cut: with the cut). Exit code 1 when a phase was not as it must be.
function of_line(p, what) {
  match(line[p], what "=[0-9]+")
  return substr(line[p], RSTART + length(what) + 1, RLENGTH - length(what) - 1) + 0
}
function fault(text) {
  bad = 1
  print "  " text
}
BEGIN {
  while ((getline text < phases) > 0) {
    split(text, field, "|")
    n++; from[n] = field[1]; to[n] = field[2]; MB[n] = field[3] / 1000; line[n] = field[4]; name[n] = field[5]
  }
}
/^#.* time / { for (i = 2; i <= NF; ++i) column[$i] = i - 1 }
/^[0-9]/ { rows++; for (i = 1; i <= NF; ++i) v[rows, i] = $i }
function at(row, what) { return v[row, column[what]] }
function since(what) { return at(last, what) - at(before, what) }
END {
  printf "%-20s %8s %6s %6s %9s | %8s %6s %7s %6s %6s %8s %10s %8s %9s | %7s %6s\n", "phase", "packets", "lost", "twice",
    "overtaken", "states/s", "sent", "applied", "events", "missed", "answered", "unanswered", "reply ms",
    "effect ms", "steps/s", "MB"
  for (p = 1; p <= n; ++p) {
    first = 0; last = 0; states = 0; effect = 0; reply = 0; end_states = 0
    for (r = 1; r <= rows; ++r) {
      if (at(r, "time") <= from[p] || at(r, "time") > to[p]) continue
      if (!first) first = r
      last = r; states += at(r, "states")
      if (at(r, "effect_ms") > effect) effect = at(r, "effect_ms")
      if (at(r, "slowest_ms") > reply) reply = at(r, "slowest_ms")
      if (at(r, "time") > to[p] - 3) end_states += at(r, "states")
    }
    if (!first) { fault(name[p] ": no report of the client"); continue }
    before = first > 1 ? first - 1 : first
    seconds = at(last, "time") - at(before, "time")
    printf "%-20s %8d %6d %6d %9d | %8.0f %6d %7d %6d %6d %8d %10d %8.0f %9.0f | %7.0f %6.1f\n", name[p],
      of_line(p, "carried"), of_line(p, "lost") + of_line(p, "refused"), of_line(p, "twice"), of_line(p, "overtaken"),
      states / seconds, since("commands_sent"), since("commands_applied"), since("events"), since("events_missed"),
      since("answered"), since("unanswered"), reply, effect, since("steps") / seconds, MB[p]
    if (since("applied_twice") > 0) fault("a command was applied twice")
    if (since("applied_old") > 0) fault("a command was applied after a newer one")
    if (since("refused") > 0) fault("the server was given a command after a newer one, and refused it")
    if (since("schedule_resets") > 0) fault("the loop stalled: its schedule was re-based " since("schedule_resets") " times")
    if (since("events_missed") > 0 && name[p] != "cut for 10 s") fault("events were lost")
    if (end_states == 0) fault("the client is not served at the end of the phase")
    if (name[p] ~ /^clean/ && since("unanswered") > 0) fault("requests were not answered")
    if (line[p] ~ /late=[1-9]/ && of_line(p, "overtaken") == 0) fault("no packet was overtaken")
  }
  # The last thousand events and replies are kept, which takes some minutes to fill; beyond that nothing grows.
  printf "server's memory: %.1f MB after the first phase, %.1f MB after the last (goal: 2 MB more at most)\n", MB[1], MB[n]
  if (MB[n] - MB[1] > 2) fault("the server's memory grew")
  exit bad
}
