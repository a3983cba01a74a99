"""A real Slurm of one node on this machine, started and stopped by who needs it."""

import contextlib
import os
import pathlib
import shutil
import signal
import socket
import subprocess
import time

SBIN = "/usr/sbin:/sbin"
NEEDED = ["slurmctld", "slurmd", "munged", "sbatch", "scontrol", "squeue"]


def missing():
    """What a Slurm of one node lacks on this machine, or ""."""
    path = f"{os.environ['PATH']}:{SBIN}"
    absent = [name for name in NEEDED if shutil.which(name, path=path) is None]
    return ", ".join(absent) or ("" if os.geteuid() == 0 else "not root")


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Slurm:
    """slurmctld, slurmd and munged on loopback, with all of their files in one folder; task_plugin is Slurm's TaskPlugin."""

    def __init__(self, folder, task_plugin="task/none"):
        self.folder = pathlib.Path(folder)
        self.folder.mkdir(parents=True)
        self.processes = {}
        self.host = socket.gethostname().split(".")[0]
        self.ports = [free_port(), free_port()]
        self.key = self.folder / "munge.key"
        self.key.write_bytes(os.urandom(128))
        self.key.chmod(0o400)
        for name in ["state", "spool"]:
            (self.folder / name).mkdir()
        cpus = os.cpu_count()
        (self.folder / "slurm.conf").write_text(f"""
ClusterName=assay
SlurmctldHost={self.host}(127.0.0.1)
SlurmctldPort={self.ports[0]}
SlurmdPort={self.ports[1]}
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket={self.folder}/munge.socket
CryptoType=crypto/munge
StateSaveLocation={self.folder}/state
SlurmdSpoolDir={self.folder}/spool
SlurmctldPidFile={self.folder}/slurmctld.pid
SlurmdPidFile={self.folder}/slurmd.pid
SlurmctldLogFile={self.folder}/slurmctld.log
SlurmdLogFile={self.folder}/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin={task_plugin}
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
ReturnToService=2
SchedulerParameters=sched_interval=1,bf_interval=1
MinJobAge=600
KillWait=2
NodeName={self.host} NodeAddr=127.0.0.1 CPUs={cpus} State=UNKNOWN
PartitionName=main Nodes={self.host} Default=YES MaxTime=INFINITE State=UP OverSubscribe=NO
""")
        (self.folder / "cgroup.conf").write_text("CgroupPlugin=cgroup/v1\nCgroupAutomount=no\n")
        self.env = {**os.environ, "SLURM_CONF": str(self.folder / "slurm.conf"),
                    "PATH": f"{os.environ['PATH']}:{SBIN}"}

    def start(self, name, *arguments):
        log = open(self.folder / f"{name}.out", "ab")
        self.processes[name] = subprocess.Popen([name, *map(str, arguments)], env=self.env, stdin=subprocess.DEVNULL,
                                                stdout=log, stderr=log, start_new_session=True)
        log.close()

    def start_all(self):
        self.start("munged", "--foreground", "--force", f"--key-file={self.key}", f"--socket={self.folder}/munge.socket",
                   f"--pid-file={self.folder}/munge.pid", f"--seed-file={self.folder}/munge.seed",
                   f"--log-file={self.folder}/munge.log")
        self.wait(lambda: (self.folder / "munge.socket").exists(), 20)
        self.start_controller()
        self.start("slurmd", "-D", "-N", self.host)
        self.wait(lambda: "idle" in self.tell("sinfo", "-h", "-o", "%T"), 60)

    def start_controller(self):
        self.start("slurmctld", "-D", "-i")
        self.wait(lambda: self.run("scontrol", "ping").returncode == 0 and "UP" in self.tell("scontrol", "ping"), 60)

    def stop(self, name, how=signal.SIGTERM):
        process = self.processes.pop(name)
        process.send_signal(how)
        try:
            process.wait(30)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()

    def stop_all(self):
        with contextlib.suppress(Exception):
            self.run("scancel", "--state=PENDING", "-u", "root")
            self.run("scancel", "-u", "root")
        for name in ["slurmd", "slurmctld", "munged"]:
            if name in self.processes:
                self.stop(name)

    def run(self, *words):
        return subprocess.run(words, env=self.env, capture_output=True, text=True, timeout=60, stdin=subprocess.DEVNULL)

    def tell(self, *words):
        return self.run(*words).stdout

    @staticmethod
    def wait(condition, seconds):
        deadline = time.monotonic() + seconds
        while not condition():
            if time.monotonic() > deadline:
                raise TimeoutError("Slurm did not get there in time")
            time.sleep(0.2)
