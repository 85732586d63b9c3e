"""Roots of Debian made by debootstrap: making one, its mounts, and what is started in it. Used by docker/check_recipe and
tests/releases/other_debian. Needs root, debootstrap, unshare."""
import filecmp
import fnmatch
import glob
import os
import shutil
import subprocess
import sys

PATH = "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin"
# Settings of Debian's own images, for the same speed and size.
DPKG_OF_IMAGES = "force-unsafe-io\n"
APT_OF_IMAGES = 'Acquire::Languages "none";\nAPT::Keep-Downloaded-Packages "false";\n' \
    'Dir::Cache::pkgcache "";\nDir::Cache::srcpkgcache "";\n' \
    'Apt::AutoRemove::SuggestsImportant "false";\nAPT::Update::Post-Invoke { "rm -f /var/cache/apt/archives/*.deb || true"; };\n' \
    'DPkg::Post-Invoke { "rm -f /var/cache/apt/archives/*.deb || true"; };\n'
DPKG_OF_SLIM = "".join(f"path-exclude /usr/share/{name}/*\n" for name in ("doc", "info", "locale", "man")) + \
    "path-include /usr/share/doc/*/copyright\n"
IN_NAMESPACES = "TAKT_IN_NAMESPACES"


class RootError(Exception):
    """A root cannot be made or used; the text is a whole sentence."""


def enter_namespaces():
    """Starts this program again with mounts and processes of its own, and ends with it. None of them outlives this process:
    unshare ignores SIGTERM, but dies with its parent, and the namespaces with it."""
    if os.geteuid() != 0:
        raise RootError("This needs root, for debootstrap, mount and chroot.")
    if IN_NAMESPACES not in os.environ:
        inside = subprocess.Popen(["setpriv", "--pdeathsig", "KILL", "unshare", "--mount", "--pid", "--fork", "--kill-child",
                                   "--mount-proc", sys.executable, *sys.argv], env={**os.environ, IN_NAMESPACES: "1"})
        try:
            code = inside.wait()
        except KeyboardInterrupt:
            inside.kill()
            code = 130
        sys.exit(code if code >= 0 else 128 - code)
    del os.environ[IN_NAMESPACES]


def mirror():
    """The archive that this machine's apt takes Debian from; Debian's own where apt names none."""
    listed = subprocess.run(["apt-get", "indextargets", "--format", "$(REPO_URI)", "Created-By: Packages", "Origin: Debian",
                             "Label: Debian"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, check=False)
    return next(iter(listed.stdout.split()), "http://deb.debian.org/debian")


def make(root, suite, slim=False, archive=None):
    """A root as Debian's image of the suite has it, if it is not there yet."""
    if os.path.exists(root + "/.complete"):
        return
    if os.path.exists(root):
        shutil.rmtree(root)
    made = subprocess.run(["debootstrap", "--variant=minbase", suite, root, archive or mirror()],
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    if made.returncode != 0:
        raise RootError(f"debootstrap failed:\n{made.stdout[-2000:]}")
    # What this machine's apt says of proxies and certificates holds for the root too.
    said = subprocess.run(["apt-config", "dump"], stdout=subprocess.PIPE, text=True, check=True).stdout.splitlines()
    network = [line for line in said if line.lower().startswith(("acquire::http::", "acquire::https::"))]
    for name, text in (("dpkg/dpkg.cfg.d/images", DPKG_OF_IMAGES + (DPKG_OF_SLIM if slim else "")),
                       ("apt/apt.conf.d/images", APT_OF_IMAGES + "".join(line + "\n" for line in network))):
        with open(f"{root}/etc/{name}", "w", encoding="utf-8") as file:
            file.write(text)
    for directory in glob.glob(root + "/var/lib/apt/lists/*") + glob.glob(root + "/var/cache/apt/archives/*.deb"):
        subprocess.run(["rm", "-rf", directory], check=True)
    if slim:
        for name in ("doc", "info", "locale", "man"):
            subprocess.run(["find", f"{root}/usr/share/{name}", "-type", "f", "!", "-name", "copyright", "-delete"],
                           check=False)
    with open(root + "/.complete", "w", encoding="utf-8"):
        pass


def mount(root, binds=(), shared_memory=None):
    """What an engine puts into a running container, and directories of this machine (DIR, INSIDE). The shared memory is
    of the root alone, or a directory that others see too. Gone with this process (enter_namespaces)."""
    inside_shm = root + "/dev/shm"
    mounts = [["-t", "proc", "proc", root + "/proc"],
              ["--bind", shared_memory, inside_shm] if shared_memory else ["-t", "tmpfs", "tmpfs", inside_shm]]
    for place, inside in binds:
        os.makedirs(root + inside, exist_ok=True)
        mounts.append(["--bind", os.path.realpath(place), root + inside])
    os.makedirs(inside_shm, exist_ok=True)
    for arguments in mounts:
        subprocess.run(["mount", *arguments], check=True)
    subprocess.run(["chmod", "1777", inside_shm], check=True)
    shutil.copy("/etc/resolv.conf", root + "/etc/resolv.conf")


def argv(root, command, variables, workdir="/", user="root"):
    """What to start on this machine to run `command` in the root."""
    as_user = [] if user == "root" else [f"--userspec={user}:"]
    pairs = [f"{name}={value}" for name, value in variables.items()]
    return ["chroot", *as_user, root, "/usr/bin/env", "-i", *pairs, "/bin/sh", "-c", 'cd "$0" && exec "$@"', workdir, *command]


def trust(root, certificates):
    """Variables by which npm in the root trusts the certificates of a file of this machine."""
    shutil.copy(certificates, root + "/usr/local/share/extra_ca.pem")
    return {"NODE_EXTRA_CA_CERTS": "/usr/local/share/extra_ca.pem"}


def ignored(context):
    """Of paths relative to the context: is it in .dockerignore? Names and patterns without `!` are known."""
    try:
        with open(os.path.join(context, ".dockerignore"), encoding="utf-8") as file:
            patterns = [line.strip().strip("/") for line in file if line.strip() and line[0] != "#"]
    except FileNotFoundError:
        patterns = []
    if any(pattern.startswith("!") for pattern in patterns):
        raise RootError(".dockerignore: exceptions (!) are not known here.")
    return lambda relative: any(fnmatch.fnmatch(relative, pattern) for pattern in patterns)


def copy_changed(context, target, kept):
    """Makes `target` a copy of the context without what .dockerignore names. Files with the same bytes are left alone, and
    others get a new time, so that a build there compiles what changed. `kept`: folders of the target that stay."""
    skip = ignored(context)
    for directory, folders, files in os.walk(target):
        relative = os.path.relpath(directory, target)
        folders[:] = [name for name in folders if os.path.normpath(os.path.join(relative, name)) not in kept]
        for path in (os.path.normpath(os.path.join(relative, name)) for name in files):
            if skip(path) or not os.path.isfile(os.path.join(context, path)):
                os.remove(os.path.join(target, path))
    for directory, folders, files in os.walk(context):
        relative = os.path.relpath(directory, context)
        folders[:] = [name for name in folders if not skip(os.path.normpath(os.path.join(relative, name)))]
        os.makedirs(os.path.join(target, relative), exist_ok=True)
        for path in (os.path.normpath(os.path.join(relative, name)) for name in files):
            source, copy = os.path.join(context, path), os.path.join(target, path)
            if skip(path):
                continue
            if os.path.isdir(copy):
                shutil.rmtree(copy)
            if not os.path.isfile(copy) or not filecmp.cmp(source, copy, shallow=False):
                shutil.copyfile(source, copy)
            shutil.copymode(source, copy)
