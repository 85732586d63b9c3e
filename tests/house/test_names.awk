# Names of tests: documents name tests that exist (`Suite.Case`, `Suite.*`, `Suite.Part*`), and names have the words of
# docs/writing.md. Usage: awk -f test_names.awk SOURCE... DOCUMENT...; a source is C++ or Python. Output: one line
# FILE:LINE: rule, per violation.

function check_words(name) {
  gsub(/[A-Z]/, "_&", name)
  if (match(tolower(name) "_", /_(told|tells|nobody|somebody|anybody|who|whom|whoever|anew|no__?longer|broken|unfit)_/))
    print FILENAME ":" FNR ": '" substr(tolower(name), RSTART + 1, RLENGTH - 2) \
      "' in a test's name: things are reported, values are invalid, subjects are nouns"
}

FILENAME ~ /\.py$/ {
  if (match($0, /^ *def test_[a-z0-9_]+/)) check_words(substr($0, RSTART + 4, RLENGTH - 4))
  next
}

FILENAME ~ /\.cpp$/ {
  if (!match($0, /^ *(TYPED_)?TEST(_F|_P)?\(.*/)) next
  line = substr($0, RSTART)
  while (line !~ /\)/ && (getline rest) > 0) line = line rest
  sub(/^[^(]*\(/, "", line)
  sub(/\).*/, "", line)
  gsub(/[ \t]/, "", line)
  sub(/,/, ".", line)
  check_words(line)
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
