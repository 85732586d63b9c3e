"""Exported cells in FMPy: fmpy_export.py BIN. Needs FMPy (CATIA-Systems/FMPy) on PYTHONPATH and Debian's python3-numpy,
python3-lxml, python3-attr, python3-lark, python3-msgpack. Each cell is written for FMI 2.0 and 3.0, validated, simulated twice in
one process, and compared with takt-run to the bit."""
import json
import pathlib
import subprocess
import sys
import tempfile

from fmpy import extract, read_model_description, simulate_fmu
from fmpy.validation import validate_fmu

bin_dir = pathlib.Path(sys.argv[1]).resolve()
scenarios = pathlib.Path(__file__).resolve().parents[2] / 'config/scenarios'
STEP_S, END_S = 0.001, 1.0


def export(scenario, version, file, *more):
    subprocess.run([bin_dir / 'takt-run', 'export-fmu', scenario, '-o', file, '--fmi-version', version, '--outputs', 'state_hash*',
                    '--outputs', 'Robot1.q[*]', *more], check=True)


def expected(scenario):
    out = subprocess.run([bin_dir / 'takt-run', 'run', scenario, '--duration', str(END_S), '--json'], check=False, capture_output=True,
                         text=True)
    return int(json.loads(out.stdout)['state_hash'], 16)


failed = False
with tempfile.TemporaryDirectory() as folder:
    for version in ('2.0', '3.0'):
        scenario = scenarios / 'block_assembly.yaml'
        fmu = pathlib.Path(folder) / f'block{version}.fmu'
        export(scenario, version, fmu, '--inputs', 'Gripper1.close')
        problems = validate_fmu(str(fmu))
        print(f'{version}: validate_fmu:', problems or 'no problem')
        failed |= bool(problems)
        unzipped = extract(str(fmu))
        description = read_model_description(unzipped)
        wanted = expected(scenario)
        for run in (1, 2):
            result = simulate_fmu(unzipped, model_description=description, start_time=0.0, stop_time=END_S, step_size=STEP_S,
                                  output_interval=STEP_S, fmi_type='CoSimulation')
            found = int(result['state_hash[2]'][-1]) << 32 | int(result['state_hash[1]'][-1])
            print(f'{version}: run {run}: state hash {found:#018x}, takt-run {wanted:#018x}, {len(result)} rows')
            failed |= found != wanted
sys.exit(1 if failed else 0)
