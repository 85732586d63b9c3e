#!/usr/bin/env python3
"""Runs of the test suite (./dev test): once, or again and again, beside other work, in random order.

runs.py BUILD [--repeat N] [--load] [--shuffle [SEED]] [ARGS of ctest]

The slowest entries are named at the end, of several runs each entry that failed in one of them. Ends with 1 if any failed.
"""
import argparse
import collections
import json
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as xml
from pathlib import Path

SLOWEST = 10
# Niceness of the other work: it gets a third of a processor that a test wants too.
LOAD_NICENESS = 5

Result = collections.namedtuple('Result', 'seconds failed output')


def costs_of(schedule):
    """Of tests/schedule.cmake: [(seconds, regular expression)]."""
    table = re.search(r'set\(TAKT_TEST_COSTS\n(.*?)\)\n', Path(schedule).read_text(), re.S).group(1)
    return [(float(seconds), re.compile(pattern.replace('\\\\', '\\'))) for seconds, pattern in re.findall(r'"(\d+) (.*)"', table)]


class Costs:
    """The seconds by which ctest sorts the entries, the longest first; it keeps them itself."""

    def __init__(self, build):
        self.file = build / 'Testing/Temporary/CTestCostData.txt'
        self.build = build

    def names(self):
        listed = subprocess.run(['ctest', '--show-only=json-v1'], cwd=self.build, check=True, stdout=subprocess.PIPE, text=True).stdout
        return [test['name'] for test in json.loads(listed)['tests']]

    def expect(self, table):
        """Of entries that ctest has not seen yet: what the table says."""
        rows, mark, failed = (self.file.read_text() if self.file.exists() else '').partition('---')
        known = {line.split(' ')[0] for line in rows.splitlines()}
        for name in self.names():
            seconds = next((seconds for seconds, pattern in table if pattern.search(name)), None)
            if seconds and name not in known:
                rows += f'{name} 1 {seconds}\n'
        self.file.parent.mkdir(parents=True, exist_ok=True)
        self.file.write_text(rows + (mark or '---\n') + failed)

    def shuffle(self, order):
        names = sorted(self.names())
        order.shuffle(names)
        self.file.write_text(''.join(f'{name} 1 {1 + place}\n' for place, name in enumerate(names)) + '---\n')


def run_once(build, ctest):
    """Results by entry. What ctest prints is shown as it comes."""
    with tempfile.TemporaryDirectory() as place:
        report = Path(place) / 'report.xml'
        code = subprocess.run(['ctest', '--test-dir', str(build), *ctest, '--output-junit', str(report)]).returncode
        results = {}
        if report.exists():
            for case in xml.parse(report).getroot().iter('testcase'):
                output = ''.join(case.find('system-out').itertext()) if case.find('system-out') is not None else ''
                skipped = case.find('skipped')
                failed = case.get('status') == 'fail' or (skipped is not None and 'SKIP_' not in skipped.get('message', ''))
                results[case.get('name')] = Result(float(case.get('time', 0)), failed, output)
    return code, results


def other_work():
    """A busy program for each processor."""
    return [subprocess.Popen([sys.executable, '-c', f'import os; os.nice({LOAD_NICENESS})\nwhile os.getppid() == {os.getpid()}:\n for _ in range(1000000): pass'])
            for _ in range(len(os.sched_getaffinity(0)))]


def report_slowest(results):
    slowest = sorted(results.items(), key=lambda entry: -entry[1].seconds)[:SLOWEST]
    if len(results) < 2:
        return
    print('\nslowest tests:')
    for name, result in slowest:
        print(f'{result.seconds:8.1f} s  {name}')


def report_failures(failures, runs):
    print(f'\ntests that failed in one of {runs} runs:' if failures else f'\nno test failed in {runs} runs')
    for name, files in sorted(failures.items(), key=lambda entry: (-len(entry[1]), entry[0])):
        print(f'{len(files):4} times  {name}: {files[0]}')


def main():
    parser = argparse.ArgumentParser(prog='./dev test', allow_abbrev=False)
    parser.add_argument('build', type=Path)
    parser.add_argument('--repeat', type=int, metavar='N')
    parser.add_argument('--load', action='store_true')
    parser.add_argument('--shuffle', nargs='?', type=int, const=-1, metavar='SEED')
    options, ctest = parser.parse_known_args()
    runs = options.repeat or 1
    if runs < 1:
        parser.error('--repeat wants a number of runs, 1 or more')
    build, costs = options.build.resolve(), Costs(options.build.resolve())
    order = None
    if options.shuffle is not None:
        seed = options.shuffle if options.shuffle >= 0 else random.SystemRandom().randrange(1_000_000)
        order = random.Random(seed)
        print(f'order of the tests: --shuffle {seed}', flush=True)
    outputs = build / 'Testing/failed'
    shutil.rmtree(outputs, ignore_errors=True)
    costs.expect(costs_of(Path(__file__).parent / 'schedule.cmake'))
    known = costs.file.read_text()
    longest, failures, status = {}, {}, 0
    busy = other_work() if options.load else []
    try:
        for run in range(1, runs + 1):
            if options.repeat:
                print(f'\nrun {run} of {runs}', flush=True)
            if order:
                costs.shuffle(order)
            code, results = run_once(build, ctest)
            status = status or (1 if code else 0)
            for name, result in results.items():
                if name not in longest or result.seconds > longest[name].seconds:
                    longest[name] = result
                if result.failed:
                    file = outputs / f'run_{run}' / (re.sub(r'[^\w.-]', '_', name) + '.txt')
                    file.parent.mkdir(parents=True, exist_ok=True)
                    file.write_text(result.output)
                    failures.setdefault(name, []).append(file)
    finally:
        for program in busy:
            program.kill()
        if order:
            costs.file.write_text(known)
    report_slowest(longest)
    if options.repeat:
        report_failures(failures, runs)
    return status


if __name__ == '__main__':
    sys.exit(main())
