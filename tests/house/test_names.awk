# Tests that documents name exist: `Suite.Case`, `Suite.*`, `Suite.Part*`. Usage: awk -f test_names.awk SOURCE...
# DOCUMENT.... Output: one line FILE:LINE: rule, per violation.

FILENAME ~ /\.cpp$/ {
  if (!match($0, /^ *(TYPED_)?TEST(_F|_P)?\(.*/)) next
  line = substr($0, RSTART)
  while (line !~ /\)/ && (getline rest) > 0) line = line rest
  sub(/^[^(]*\(/, "", line)
  sub(/\).*/, "", line)
  gsub(/[ \t]/, "", line)
  sub(/,/, ".", line)
  names = names "\n" line
  next
}

{
  rest = $0
  while (match(rest, /`[A-Z][A-Za-z0-9]*\.[A-Z*][A-Za-z0-9*]*`/)) {
    name = substr(rest, RSTART + 1, RLENGTH - 2)
    rest = substr(rest, RSTART + RLENGTH)
    wanted = name
    sub(/\*.*/, "", wanted)  # up to the first *
    if (!index(names "\n", "\n" wanted (name ~ /\*/ ? "" : "\n"))) print FILENAME ":" FNR ": no such test: " name
  }
}
