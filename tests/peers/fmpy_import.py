"""FMUs of other tools in takt and in FMPy: fmpy_import.py BIN FOLDER. Needs what fmpy_export.py needs. Each file *.fmu below FOLDER,
different ones once, stands alone in a cell for 1 s with steps of 1 ms; its outputs at the end are those of FMPy. What takt refuses is
listed with its reason. Exit code 1: other outputs, a failed FMU, or neither a result nor a reason."""
import hashlib
import json
import multiprocessing
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

import fmpy

STEP_S, END_S, LONGEST_S = 0.001, 1.0, 120
MOST_OUTPUTS = 16
TEXTS = ('String', 'Binary', 'Clock')


def simulate(file, answers):
    """Of FMPy: the outputs at the end; in a process of its own, as an FMU may crash."""
    description = fmpy.read_model_description(file, validate=False)
    outputs = [v.name for v in description.modelVariables
               if v.causality == 'output' and v.type not in TEXTS and not v.dimensions][:MOST_OUTPUTS]
    result = fmpy.simulate_fmu(file, validate=False, fmi_type='CoSimulation', start_time=0.0, stop_time=END_S, step_size=STEP_S,
                               output_interval=STEP_S, output=outputs, use_event_mode=False)
    answers.put({name: float(result[name][-1]) for name in outputs})


def of_fmpy(file):
    answers = multiprocessing.Queue()
    process = multiprocessing.Process(target=simulate, args=(str(file), answers))
    process.start()
    try:
        return answers.get(timeout=LONGEST_S)
    except Exception:  # none within the time: FMPy cannot run it
        return None
    finally:
        process.kill()
        process.join()


def of_takt(file, folder):
    """Signals at the end, and the reason why there are none."""
    shutil.copyfile(file, folder / 'm.fmu')
    (folder / 'cell.yaml').write_text(f'takt_scenario: 1\nname: fmu\nduration_s: {END_S}\nsolver: {{step_s: {STEP_S}}}\n'
                                      'fmus: {Foreign: {file: m.fmu}}\n')
    report = folder / 'report.json'
    report.unlink(missing_ok=True)
    try:
        run = subprocess.run([bin_dir / 'takt-run', 'run', 'cell.yaml', '--allow-fmus', '.', '--report', report], cwd=folder, check=False,
                             capture_output=True, text=True, timeout=LONGEST_S)
    except subprocess.TimeoutExpired:
        return None, f'is slower than {LONGEST_S} s for {END_S} s'
    if run.returncode == 2:
        return None, run.stderr.strip().splitlines()[-1]
    return json.loads(report.read_text())['devices']['Foreign']['signals'], ''


def compare(file, folder):
    """A word, and more of it."""
    signals, reason = of_takt(file, folder)
    if signals is None:
        return 'refused' if reason else 'WRONG', reason
    if signals['failed']:
        return 'WRONG', 'the FMU has failed'
    wanted = of_fmpy(file)
    if wanted is None:
        return 'runs', 'in takt alone'
    found = {name: signals[re.sub('[^A-Za-z0-9]+', '_', name).strip('_')] for name in wanted}
    other = {name: (found[name], value) for name, value in wanted.items() if abs(found[name] - value) > 1e-9 * max(1.0, abs(value))}
    return ('OTHER', str(other)) if other else ('same', f'{len(wanted)} outputs')


if __name__ == '__main__':
    bin_dir = pathlib.Path(sys.argv[1]).resolve()
    seen, counts = set(), {}
    with tempfile.TemporaryDirectory() as place:
        for fmu in sorted(pathlib.Path(sys.argv[2]).resolve().rglob('*.fmu')):
            digest = hashlib.sha256(fmu.read_bytes()).digest()
            if digest in seen:
                continue
            seen.add(digest)
            word, more = compare(fmu, pathlib.Path(place))
            counts[word] = counts.get(word, 0) + 1
            print(f'{word:8} {fmu.name}: {more}', flush=True)
    print(counts)
    sys.exit(1 if counts.get('WRONG') or counts.get('OTHER') or not counts else 0)
