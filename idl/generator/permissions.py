"""What each role of a secured cell may write and read: permissions_ROLE.xml of DDS Security."""

# What a role is, its rule, and the topics that it may write, or may not: "all", those of "clients", or none. The rule
# holds for reading all topics too.
ROLES = {
    "server": ("The server of a cell: writes and reads all.", "allow_rule", "all"),
    "controller": ("A controller: writes commands and requests, reads all.", "allow_rule", "clients"),
    "observer": ("An observer: reads all, writes nothing.", "allow_rule", None),
    "stranger": ("An identity of the same authority that is permitted nothing: to show that it gets nothing.",
                 "deny_rule", "all"),
}
ALL = "<topics><topic>*</topic></topics>"
REQUESTS_OF_SERVICES = "rq/*"  # services and actions of ROS 2 have no @topic


def written_by_clients(reader):
    """Patterns of the topics, each once. Cells, robots, grippers and devices have any name."""
    patterns = []
    for file in reader.files.values():
        for one in file.structs:
            for note in one.annotations:
                if note.name != "topic" or note.arguments["by"] != "client":
                    continue
                pattern = "rt/*" + note.arguments["name"].rpartition("}")[2]
                if pattern not in patterns:
                    patterns.append(pattern)
    return patterns + [REQUESTS_OF_SERVICES]


def publish(written, reader):
    if written is None:
        return ""
    if written == "all":
        return f"        <publish>{ALL}</publish>\n"
    rows = "".join(f"            <topic>{pattern}</topic>\n" for pattern in written_by_clients(reader))
    return f"        <publish>\n          <topics>\n{rows}          </topics>\n        </publish>\n"


def document(role, reader):
    meaning, rule, written = ROLES[role]
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<!-- {meaning} Generated from @topic in idl/*.idl: ./dev docs writes it. -->
<dds xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance"
     xsi:noNamespaceSchemaLocation="http://www.omg.org/spec/DDS-SECURITY/20170901/omg_shared_ca_permissions.xsd">
  <permissions>
    <grant name="{role}">
      <subject_name>O=takt,CN=takt {role}</subject_name>
      <validity>
        <not_before>2020-01-01T00:00:00</not_before>
        <not_after>2040-01-01T00:00:00</not_after>
      </validity>
      <{rule}>
        <domains><id_range><min>0</min><max>232</max></id_range></domains>
{publish(written, reader)}        <subscribe>{ALL}</subscribe>
      </{rule}>
      <default>DENY</default>
    </grant>
  </permissions>
</dds>
"""


def documents(reader):
    """The text of each file, by its name."""
    return {f"permissions_{role}.xml": document(role, reader) for role in ROLES}
