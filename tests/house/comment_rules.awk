# Rules of comments (docs/writing.md): a noun as the subject, the present tense, and headers that exist.
# Usage: awk -f comment_rules.awk LIST TEXT...; LIST has the paths of all files of the tree. Output: one line
# FILE:LINE: rule, per violation. Comments are // in C++, IDL and JavaScript, -- in Lua, <!-- --> in XML, # and
# docstrings in Python, and # in all other files.

NR == FNR {
  for (path = $0; path != "";) {
    exists[path] = 1  # with any number of folders in front
    if (!sub(/^[^\/]*\//, "", path)) break
  }
  next
}

FNR == 1 { open = "" }  # the end of the docstring or the XML comment that the line is in

# The comment of a line, or "".
function comment_of(line, begin, end) {
  if (FILENAME ~ /\.(h|cpp|idl|m?js)$/) return match(line, /(^|[^:"'`])\/\/.*/) ? substr(line, RSTART) : ""
  if (FILENAME ~ /\.lua$/) return match(line, /--.*/) ? substr(line, RSTART) : ""
  begin = FILENAME ~ /\.xml$/ ? "<!--" : "\"\"\""
  end = FILENAME ~ /\.xml$/ ? "-->" : "\"\"\""
  if (FILENAME ~ /\.(py|xml)$/) {
    if (open == "" && index(line, begin)) {
      line = substr(line, index(line, begin) + length(begin))
      if (!index(line, end)) open = end
      return line
    }
    if (open != "") {
      if (index(line, open)) open = ""
      return line
    }
    if (FILENAME ~ /\.xml$/) return ""
  }
  return match(line, /(^|[ \t])#.*/) ? substr(line, RSTART) : ""
}

(comment = comment_of($0)) != "" {
  count = split(tolower(comment), words, /[^a-z]+/)
  for (i = 1; i <= count; ++i) {
    if (words[i] ~ /^(who|whom|whoever|nobody|somebody|anybody)$/)
      print FILENAME ":" FNR ": '" words[i] "' is no noun: name the client, the component, the file"
    if (words[i] ~ /^(told|tells)$/) print FILENAME ":" FNR ": '" words[i] "': a flag is reported, a callback is called"
    if (words[i] == "anew" || (words[i] == "no" && words[i + 1] == "longer"))
      print FILENAME ":" FNR ": history belongs into the commit message"
  }

  count = split(comment, words, /[^A-Za-z0-9_.\/<-]+/)
  for (i = 1; i <= count; ++i) {
    sub(/^\/+/, "", words[i])
    sub(/\.$/, "", words[i])
    if (words[i] !~ /^[a-z0-9_\/]+\.h$/ || words[i] ~ /^(takt|ros2|foxglove)_/) continue  # generated
    if (!(words[i] in exists)) print FILENAME ":" FNR ": no such header: " words[i]
  }
}
