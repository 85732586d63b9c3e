# Rules of comments in sources (docs/writing.md): a noun as the subject, the present tense, and headers that exist.
# Usage: awk -f comment_rules.awk LIST SOURCE...; LIST has the paths of all files of the tree. Output: one line
# FILE:LINE: rule, per violation.

NR == FNR {
  for (path = $0; path != "";) {
    exists[path] = 1  # with any number of folders in front
    if (!sub(/^[^\/]*\//, "", path)) break
  }
  next
}

match($0, /(^|[^:"])\/\/.*/) {
  comment = substr($0, RSTART)

  # The pages of the core, of the transport and of the tests; the client and the programs say "you" to their users.
  if (FILENAME ~ /^(plant_models|server\/[a-z]+|idl|config|tests)\//) {
    count = split(tolower(comment), words, /[^a-z]+/)
    for (i = 1; i <= count; ++i) {
      if (words[i] ~ /^(who|whom|whoever|nobody|somebody|anybody)$/)
        print FILENAME ":" FNR ": '" words[i] "' is no noun: name the client, the component, the file"
      if (words[i] ~ /^(told|tells)$/) print FILENAME ":" FNR ": '" words[i] "': a flag is reported, a callback is called"
      if (words[i] == "anew" || (words[i] == "no" && words[i + 1] == "longer"))
        print FILENAME ":" FNR ": history belongs into the commit message"
    }
  }

  count = split(comment, words, /[^A-Za-z0-9_.\/<-]+/)
  for (i = 1; i <= count; ++i) {
    sub(/^\/+/, "", words[i])
    sub(/\.$/, "", words[i])
    if (words[i] !~ /^[a-z0-9_\/]+\.h$/ || words[i] ~ /^(takt|ros2|foxglove)_/) continue  # generated
    if (!(words[i] in exists)) print FILENAME ":" FNR ": no such header: " words[i]
  }
}
