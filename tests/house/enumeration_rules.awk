# Words of the enumerations stand once, in idl/takt_enumerations.idl. Usage: awk -f ... takt_enumerations.idl SOURCE...
# Prints FILE:LINE where a source compares with such a word, or lists two of one enumeration. Left out: enumerations whose
# words are words of JSON and of results too; comparisons with kinds of components, which are names of members too.
FILENAME ~ /takt_enumerations\.idl$/ {
  sub(/\/\/.*/, "")
  if (/^(@[^ ]* )*enum /) { enumeration = $0; sub(/.*enum /, "", enumeration); sub(/ .*/, "", enumeration); next }
  gsub(/@value\([0-9]+\)|[ ,]/, "")
  if (enumeration !~ /^(|ValueKind|SignalType|GripperSignal|ControlResult)$/ && /^[a-z_]+$/) words[$0] = words[$0] " " enumeration
  if (/^}/) enumeration = ""
  next
}
/^ *(\/\/|#|\*)/ { next }
{
  split("", seen)
  rest = $0
  while (match(rest, /["'][a-z_]+["']/)) {
    word = substr(rest, RSTART + 1, RLENGTH - 2)
    before = substr(rest, 1, RSTART - 1)
    rest = substr(rest, RSTART + RLENGTH)
    if (!(word in words) || before ~ /typeof [^'"]*$/) continue  # typeof has words of its own
    if ((before ~ /[=!]==? *$/ || rest ~ /^ *[=!]=/) && words[word] != " ComponentType") found = word
    n = split(words[word], of, " ")
    for (i = 1; i <= n; ++i)
      if (of[i] in seen && seen[of[i]] != word) found = seen[of[i]] ", " word
      else seen[of[i]] = word
  }
  if (found != "") print FILENAME ":" FNR ": words of an enumeration (" found "); take them from takt_enumerations.h"
  found = ""
}
