# takt's IDL with the names of the ROS 2 mapping spelt out, for generators that do not know it (idlc): every struct
# goes into a module dds_ and gets an underscore at its end. fastddsgen does the same with -typeros2.
# Usage: awk -f ros2_names.awk FILE FILE   (the same file twice: names first, then the text)
function renamed(line,    result) {
  result = ""
  while (match(line, /[A-Za-z_][A-Za-z0-9_]*/)) {
    word = substr(line, RSTART, RLENGTH)
    result = result substr(line, 1, RSTART - 1) (word in structs ? structs[word] : word)
    line = substr(line, RSTART + RLENGTH)
  }
  return result line
}
FNR == NR {
  if (match($0, /struct +[A-Za-z_0-9]+/)) {
    name = substr($0, RSTART, RLENGTH)
    sub(/struct +/, "", name)
    plain = name
    sub(/^_/, "", plain)
    structs[name] = plain "_"
  }
  next
}
{ sub(/\/\/.*/, "") }
/#include/ { sub(/"ros2_msgs/, "\"ros2_names_ros2_msgs") ; print; next }
{
  line = $0
  # Types of another module carry it with them: name it there too.
  while (match(line, /[a-z_0-9]+::msg::[A-Za-z_0-9]+/)) {
    found = substr(line, RSTART, RLENGTH)
    split(found, parts, "::")
    line = substr(line, 1, RSTART - 1) parts[1] "::MSG::dds_::" parts[3] "@@" substr(line, RSTART + RLENGTH)
  }
  line = renamed(line)
  gsub(/_?@@/, "_", line)
  gsub(/::MSG::/, "::msg::", line)
  if (line ~ /^module msg \{/) line = line " module dds_ {"
  if (line ~ /struct.*\{/ && line !~ /\};/) in_struct = 1
  else if (line ~ /^\};/ && in_struct) in_struct = 0
  else if (line ~ /^\};/ && !closed) { line = "}; " line; closed = 1 }  # of the module msg
  else if (line ~ /^\};/) closed = 0
  print line
}
