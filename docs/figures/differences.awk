# awk -f differences.awk MINUEND.csv SUBTRAHEND.csv: positions of the Parts of the first file minus those of the
# second, as CSV; the largest distance of each Part goes to standard error.
BEGIN { FS = ","; OFS = ","; count = split("P C O B", part, " "); split("x y z", axis, " ") }
FNR == 1 {
  for (i = 1; i <= NF; ++i) place[FILENAME, $i] = i
  next
}
FNR == NR { # the first file is kept
  for (p = 1; p <= count; ++p)
    for (a = 1; a <= 3; ++a) kept[FNR, p, a] = $place[FILENAME, part[p] ".position." axis[a]]
  next
}
FNR == 2 {
  line = "time"
  for (p = 1; p <= count; ++p)
    for (a = 1; a <= 3; ++a) line = line OFS part[p] ".position." axis[a]
  print line
}
{
  line = $1
  for (p = 1; p <= count; ++p) {
    sum = 0
    for (a = 1; a <= 3; ++a) {
      d = kept[FNR, p, a] - $place[FILENAME, part[p] ".position." axis[a]]
      line = line OFS sprintf("%.9g", d)
      sum += d * d
    }
    if (sum > largest[p]) { largest[p] = sum; when[p] = $1 }
  }
  print line
}
END {
  for (p = 1; p <= count; ++p)
    printf "%s: largest difference of the levels %.3f mm at %.2f s\n", part[p], 1e3 * sqrt(largest[p]), when[p] > "/dev/stderr"
}
