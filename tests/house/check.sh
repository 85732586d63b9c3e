#!/usr/bin/env bash
# The rules of the house that a compiler does not check. Usage: check.sh ROOT. Prints FILE:LINE: rule for each
# violation; exit code 1 if there is any.
set -euo pipefail
rules=$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")
cd "$1"
export LC_ALL=C

existing() { for folder in "$@"; do [[ -e $folder ]] && printf '%s\n' "$folder"; done; true; }
mapfile -t rooms < <(existing plant_models server client_lib idl config tests)
# The headers of the FMI standard are as they were published.
mapfile -t sources < <(find "${rooms[@]}" -type f \( -name '*.h' -o -name '*.cpp' \) ! -path 'server/fmu/standard/*' | sort)
mapfile -t texts < <(find . \( -name .git -o -path ./build -o -path ./server/fmu/standard -o -name .cache \) -prune -o -type f -print | sed 's|^\./||' |
  grep -Ev '\.(png|stl|STL|glb|obj|csv|json|svg)$' | sort)
mapfile -t documents < <(printf '%s\n' "${texts[@]}" | grep -E '^(docs/.*|config/.*|README)\.md$' || true)
listed=$(printf '%s\n' "${documents[@]}")
mapfile -t commented < <(printf '%s\n' "${texts[@]}" | grep -E '^(config|client_lib|docker)/.*\.(yaml|yml|lua|py|xml|service)$' || true)

violations=$(
  ((${#sources[@]} == 0)) || awk -f "$rules/include_rules.awk" "${sources[@]}"

  # Long files hide more than one idea.
  ((${#sources[@]} == 0)) || awk 'FNR == 601 { print FILENAME ":601: longer than 600 lines" }' "${sources[@]}"

  # A path of one person's machine works nowhere else.
  grep -nHEI '(^|[^A-Za-z0-9_.$}~-])/(work|home|root|Users)/[A-Za-z0-9_]' "${texts[@]}" /dev/null |
    sed -E 's/^([^:]+:[0-9]+):.*/\1: absolute path of one machine/' || true

  # Tests wait for conditions, never for time; unfinished work is an issue, not a comment. Programs of URScript wait in cycles.
  if [[ -d tests ]]; then
    grep -rnHE --include='*.cpp' --include='*.h' --exclude='urscript_*' '(sleep_for|sleep_until|[^a-z_]u?sleep) *\(' tests |
      sed -E 's/^([^:]+:[0-9]+):.*/\1: a test must not sleep/' || true
  fi
  ((${#sources[@]} == 0)) || grep -nHE '(TO''DO|FIX''ME|XX''X)' "${sources[@]}" |
    sed -E 's/^([^:]+:[0-9]+):.*/\1: unfinished work belongs in an issue/' || true

  # Words of comments, and headers that they name.
  every=$(find . \( -name .git -o -path ./build -o -name .cache \) -prune -o -type f -print | sed 's|^\./||')
  mapfile -t with_comments < <(printf '%s\n' "${texts[@]}" | grep -v '^tests/fuzz/corpus/' |
    grep -E '(\.(h|cpp|idl|js|mjs|lua|py|pyi|sh|cmake|yaml|yml|xml|service)|(^|/)(CMakeLists\.txt|[A-Za-z_-]+))$')
  awk -f "$rules/comment_rules.awk" - "${with_comments[@]}" <<<"$every"

  # Links between documents, documents that texts name, names of tests.
  awk -f "$rules/document_rules.awk" - "${documents[@]}" <<<"$every"
  mapfile -t tests < <(printf '%s\n' "${texts[@]}" | grep -E '(_test\.cpp|(^|/)(test_[^/]*|[^/]*_test)\.py)$' || true)
  awk -f "$rules/test_names.awk" "${tests[@]}" "${documents[@]}"
  { grep -noHE '[A-Za-z0-9_./-]*[A-Za-z0-9_]\.md\>' "${sources[@]}" "${commented[@]}" /dev/null || true; } |
    while IFS=: read -r file line name; do
      grep -qE "(^|/)$(basename "$name")\$" <<<"$listed" || echo "$file:$line: no such document: $name"
    done

  # Enumerations with their words, topics and QoS stand once: in idl/ and in topic_qos.h.
  mapfile -t product < <(existing plant_models server client_lib idl)
  if [[ -f idl/takt_enumerations.idl ]]; then
    enumerations=$(sed -nE 's/^enum ([A-Za-z]+).*/\1/p' idl/takt_enumerations.idl | paste -sd'|')
    grep -rnHE --include='*.h' --include='*.cpp' "enum (class )?($enumerations)\>" "${product[@]}" |
      sed -E 's/^([^:]+:[0-9]+):.*/\1: this enumeration is in takt_enumerations.h/' || true
    mapfile -t written < <(find "${product[@]}" -type f \( -name '*.h' -o -name '*.cpp' -o -name '*.js' -o -name '*.py' \) \
      ! -path 'idl/generator/*' ! -path '*/node_modules/*' | sort)
    awk -f "$rules/enumeration_rules.awk" idl/takt_enumerations.idl "${written[@]}"
    levels=$(sed -nE 's/^@topic\(.*name="([^"]*\/)?([a-z_]+)".*/\2/p' idl/*.idl | sort -u | paste -sd'|')
    grep -rnHE --include='*.h' --include='*.cpp' \
      "\"[^\" ]*/($levels)\"|\"(joint_commands|joint_states|joint_trajectory|robot_description|contact_pressures|tf_static)\"" \
      "${product[@]}" | grep -vE '^[^:]+:[0-9]+:(#include|.*///)' |
      sed -E 's/^([^:]+:[0-9]+):.*/\1: names of topics are in takt_topics.h/' || true
  fi
  # Requests and events stand once, in their tables; programs name them by type.
  words=$({ sed -nE 's/^\| \[`([a-z]+_[a-z_]+)`\].*/\1/p' docs/requests.md
    sed -nE 's/^\| `([a-z]+_[a-z_]+)`.*/\1/p' docs/events.md; } 2>/dev/null | sort -u | paste -sd'|')
  if [[ -n $words ]]; then
    grep -rnHE --include='*.h' --include='*.cpp' --include='*.py' "[\"']($words)[\"']" "${product[@]}" |
      sed -E 's/^([^:]+:[0-9]+):.*/\1: names of requests and codes of events are in takt_requests.idl, takt_events.idl/' || true
  fi
  ((${#product[@]} == 0)) || grep -rnHE --include='*.h' --include='*.cpp' '_(RELIABILITY|DURABILITY|HISTORY|OWNERSHIP|LIVELINESS)_QOS|liveliness\(\)\.' "${product[@]}" |
    grep -vE '^idl/transport/fastdds/(topic_qos|fastdds)\.h:' |
    sed -E 's/^([^:]+:[0-9]+):.*/\1: the QoS of topics is in topic_qos.h/' || true

  # The way of a command, as the architecture shows it: at most eleven functions, each in the file that it names.
  awk -F'`' '/^## / { way = /The way of a command/ } way && /^\| [0-9]+ \|/ { print FNR, ++n, $2, $4 }' docs/architecture.md |
    while read -r line number function file; do
      ((number <= 11)) || echo "docs/architecture.md:$line: the way of a command has more than eleven functions"
      { grep -qwF -- "${function%%::*}" "$file" && grep -qE "\<${function##*::}\(" "$file"; } ||
        echo "docs/architecture.md:$line: no function $function in $file"
    done

  # The README is one screen; its reader sees at once what to type.
  awk 'END { if (NR >= 120) print FILENAME ":120: the README has 120 lines or more" }' README.md
  for command in './dev demo' './dev test'; do
    head -n 40 README.md 2>/dev/null | grep -qF -- "$command" || echo "README.md:1: the first 40 lines do not show '$command'"
  done
)
if [[ -n $violations ]]; then
  printf '%s\n' "$violations"
  exit 1
fi
printf 'house rules hold: %d source files, %d texts\n' "${#sources[@]}" "${#texts[@]}"
