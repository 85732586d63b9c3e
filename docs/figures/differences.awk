# awk -v positions=FILE -f differences.awk LEVEL3.csv LEVEL2.csv: what section 5.2.2 of the thesis compares. Positions of
# the Parts at level 3 minus those at level 2 go to FILE as CSV; the numbers to standard output.
function abs(x) { return x < 0 ? -x : x }
function column(name) {
  if (!((FILENAME, name) in place)) {
    printf "differences.awk: %s has no column '%s'\n", FILENAME, name > "/dev/stderr"
    failed = 1
    exit 1
  }
  return place[FILENAME, name]
}
BEGIN {
  FS = ","; OFS = ","
  parts = split("P C O B", part, " ")
  axes = split("x y z", axis, " ")
  # Curves compared, and what they are.
  curves = split("robots.Robot2.flange_force.z robots.Robot2.effort.shoulder_lift_joint robots.Robot2.effort.elbow_joint", curve, " ")
  split("force on the flange of Robot2 in z;torque of axis 2 of Robot2;torque of axis 3 of Robot2", title, ";")
  split("N;N m;N m", unit, ";")
  # Grips: gripper, Part, width of the open jaws falls after the command.
  grips = split("Gripper1 P Gripper2 C Gripper1 O Gripper2 B", grip, " ") / 2
}
FNR == 1 {
  for (i = 1; i <= NF; ++i) place[FILENAME, $i] = i
  next
}
FNR == NR { # level 3 is kept
  for (p = 1; p <= parts; ++p)
    for (a = 1; a <= axes; ++a) kept[FNR, p, a] = $(column("components." part[p] ".position." axis[a]))
  for (c = 1; c <= curves; ++c) kept_curve[FNR, c] = $(column(curve[c]))
  if ($1 <= 9.8 + 1e-6) load_3 = $(column("robots.Robot2.flange_force.z"))
  for (g = 1; g <= grips; ++g) {
    gripper = grip[2 * g - 1]
    left = $(column("contacts.contacts." gripper "/left_jaw-" grip[2 * g] ".normal_force"))
    right = $(column("contacts.contacts." gripper "/right_jaw-" grip[2 * g] ".normal_force"))
    width = $(column("grippers." gripper ".width"))
    if (!(g in reached)) {
      if (FNR > 2 && width < before[g] - 1e-6) {
        if (!closing[g]) begun[g] = last_time
        closing[g] = 1
      } else {
        closing[g] = 0
      }
      if (left > 0 && right > 0) reached[g] = $1
    }
    before[g] = width
  }
  last_time = $1
  next
}
FNR == 2 {
  line = "time"
  for (p = 1; p <= parts; ++p)
    for (a = 1; a <= axes; ++a) line = line OFS "components." part[p] ".position." axis[a]
  print line > positions
}
{
  line = $1
  for (p = 1; p <= parts; ++p) {
    sum = 0
    for (a = 1; a <= axes; ++a) {
      d = kept[FNR, p, a] - $(column("components." part[p] ".position." axis[a]))
      line = line OFS sprintf("%.9g", d)
      sum += d * d
    }
    if (sum > largest[p]) { largest[p] = sum; when[p] = $1 }
    end[p] = sum
  }
  print line > positions
  rows = FNR
  time[FNR] = $1
  if ($1 <= 9.8 + 1e-6) load_2 = $(column("robots.Robot2.flange_force.z"))
  for (c = 1; c <= curves; ++c) {
    value = $(column(curve[c]))
    if (abs(value) > peak[c]) peak[c] = abs(value)
    apart[FNR, c] = abs(kept_curve[FNR, c] - value)
  }
}
END {
  if (failed) exit 1
  print "Level of detail 3 against level 2 (thesis 5.2.2)"
  printf "  force of Gripper2 and C at rest on the flange at 9.8 s: level 2 %.4f N, level 3 %.4f N, (5.21) 34.3233 N\n", \
    -load_2, -load_3
  for (g = 1; g <= grips; ++g)
    printf "  %s closes on %s at %.2f s, both jaws press at %.2f s: %.2f s later\n", grip[2 * g - 1], grip[2 * g], begun[g], \
      reached[g], reached[g] - begun[g]
  for (p = 1; p <= parts; ++p)
    printf "  position of %s: largest difference %.3f mm at %.2f s, at the end %.3f mm (thesis: 0.25 mm)\n", part[p], \
      1e3 * sqrt(largest[p]), when[p], 1e3 * sqrt(end[p])
  for (c = 1; c <= curves; ++c) {
    near = 0
    text = ""
    first = last = -1
    for (r = 2; r <= rows; ++r) {
      if (apart[r, c] <= 0.01 * peak[c]) { ++near; continue }
      if (first >= 0 && time[r] - last > 0.3) {
        text = text sprintf(" %.2f-%.2f", first, last)
        first = -1
      }
      if (first < 0) first = time[r]
      last = time[r]
    }
    if (first >= 0) text = text sprintf(" %.2f-%.2f", first, last)
    printf "  %s: the levels are within 1 %% of its largest (%.1f %s) for %.1f %% of the time; not at%s s\n", title[c], \
      peak[c], unit[c], 100 * near / (rows - 1), text
  }
}
