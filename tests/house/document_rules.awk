# Rules of documents: links, headings and files they name exist, every page is reached from docs/README.md, decisions are
# complete and have a number of their own, table cells are short. Usage: awk -f document_rules.awk LIST DOCUMENT...; LIST has the paths of all
# files of the tree. Output: one line FILE:LINE: rule, per violation.

function complain(rule) { print FILENAME ":" FNR ": " rule }

# A path without "." and "..", relative to the root; "" if it leaves the tree.
function clean(path,    parts, count, i, depth, kept, result) {
  count = split(path, parts, "/")
  depth = 0
  for (i = 1; i <= count; ++i) {
    if (parts[i] == "" || parts[i] == ".") continue
    if (parts[i] != "..") kept[++depth] = parts[i]
    else if (--depth < 0) return ""
  }
  for (i = 1; i <= depth; ++i) result = result (i > 1 ? "/" : "") kept[i]
  return result
}

# The name of a heading in a link.
function anchor(heading) {
  sub(/^#+ */, "", heading)
  gsub(/[^A-Za-z0-9 _-]/, "", heading)
  gsub(/ /, "-", heading)
  return tolower(heading)
}

function end_of_decision() {
  if (decision != "" && (parts_of_decision !~ /Context:.*Consequence:/))
    print "docs/decisions.md:" decision_line ": decision " decision " lacks context or consequence"
  decision = parts_of_decision = ""
}

NR == FNR {
  exists[$0] = 1
  for (path = $0; sub(/\/[^\/]*$/, "", path);) exists[path] = 1  # its folders
  name = $0
  sub(/.*\//, "", name)
  exists["*/" name] = 1
  next
}
FNR == 1 { folder = FILENAME; if (!sub(/[^\/]*$/, "", folder)) folder = ""; code = 0 }
/^```/ { code = !code }
code { next }
/^#/ { headings[FILENAME "#" anchor($0)] = 1 }

FILENAME == "docs/decisions.md" && /^(#|\*\*[0-9]+\. )/ {
  end_of_decision()
  if (/^\*\*/) {
    decision = $1
    gsub(/[^0-9]/, "", decision)
    decision_line = FNR
    if (decision in numbers) complain("decision " decision " is also in line " numbers[decision])
    numbers[decision] = FNR
  }
}
decision != "" { parts_of_decision = parts_of_decision " " $0 }

{
  rest = $0
  while (match(rest, /\]\([^) ]+\)/)) {
    target = substr(rest, RSTART + 2, RLENGTH - 3)
    rest = substr(rest, RSTART + RLENGTH)
    if (target ~ /^[a-z]+:/) continue
    heading = target
    if (!sub(/^[^#]*#/, "", heading)) heading = ""
    sub(/#.*/, "", target)
    path = target == "" ? FILENAME : clean(folder target)
    if (!(path in exists)) complain("dead link: " target)
    else {
      linked[FILENAME, ++links[FILENAME]] = path
      if (heading != "") { wanted[++wishes] = path "#" heading; place[wishes] = FILENAME ":" FNR }
    }
  }
}

# A cell holds at most three short sentences.
FILENAME !~ /^docs\/(requests|events|topics|scenes|scenario_reference|signals|lua)\.md$/ && /^\|/ {
  count = split($0, cells, "|")
  for (i = 1; i <= count; ++i) if (length(cells[i]) > 300) complain("a cell of " length(cells[i]) " characters; at most 300")
}

# Files of the repository that a page names: whole paths, and bare names of headers.
{
  rest = $0
  while (match(rest, /`[A-Za-z0-9_.\/-]+`/)) {
    path = substr(rest, RSTART + 1, RLENGTH - 2)
    rest = substr(rest, RSTART + RLENGTH)
    sub(/\/$/, "", path)
    if (path ~ /^(plant_models|server|client_lib|idl|config|tests|docker|cmake|docs)\/[a-z]/ && path !~ /^config\/meshes\/cells/ && path !~ /[A-Z][A-Z]/)
      found = path in exists
    else found = path !~ /^[a-z_]+\.h$/ || ("*/" path) in exists
    if (!found) complain("no such file: " path)
  }
}

END {
  end_of_decision()
  for (i = 1; i <= wishes; ++i) if (!(wanted[i] in headings)) print place[i] ": no such heading: " wanted[i]
  queue[1] = "docs/README.md"
  reached[queue[1]] = count = 1
  for (i = 1; i <= count; ++i)
    for (j = 1; j <= links[queue[i]]; ++j) {
      page = linked[queue[i], j]
      if (!(page in reached)) { reached[page] = 1; queue[++count] = page }
    }
  for (i = 2; i < ARGC; ++i)
    if (ARGV[i] ~ /^docs\// && !(ARGV[i] in reached)) print ARGV[i] ":1: no page that docs/README.md leads to names it"
}
