"""A SLURM cluster of four nodes on this machine. Its daemons, ports and keys are its own."""

import os
import secrets
import shutil
import signal
import socket
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

import pytest

DAEMONS = ("munged", "slurmctld", "slurmd", "slurmdbd", "mariadbd")
NODES = ("n1", "n2", "n3", "n4")
CONF = """
ClusterName=test
SlurmctldHost={host}(127.0.0.1)
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
CryptoType=crypto/munge
MpiDefault=none
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
ReturnToService=2
SlurmctldPort={slurmctld}
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/%n/slurmd.pid
SlurmdSpoolDir={folder}/%n
StateSaveLocation={folder}/state
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/%n/slurmd.log
SlurmdParameters=config_overrides
SchedulerParameters=sched_interval=2,bf_interval=2
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SlurmdTimeout=15
KillWait=5
AccountingStorageType=accounting_storage/{storage}
AccountingStorageHost=127.0.0.1
AccountingStoragePort={slurmdbd}
AccountingStoragePass={folder}/munge.socket
NodeName=n1 NodeHostname={host} NodeAddr=127.0.0.1 Port={n1} CPUs=16 RealMemory=1000
NodeName=n2 NodeHostname={host} NodeAddr=127.0.0.1 Port={n2} CPUs=16 RealMemory=1000
NodeName=n3 NodeHostname={host} NodeAddr=127.0.0.1 Port={n3} CPUs=16 RealMemory=1000
NodeName=n4 NodeHostname={host} NodeAddr=127.0.0.1 Port={n4} CPUs=16 RealMemory=1000
PartitionName=cpu Nodes=n1,n2 Default=YES
PartitionName=mortal Nodes=n3,n4 Default=NO
"""
ACCOUNTING = """
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
DbdHost=localhost
DbdAddr=127.0.0.1
DbdPort={slurmdbd}
SlurmUser=root
StorageType=accounting_storage/mysql
StorageHost=127.0.0.1
StoragePort={mariadbd}
StorageUser=slurm
StoragePass=test
StorageLoc=slurm_acct
LogFile={folder}/slurmdbd.log
PidFile={folder}/slurmdbd.pid
"""
GRANT = (
    "create database slurm_acct; create user slurm@127.0.0.1 identified by 'test';"
    " grant all on slurm_acct.* to slurm@127.0.0.1"
)


def obstacle() -> str | None:
    if not all(find(daemon) for daemon in DAEMONS):
        return "SLURM is not installed: apt-get install slurm-wlm slurmdbd munge mariadb-server"
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
    def __init__(self, folder: Path, accounting: bool) -> None:
        self.folder = folder
        self.environment = {**os.environ, "SLURM_CONF": str(folder / "slurm.conf")}
        self.daemons = dict[str, subprocess.Popen[bytes]]()
        host, named = socket.gethostname().split(".")[0], ("slurmctld", "slurmdbd", "mariadbd", *NODES)
        names = {"folder": folder, "host": host, "storage": "slurmdbd" if accounting else "none"}
        names |= dict(zip(named, free_ports(len(named)), strict=True))
        (folder / "slurm.conf").write_text(CONF.format(**names))
        (folder / "slurmdbd.conf").write_text(ACCOUNTING.format(**names))
        (folder / "slurmdbd.conf").chmod(0o600)
        self.port = names["mariadbd"]

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

    def start_all(self, accounting: bool) -> None:
        folder = self.folder
        key = folder / "munge.key"
        key.write_bytes(secrets.token_bytes(128))
        key.chmod(0o600)
        files = {"key-file": key, "socket": folder / "munge.socket", "pid-file": folder / "munge.pid"}
        files |= {"log-file": folder / "munge.log", "seed-file": folder / "munge.seed"}
        self.start("munged", "munged", "--foreground", "--force", *(f"--{k}={v}" for k, v in files.items()))
        munged, made = self.daemons["munged"], folder / "munge.socket"
        wait_until(lambda: made.exists() or munged.poll() is not None)
        if munged.poll() is not None:
            pytest.skip(f"munged does not start: {(folder / 'munged.out').read_text()[-300:]}")
        if accounting:
            self.start_accounting()
        (folder / "state").mkdir()
        self.start("slurmctld", "slurmctld", "-D")
        for name in NODES:
            self.start_node(name)
        wait_until(lambda: set(self.ask("sinfo", "--noheader", "--format=%T").split()) == {"idle"})

    def start_accounting(self) -> None:
        data, mysql_socket = self.folder / "mysql", self.folder / "mysql.sock"
        install = [
            "mariadb-install-db",
            "--no-defaults",
            "--user=root",
            "--skip-test-db",
            f"--datadir={data}",
        ]
        subprocess.run(install, check=True, capture_output=True)  # noqa: S603
        options = [f"--datadir={data}", f"--socket={mysql_socket}", f"--port={self.port}"]
        options += ["--bind-address=127.0.0.1", f"--pid-file={self.folder / 'mariadbd.pid'}"]
        options += ["--innodb-buffer-pool-size=64M", "--innodb-lock-wait-timeout=900"]
        self.start("mariadbd", "mariadbd", "--no-defaults", "--user=root", *options)
        client = ["mariadb", "--no-defaults", f"--socket={mysql_socket}", "--execute"]
        wait_until(lambda: subprocess.run([*client, "select 1"], capture_output=True).returncode == 0)  # noqa: S603
        subprocess.run([*client, GRANT], check=True)  # noqa: S603
        self.start("slurmdbd", "slurmdbd", "-D")
        wait_until(lambda: self.try_to("sacctmgr", "list", "cluster"))
        self.ask("sacctmgr", "--immediate", "add", "cluster", "test")

    def try_to(self, *command: str) -> bool:
        return subprocess.run(command, env=self.environment, capture_output=True).returncode == 0  # noqa: S603

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

    def stop_all(self) -> None:
        self.try_to("scancel", "--me")
        with suppress(AssertionError):  # the cluster did not start
            wait_until(lambda: self.try_to("squeue") and not self.ask("squeue", "--noheader"), 20.0)
        for process in reversed(self.daemons.values()):  # munged is the last one
            process.terminate()
            try:
                process.wait(30)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


@contextmanager
def slurm_cluster(folder: Path, *, accounting: bool) -> Iterator[SlurmCluster]:
    cluster = SlurmCluster(folder, accounting)
    try:
        cluster.start_all(accounting)
        yield cluster
    finally:
        cluster.stop_all()
