"""The JSON Schema of scenario files against scenarios, by an independent validator: jsonschema (Debian
python3-jsonschema).

    check.py SCHEMA SCENARIOS TESTS...

- The schema is one of draft 2020-12.
- Every shipped scenario below the folder SCENARIOS is valid.
- Each program of TESTS runs with TAKT_KEEP_SCENARIOS: of the files that its tests read, those that takt reads are
  valid, and those that takt refuses are not, unless the mistake is of a kind that only takt can see (kOnlyTakt).
"""
import os
import pathlib
import re
import subprocess
import sys
import tempfile

try:
    import jsonschema
    import yaml
except ImportError as missing:
    print(f"SKIPPED: {missing.name} is not installed (Debian packages python3-jsonschema, python3-yaml). "
          "THE SCHEMA OF SCENARIO FILES HAS NOT BEEN CHECKED.")
    sys.exit(77)

# Files, references, duplicate keys, and numbers that depend on each other: beyond a schema.
kOnlyTakt = [
    "which does not exist", "of this scenario", "positive definite", "a unit quaternion", "a rotation matrix",
    "twice", "again; allowed: names that are unique", "rising temperatures", "has a thread itself",
    "a vector without direction", "other than 0", "one, or 2, one for each joint", "at least command_period_s",
    "an interval that is not empty", "one of the two names of the pair", "a list of 2 numbers", "the member '",
    "not below upper", "not valid YAML", "together with a section collision_checking", "--set", "is not a mapping",
    "a number <= 250 degC", "the name 'R' again", "found .nan", "found .inf",
]


class Loader(yaml.SafeLoader):
    """Numbers as YAML 1.2 has them: 1e-4 too."""


Loader.add_implicit_resolver("tag:yaml.org,2002:float", re.compile(r"^[-+]?(\d+\.?\d*|\.\d+)[eE][-+]?\d+$"),
                             list("-+.0123456789"))


def override(root, text):
    """As --set does."""
    key, _, value = text.partition("=")
    *path, last = re.sub(r"\[(\w+)\]", r".\1", key).split(".")
    for name in path:
        if isinstance(root, list):
            name = int(name)
        elif root.get(name) is None:
            root[name] = {}
        root = root[name]
    root[int(last) if isinstance(root, list) else last] = yaml.load(value, Loader)


def main(schema_file, scenarios, programs):
    import json
    schema = json.loads(pathlib.Path(schema_file).read_text())
    jsonschema.Draft202012Validator.check_schema(schema)
    validator = jsonschema.Draft202012Validator(schema)
    wrong = []

    def mistakes(root):
        return [f"{'.'.join(map(str, e.absolute_path))}: {e.message[:200]}" for e in validator.iter_errors(root)]

    shipped = sorted(pathlib.Path(scenarios).rglob("*.yaml"))
    for file in shipped:
        text = file.read_text()
        wrong += [f"{file}: {mistake}" for mistake in mistakes(yaml.load(text, Loader))]
        named = re.match(r"# yaml-language-server: \$schema=(\S+)\n", text)
        if not named or not (file.parent / named.group(1)).samefile(schema_file):
            wrong.append(f"{file}: its first line does not name the schema")

    rejected = beyond = valid = 0
    with tempfile.TemporaryDirectory() as folder:
        for program in programs:
            subprocess.run([program, "--gtest_brief=1", "--gtest_filter=ScenarioMistakes.*:ScenarioChoices.*:"
                            "ScenarioDevices.*:ScenarioFile.*:ContactSection.*"], check=True,
                           env={**os.environ, "TAKT_KEEP_SCENARIOS": folder}, stdout=subprocess.DEVNULL)
        for file in sorted(pathlib.Path(folder).glob("*.yaml")):
            error = file.with_suffix(".error").read_text()
            try:
                root = yaml.load(file.read_text(), Loader)
                for text in file.with_suffix(".set").read_text().splitlines():
                    override(root, text)
            except (yaml.YAMLError, AttributeError, TypeError, ValueError, IndexError):
                continue  # no tree to look at
            found = mistakes(root)
            if not error:
                valid += 1
                wrong += [f"takt reads it, the schema does not: {mistake}\n{file.read_text()}" for mistake in found]
            elif found:
                rejected += 1
            elif any(words in error for words in kOnlyTakt):
                beyond += 1
            else:
                wrong.append(f"the schema accepts what takt refuses: {error}\n{file.read_text()}"
                             f"{file.with_suffix('.set').read_text()}")
    print(f"{len(shipped)} scenarios valid; of the tests' files {valid} valid, {rejected} rejected by the schema, "
          f"{beyond} by takt alone")
    if rejected < 60 or valid < 10 or not shipped:
        wrong.append("too few files: have the tests kept them?")
    for line in wrong:
        print("WRONG:", line)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], sys.argv[2], sys.argv[3:]))
