"""The copy of the tree that a root of Debian receives (docker/debian_root.py), the namespaces of a run,
and the result of a step of other_debian. No root is made."""
import importlib.machinery
import importlib.util
import os
import signal
import subprocess
import sys
import tempfile
import types
import unittest

HERE = os.path.dirname(os.path.realpath(__file__))
sys.dont_write_bytecode = True


def load(path):
    loader = importlib.machinery.SourceFileLoader(os.path.basename(path).split(".")[0], path)
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader(loader.name, loader))
    loader.exec_module(module)
    return module


debian_root = load(HERE + "/../../docker/debian_root.py")
other_debian = load(HERE + "/other_debian")


def write(root, path, text):
    os.makedirs(os.path.dirname(os.path.join(root, path)), exist_ok=True)
    with open(os.path.join(root, path), "w", encoding="utf-8") as file:
        file.write(text)


def listed(root):
    return sorted(os.path.relpath(os.path.join(folder, name), root) for folder, _, files in os.walk(root) for name in files)


class CopyChanged(unittest.TestCase):
    def setUp(self):
        self.place = tempfile.TemporaryDirectory()
        self.addCleanup(self.place.cleanup)
        self.tree, self.copy = self.place.name + "/tree", self.place.name + "/copy"
        write(self.tree, ".dockerignore", ".git\nbuild\n")
        write(self.tree, ".git/HEAD", "main")
        write(self.tree, "build/host.o", "compiled here")
        write(self.tree, "server/a.cpp", "a")
        write(self.tree, "server/b.cpp", "b")
        self.again()

    def again(self):
        debian_root.copy_changed(self.tree, self.copy, kept=("build",))

    def age(self, path):
        os.utime(os.path.join(self.copy, path), ns=(10**9, 10**9))

    def time_ns(self, path):
        return os.stat(os.path.join(self.copy, path)).st_mtime_ns

    def test_ignored_files_are_left_out(self):
        self.assertEqual(listed(self.copy), [".dockerignore", "server/a.cpp", "server/b.cpp"])

    def test_equal_bytes_keep_the_time_and_changed_bytes_get_another(self):
        self.age("server/a.cpp")
        self.age("server/b.cpp")
        write(self.tree, "server/b.cpp", "c")  # as long as before
        os.utime(self.tree + "/server/b.cpp", ns=(1, 1))  # older than what was built of the copy
        self.again()
        self.assertEqual(self.time_ns("server/a.cpp"), 10**9)
        self.assertGreater(self.time_ns("server/b.cpp"), 10**9)

    def test_removed_files_go_and_the_build_folder_stays(self):
        write(self.copy, "build/release/a.o", "compiled there")
        os.remove(self.tree + "/server/b.cpp")
        self.again()
        self.assertEqual(listed(self.copy), [".dockerignore", "build/release/a.o", "server/a.cpp"])

    def test_a_file_may_become_a_folder_and_a_folder_a_file(self):
        os.remove(self.tree + "/server/a.cpp")
        write(self.tree, "server/a.cpp/inner", "a")
        self.again()
        self.assertIn("server/a.cpp/inner", listed(self.copy))
        os.remove(self.tree + "/server/a.cpp/inner")
        os.rmdir(self.tree + "/server/a.cpp")
        write(self.tree, "server/a.cpp", "a")
        self.again()
        self.assertIn("server/a.cpp", listed(self.copy))

    def test_programs_stay_programs(self):
        os.chmod(self.tree + "/server/a.cpp", 0o755)
        self.again()
        self.assertEqual(os.stat(self.copy + "/server/a.cpp").st_mode & 0o777, 0o755)


INSIDE = """
import signal, sys
sys.dont_write_bytecode = True
sys.path.insert(0, sys.argv[1])
import debian_root
signal.signal(signal.SIGINT, signal.default_int_handler)
debian_root.enter_namespaces()
print("inside", flush=True)
signal.pause()
"""
NAMESPACES = os.geteuid() == 0 and subprocess.run(["unshare", "--mount", "--pid", "--fork", "--mount-proc", "true"],
                                                  stderr=subprocess.DEVNULL, check=False).returncode == 0


@unittest.skipUnless(NAMESPACES, "needs root and namespaces")
class Namespaces(unittest.TestCase):
    def test_every_signal_ends_what_runs_inside(self):
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGKILL):
            with self.subTest(number), tempfile.TemporaryDirectory() as place:
                write(place, "inside.py", INSIDE)
                run = subprocess.Popen([sys.executable, place + "/inside.py", HERE + "/../../docker"], stdout=subprocess.PIPE)
                self.assertEqual(run.stdout.readline(), b"inside\n")
                run.send_signal(number)
                self.assertEqual(run.stdout.read(), b"")  # the pipe ends with the last process that holds it
                run.stdout.close()
                self.assertNotEqual(run.wait(), 0)


class Step(unittest.TestCase):
    def step(self, command):
        with tempfile.TemporaryDirectory() as place:
            os.mkdir(place + "/logs")
            root = types.SimpleNamespace(place=place, argv=lambda argv: argv)
            report = other_debian.Report()
            return report.step(root, "tests", command, r"^\d+% tests passed, .*$"), report.failed

    def test_a_figure_and_success_pass(self):
        self.assertEqual(self.step("echo '100% tests passed, 0 tests failed out of 3'"), (True, False))

    def test_a_failure_fails(self):
        self.assertEqual(self.step("echo '66% tests passed, 1 tests failed out of 3'; exit 8"), (False, True))

    def test_no_figure_fails(self):
        self.assertEqual(self.step("echo 'No tests were found!!!'"), (False, True))


if __name__ == "__main__":
    unittest.main()
