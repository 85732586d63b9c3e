"""./dev test --repeat, --load, --shuffle (tests/runs.py) on entries of its own: what failed in some of the runs is named, with
its output, and the seed of an order gives the same order again."""
import re
import subprocess
import sys
import tempfile
from pathlib import Path

RUNS = Path(__file__).parents[1] / 'runs.py'
# Each second time: fails.
SOMETIMES = 'test -e second && { rm second; echo the second time; exit 1; }; touch second'
# As many other programs of this run as there are processors.
BESIDE = ('runs=$(awk "/^PPid/ { print \\$2 }" /proc/$PPID/status); '
          'test $(grep -ls "getppid[(][)] == $runs:" /proc/[0-9]*/cmdline | wc -l) -eq $(nproc)')
ENTRIES = {'a.good': 'true', 'a.broken': 'echo broken; exit 3', 'a.sometimes': SOMETIMES, 'b.skipped': 'exit 77', 'e.beside': BESIDE}
ENTRIES.update({f'c.{number}': 'true' for number in range(12)})


def run(build, *arguments):
    ended = subprocess.run([sys.executable, '-B', RUNS, build, *arguments], capture_output=True, text=True)
    return ended.returncode, ended.stdout


def started(text):
    return re.findall(r'^ +Start +\d+: (\S+)$', text, re.M)


def reported(text):
    """Of the slowest entries: [(seconds, name)]."""
    return [(float(seconds), name) for seconds, name in re.findall(r'^ +([\d.]+) s  (\S+)$', text.partition('slowest tests:')[2], re.M)]


def main():
    with tempfile.TemporaryDirectory() as place:
        build = Path(place)
        lines = [f'add_test([=[{name}]=] bash -c [=[{program}]=])\n' for name, program in ENTRIES.items()]
        (build / 'CTestTestfile.cmake').write_text(''.join(lines) + 'set_tests_properties(b.skipped PROPERTIES SKIP_RETURN_CODE 77)\n'
                                                   'add_test(d.absent /no/such/program)\n')
        code, text = run(build, '-R', '^(a.good|b|c)')
        assert code == 0, text
        slowest = reported(text)
        assert len(slowest) == 10 and slowest == sorted(slowest, key=lambda row: -row[0]), text
        assert set(ENTRIES).issuperset(name for _, name in slowest), text

        code, text = run(build, '--repeat', '4', '--load', '-j', '2', '-E', '^d')
        assert code == 1, text
        assert text.count('   4 times  a.broken: ') == 1 and text.count('   2 times  a.sometimes: ') == 1, text
        assert 'times  b.skipped' not in text and 'times  a.good' not in text, text
        output = Path(re.search(r'2 times  a\.sometimes: (.*)', text).group(1))
        assert output.parent.name == 'run_2' and output.read_text().strip() == 'the second time', text

        code, text = run(build, '--repeat', '1', '-R', '^d')
        assert code == 1 and '1 times  d.absent' in text, text
        code, text = run(build, '--repeat', '2', '-R', 'good|beside', '--load')
        assert code == 0 and 'no test failed in 2 runs' in text, text
        code, text = run(build, '-R', 'good|beside')
        assert code == 1, text

        kept = (build / 'Testing/Temporary/CTestCostData.txt').read_text()
        orders = [started(run(build, '-j', '2', '--shuffle', *seed, '-R', '^c')[1]) for seed in (['7'], ['7'], ['8'])]
        assert sorted(orders[0]) == sorted(name for name in ENTRIES if name.startswith('c.')), orders
        assert orders[0] == orders[1] != orders[2], orders
        assert (build / 'Testing/Temporary/CTestCostData.txt').read_text() == kept
        code, text = run(build, '-j', '2', '--shuffle', '-R', '^c')
        seed = re.search(r'order of the tests: --shuffle (\d+)\n', text).group(1)
        assert started(run(build, '-j', '2', '--shuffle', seed, '-R', '^c')[1]) == started(text), text
    print('runs of the suite are repeated, shuffled and reported')


main()
