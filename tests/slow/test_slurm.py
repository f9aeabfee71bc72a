"""The back end ``slurm`` on a real cluster on this machine: faults."""

import csv
import os
import secrets
import shutil
import signal
import socket
import subprocess
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, closing, suppress
from pathlib import Path

import pytest
from backends import CALLS, calls, contents, note_calls, start_driver

from flockesc_env.jobs import Cache, Job, find_backend, run

DAEMONS = ("munged", "slurmctld", "slurmd")
NODES = ("n1", "n2", "n3", "n4")
CONF = """
ClusterName=test
SlurmctldHost={host}(127.0.0.1)
SlurmUser=root
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
ProctrackType=proctrack/linuxproc
ReturnToService=2
SlurmctldPort={slurmctld}
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/%n/slurmd.pid
SlurmdSpoolDir={folder}/%n
StateSaveLocation={folder}/state
SlurmdParameters=config_overrides
SchedulerParameters=sched_interval=2,bf_interval=2
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SlurmdTimeout=15
KillWait=5
NodeName=n1 NodeHostname={host} NodeAddr=127.0.0.1 Port={n1} CPUs=16 RealMemory=1000
NodeName=n2 NodeHostname={host} NodeAddr=127.0.0.1 Port={n2} CPUs=16 RealMemory=1000
NodeName=n3 NodeHostname={host} NodeAddr=127.0.0.1 Port={n3} CPUs=16 RealMemory=1000
NodeName=n4 NodeHostname={host} NodeAddr=127.0.0.1 Port={n4} CPUs=16 RealMemory=1000
PartitionName=cpu Nodes=n1,n2 Default=YES
PartitionName=mortal Nodes=n3,n4 Default=NO
"""


def obstacle() -> str | None:
    if not all(find(daemon) for daemon in DAEMONS):
        return "SLURM is not installed: apt-get install slurm-wlm munge"
    return None if os.geteuid() == 0 else "the daemons of SLURM need root"


def find(program: str) -> str | None:
    return shutil.which(program, path=f"{os.environ['PATH']}:/usr/sbin:/sbin")


def wait_until(condition: Callable[[], object], seconds: float = 60.0) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "waited for too long"
        time.sleep(0.2)


def processes(*marks: str, folder: Path | None = None) -> list[int]:
    """Return the processes with these marks in their environment, or that work inside a folder."""
    found = []
    for path in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):  # it ends
            environment = (path / "environ").read_text(errors="replace").split("\0")
            if (path / "cwd").readlink().is_relative_to(folder) if folder else set(marks) <= set(environment):
                found.append(int(path.name))
    return found


def kill_processes(*marks: str, folder: Path | None = None) -> None:
    for process in processes(*marks, folder=folder):
        with suppress(ProcessLookupError):
            os.kill(process, signal.SIGKILL)


def free_ports(count: int) -> list[int]:
    with ExitStack() as stack:
        sockets = [stack.enter_context(socket.create_server(("127.0.0.1", 0))) for _ in range(count)]
        return [each.getsockname()[1] for each in sockets]


class SlurmCluster:
    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.environment = {**os.environ, "SLURM_CONF": str(folder / "slurm.conf")}
        self.daemons = dict[str, subprocess.Popen[bytes]]()
        names = {"folder": folder, "host": socket.gethostname().split(".")[0]}
        names |= dict(zip(("slurmctld", *NODES), free_ports(1 + len(NODES)), strict=True))
        (folder / "slurm.conf").write_text(CONF.format(**names))

    def start(self, name: str, *command: str, cwd: Path | None = None) -> None:
        """Start a daemon in the foreground."""
        program = find(command[0])
        assert program
        with (self.folder / f"{name}.out").open("ab") as log:
            self.daemons[name] = subprocess.Popen(  # noqa: S603
                [program, *command[1:]], cwd=cwd or self.folder, env=self.environment, stdout=log, stderr=log
            )

    def start_node(self, name: str) -> None:
        (self.folder / name).mkdir(exist_ok=True)
        self.start(name, "slurmd", "-D", "-N", name, cwd=self.folder / name)

    def start_all(self) -> None:
        folder = self.folder
        key = folder / "munge.key"
        key.write_bytes(secrets.token_bytes(128))
        key.chmod(0o600)
        files = {"key-file": key, "socket": folder / "munge.socket", "pid-file": folder / "munge.pid"}
        files |= {"log-file": folder / "munge.log", "seed-file": folder / "munge.seed"}
        self.start("munged", "munged", "--foreground", "--force", *(f"--{k}={v}" for k, v in files.items()))
        wait_until(files["socket"].exists)
        (folder / "state").mkdir()
        self.start("slurmctld", "slurmctld", "-D")
        for name in NODES:
            self.start_node(name)
        wait_until(lambda: set(self.ask("sinfo", "--noheader", "--format=%T").split()) == {"idle"})

    def ask(self, *command: str) -> str:
        run = subprocess.run(command, env=self.environment, capture_output=True, text=True)  # noqa: S603
        return run.stdout

    def kill(self, name: str) -> None:
        self.daemons[name].kill()
        self.daemons.pop(name).wait()

    def kill_node(self, name: str) -> None:
        self.kill(name)
        kill_processes(folder=self.folder / name)
        kill_processes(f"SLURM_CONF={self.folder / 'slurm.conf'}", f"SLURMD_NODENAME={name}")

    def close(self) -> None:
        self.ask("scancel", "--me")
        with suppress(AssertionError):
            wait_until(lambda: not self.ask("squeue", "--noheader"), 20.0)
        for process in reversed(self.daemons.values()):  # munged is the last one
            process.terminate()
            try:
                process.wait(30)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


RESULTS = os.environ.get("SLURM_FAULTS")
"""A CSV file that gets the seconds of docs/long-work.md."""
COMMAND = "SLURM_FAULTS=results/cluster/slurm_faults.csv python -m pytest tests/slow/test_slurm.py"
JOBS = [Job("backends:held_square", (number,)) for number in range(12)]
pytestmark = pytest.mark.skipif(obstacle() is not None, reason=str(obstacle()))


class Driver:
    """A process that runs jobs on a cluster. They go on when the fault has happened."""

    seconds: float
    """Until the driver ended, after the fault."""
    error: str
    """What it wrote to stderr."""

    def __init__(
        self,
        cluster: SlurmCluster,
        folder: Path,
        function: str = "held_square",
        count: int = 6,
        options: str = "partition=cpu",
    ) -> None:
        self.cluster, self.cache, self.calls = cluster, folder / "cache", folder / "calls"
        self.calls.mkdir(parents=True)
        self.hold = self.calls.with_suffix(".hold")
        self.hold.touch()
        # 200 s: a task takes three jobs.
        self.arguments = (function, count, self.cache, f"slurm:{options}", 200.0)
        self.start()

    def start(self) -> None:
        self.process = start_driver(*self.arguments, self.cluster.environment | {CALLS: str(self.calls)})

    def wait_for_states(self, array: str, condition: Callable[[set[str]], bool]) -> None:
        command = ["squeue", f"--jobs={array}", "--array", "--states=all", "--noheader", "--format=%T"]
        wait_until(lambda: condition(set(self.cluster.ask(*command).split())), 150.0)

    def end(self, fault: Callable[["Driver", str], None]) -> None:
        """Let the driver end after a fault of its array. It is killed after ten minutes."""
        start, seconds = time.monotonic(), 600.0
        try:
            wait_until(lambda: calls(self.calls) >= 2, 120.0)
            [array] = {path.name.split("_")[0] for path in (self.cache / "slurm").glob("*_submission.sh")}
            start = time.monotonic()
            fault(self, array)
        except AssertionError as error:
            print(f"{fault.__name__}: {error!r}")
            seconds = 0.0
        self.hold.unlink(missing_ok=True)
        try:
            self.error = self.process.communicate(timeout=seconds)[1]
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.error = self.process.communicate()[1]
        self.seconds = time.monotonic() - start


def processes_of_a_task_killed(driver: Driver, array: str) -> None:
    kill_processes(f"{CALLS}={driver.calls}", "SLURM_ARRAY_TASK_ID=0")


def tasks_cancelled(driver: Driver, array: str) -> None:
    """One runs, and ends after ``KillWait``; one has not started, because two may run at a time."""
    driver.cluster.ask("scancel", f"{array}_0", f"{array}_3")
    driver.wait_for_states(array, lambda states: "CANCELLED" in states)


def task_requeued(driver: Driver, array: str) -> None:
    driver.cluster.ask("scontrol", "requeue", f"{array}_0")
    driver.wait_for_states(array, lambda states: "PENDING" in states)


def node_killed(driver: Driver, array: str) -> None:
    driver.cluster.kill_node("n3")


def driver_killed(driver: Driver, array: str) -> None:
    driver.process.kill()
    driver.process.communicate()
    driver.start()


def time_limit(driver: Driver, array: str) -> None:
    driver.wait_for_states(array, lambda states: states == {"PENDING"})


def worker_always_killed(driver: Driver, array: str) -> None:
    """The jobs do it."""


def driver_interrupted(driver: Driver, array: str) -> None:
    driver.process.send_signal(signal.SIGINT)
    driver.wait_for_states(array, lambda states: states == {"CANCELLED"})


def slurmctld_killed(driver: Driver, array: str) -> None:
    """Meanwhile one task is killed, and the other one ends."""
    time.sleep(10)  # slurmctld saves its state every few seconds, and forgets jobs that it has not saved
    driver.cluster.kill("slurmctld")
    processes_of_a_task_killed(driver, array)
    driver.hold.unlink()
    time.sleep(20)
    driver.cluster.start("slurmctld", "slurmctld", "-D")


FAULTS: dict[str, tuple[Callable[[Driver, str], None], dict[str, int | str]]] = {
    "processes of a task killed": (processes_of_a_task_killed, {}),
    "scancel of two tasks": (tasks_cancelled, {"count": 12, "options": "partition=cpu,array_parallelism=2"}),
    "scontrol requeue": (task_requeued, {}),
    "node killed": (node_killed, {"options": "partition=mortal"}),
    "driver killed": (driver_killed, {}),
    "time limit": (time_limit, {"options": "partition=cpu,time=2,signal_delay_s=60"}),
    "job kills its worker": (worker_always_killed, {"function": "dies"}),
    "Ctrl-C": (driver_interrupted, {}),
    "slurmctld killed": (slurmctld_killed, {}),
}


def play(cluster: SlurmCluster, folder: Path) -> dict[str, Driver]:
    """Play all faults: the last one, which concerns all drivers, alone, and the others at the same time."""

    def played(number: int, name: str) -> Driver:
        fault, arguments = FAULTS[name]
        driver = Driver(cluster, folder / f"driver{number}", **arguments)  # type: ignore[arg-type]
        driver.end(fault)
        return driver

    *together, last = enumerate(FAULTS)
    with ThreadPoolExecutor(len(FAULTS)) as pool:
        ends = list(pool.map(lambda pair: played(*pair), together))
    return dict(zip(FAULTS, [*ends, played(*last)], strict=True))


def test_faults(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, subtests: pytest.Subtests) -> None:
    """One test, because the faults of a cluster are played at the same time."""
    note_calls(tmp_path, monkeypatch)
    run(JOBS, Cache(tmp_path / "serial"), find_backend("serial"))
    files = contents(tmp_path / "serial")
    expected = {job.arguments[0]: (f"{job.key}.npz", files[f"{job.key}.npz"]) for job in JOBS}
    folder = tmp_path / "cluster"
    folder.mkdir()
    with closing(SlurmCluster(folder)) as cluster:
        cluster.start_all()
        ends = play(cluster, folder)
        version = cluster.ask("sinfo", "--version").split()[-1]
    with subtests.test("no process is left"):
        assert not processes(f"SLURM_CONF={folder / 'slurm.conf'}")
        assert not processes(folder=folder)
    if RESULTS:
        note(Path(RESULTS), version, ends)
    for fault, end in ends.items():
        with subtests.test(fault):
            assert end.seconds < 300, end.error
            found = contents(end.cache)
            if fault == "scancel of two tasks":
                assert "6 of 12 jobs failed; the results of all others are kept" in end.error
                # The report shows five failures.
                assert end.error.count("was cancelled; run the same again to continue") == 5
                assert found == dict(expected[number] for number in range(3, 9))
                assert len(list((end.cache / "slurm").glob("*_submission.sh"))) == 1
            elif fault == "job kills its worker":
                assert "1 of 6 jobs failed" in end.error
                assert "backends:dies(1,):\narray task" in end.error
                assert len(found) == 5
            elif fault == "Ctrl-C":
                assert "KeyboardInterrupt: 0 of 6 jobs are finished" in end.error
                assert not found
            else:
                assert end.process.returncode == 0, end.error
                assert found == dict(expected[number] for number in range(6))


def note(path: Path, version: str, ends: dict[str, Driver]) -> None:
    rows = [[fault, False, round(ends[fault].seconds), version, COMMAND] for fault in FAULTS]
    path.parent.mkdir(parents=True, exist_ok=True)
    header = [] if path.exists() else [["fault", "accounting", "seconds", "slurm", "command"]]
    with path.open("a", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows(header + rows)
