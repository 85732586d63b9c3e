"""FMUs of other tools in takt and in FMPy: fmpy_import.py BIN FOLDER. Needs what fmpy_export.py needs. Each file *.fmu below FOLDER,
different ones once, stands alone in a cell for 1 s with steps of 1 ms; its outputs at the end are those of FMPy: same (within 1e-9), or
close (within the tolerance that the FMU states: its solver's steps may differ). What takt refuses is listed with its reason. Exit code 1:
other outputs, a failed FMU, or neither a result nor a reason."""
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
    try:
        description = fmpy.read_model_description(file, validate=False)
        outputs = [v.name for v in description.modelVariables
                   if v.causality == 'output' and v.type not in TEXTS and not v.dimensions][:MOST_OUTPUTS]
        result = fmpy.simulate_fmu(file, validate=False, fmi_type='CoSimulation', start_time=0.0, stop_time=END_S,
                                   step_size=STEP_S, output_interval=STEP_S, output=outputs, use_event_mode=False)
        stated = description.defaultExperiment and description.defaultExperiment.tolerance
        answers.send(({name: float(result[name][-1]) for name in outputs}, float(stated or 0.0)))
    except Exception as error:
        answers.send(str(error))


def of_fmpy(file):
    """The outputs and the FMU's own tolerance, or why there are none."""
    here, there = multiprocessing.Pipe(duplex=False)
    process = multiprocessing.Process(target=simulate, args=(str(file), there))
    process.start()
    there.close()
    try:
        return here.recv() if here.poll(LONGEST_S) else f'slower than {LONGEST_S} s'
    except EOFError:
        return 'its process crashed'
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
    if isinstance(wanted, str):
        return 'runs', f'in takt alone; FMPy: {wanted[:100]}'
    wanted, tolerance = wanted
    found = {name: signals[re.sub('[^A-Za-z0-9]+', '_', name).strip('_')] for name in wanted}
    worst = max((abs(found[name] - value) / max(1.0, abs(value)) for name, value in wanted.items()), default=0.0)
    word = 'same' if worst <= 1e-9 else 'close' if worst <= tolerance else 'OTHER'
    return word, f'{len(wanted)} outputs, largest difference {worst:.1e}'


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
