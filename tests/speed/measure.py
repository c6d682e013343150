"""Measures what tests/bench prints. Every figure is the median of REPEATS; seconds are those of the processor, of whole
processes, unless the row says `wall`. Peers are timed in the same run, on the same work.
"""

import argparse
import datetime
import json
import os
import pathlib
import platform
import re
import statistics
import subprocess
import sys
import time

REPEATS = 3
HERE = pathlib.Path(__file__).parent
DOCUMENT = HERE.parent.parent / "docs/performance.md"
MUJOCO_STEP_S = 0.0005


class Process:
    """A command that has run: its output, its seconds of processor and wall, its largest memory in MiB."""

    peak = None

    def __init__(self, *command, stdin=None, stdout=subprocess.PIPE, allowed=(0,)):
        began = time.perf_counter()
        # The memory that the kernel reports of a child includes that of this Python, whose pages it shares until it starts the
        # command; `time` is small.
        memory = ["time", "--quiet", "--output", self.peak, "--format", "%M"]
        process = subprocess.Popen([str(part) for part in (*memory, *command)], stdin=stdin, stdout=stdout,
                                   stderr=subprocess.DEVNULL)
        self.out = process.stdout.read() if process.stdout else b""
        _, status, used = os.wait4(process.pid, 0)
        self.wall = time.perf_counter() - began
        self.cpu = used.ru_utime + used.ru_stime
        self.memory = int(self.peak.read_text()) / 1024
        if os.waitstatus_to_exitcode(status) not in allowed:
            sys.exit(f"measure.py: status {os.waitstatus_to_exitcode(status)}: {' '.join(map(str, command))}")


def median(measure):
    """Of what `measure` returns."""
    return statistics.median(measure() for _ in range(REPEATS))


def say(text):
    print(text, file=sys.stderr, flush=True)


class Bench:
    """The figures: rows of group, name, value, unit, and what it is compared with."""

    def __init__(self, arguments):
        self.given = arguments
        self.rows = []

    def add(self, name, value, unit, beside=""):
        self.rows.append({"name": name, "value": value, "unit": unit, "beside": beside})
        say(f"  {name}: {value:.4g} {unit}  {beside}")

    def run(self, *options, cycles=1):
        """A run of the gate: the process, and the simulated seconds."""
        process = Process(self.given.plant_sim, "run", "gate", "--cycles", cycles, "--set", "requirements=[]", "--no-report",
                          "--json", "--out", self.given.work / "run", *options)
        return process, json.loads(process.out)["sim_time_s"]

    def plant(self):
        """A step of the plant beside one of MuJoCo."""
        import mujoco

        ours = median(lambda: json.loads(Process(self.given.step).out)["ns"]) / 1000
        self.add("plant, a step of 0.5 ms", ours, "us")
        for name, integrator in (("RK4", mujoco.mjtIntegrator.mjINT_RK4), ("Euler", mujoco.mjtIntegrator.mjINT_EULER)):
            model = mujoco.MjModel.from_xml_path(str(HERE / "irb930_drive.xml"))
            model.opt.integrator, model.opt.timestep = integrator, MUJOCO_STEP_S

            def theirs(pushes=200, steps=100):
                data = mujoco.MjData(model)
                data.qpos[:] = [0.0, 1.0, 0.15, 0.0]
                began = time.process_time()
                for push in range(pushes):
                    sign = 1.0 if (push + 1) // 2 % 2 == 0 else -1.0
                    data.ctrl[:] = [sign * 1.0, sign * 0.5, -0.0761, 0.0]
                    mujoco.mj_step(model, data, nstep=steps)
                return (time.process_time() - began) / (pushes * steps) * 1e6

            us = median(theirs)
            self.add(f"MuJoCo {mujoco.__version__} {name}, the same step", us, "us", f"{us / ours:.1f} times ours")

    def lock_step(self):
        """The gate in process."""
        for name, options in (("nothing written", ("--no-trace",)), ("trace, truth and hash written", ())):
            def ratio(options=options):
                process, simulated = self.run(*options, cycles=300)
                return simulated / process.cpu
            self.add(f"gate in lock-step, {name}", median(ratio), "times real time")

    def cases(self):
        """Cases of the campaign that comes with the program."""
        plan = self.given.work / "plan.jsonl"
        count = 2000
        with plan.open("wb") as file:
            Process(self.given.plant_sim, "campaign", "plan", "--count", count, stdout=file)

        def rate():
            out = self.given.work / f"campaign-{time.monotonic_ns()}"
            # Status 1: some cases miss a requirement, as docs/campaign.md says.
            return count / Process(self.given.plant_sim, "campaign", "run", plan, "--out", out, allowed=(0, 1)).wall
        self.add(f"cases of the campaign, {os.cpu_count()} cores, wall", median(rate), "cases/s")

    def emulated(self):
        """The gate with the controller in QEMU."""
        for name, channel, cycles in (("every frame compared", "fifo", 10), ("slcan over the UART", "uart", 2)):
            def ratio(channel=channel, cycles=cycles):
                process, simulated = self.run("--controller", "qemu", "--channel", channel, "--image", self.given.image,
                                              cycles=cycles)
                return simulated / process.wall
            self.add(f"gate with the controller in QEMU, {name}, wall", median(ratio), "times real time")

    def cost(self):
        """Instructions of the laws on the Cortex-M4F."""
        for name, law in (
            ("joint law", "computed-torque:observer"),
            ("task-space law", "computed-torque-task:observer"),
        ):
            process = Process(self.given.plant_sim, "cost", "--law", law, "--json", "--image", self.given.image,
                              "--cost-image", self.given.cost_image)
            [took] = (row for row in json.loads(process.out)["phases"] if row["name"] == "law")
            self.add(f"{name} on the Cortex-M4F, at most", took["max"], "instructions", f"{took['min']} in fast motion")

    def web(self):
        """The gate in WebAssembly."""
        def ratio():
            table = self.given.work / "table.csv"
            table.write_text("scenario,law,rate_hz,cycles,trace,truth\ngate,computed-torque:observer,1000,50,,\n")
            with (self.given.work / "node.err").open("wb") as error:
                subprocess.run(["node", HERE.parent / "web/run.mjs", self.given.wasm, table], check=True, stderr=error,
                               stdout=subprocess.DEVNULL)
            return float(re.search(r"([\d.]+) times real time", (self.given.work / "node.err").read_text())[1])
        self.add("gate in WebAssembly, in node, wall", median(ratio), "times real time")

    def traces(self):
        """The tools for traces."""
        self.run(cycles=200)
        trace = self.given.work / "run/trace.log"
        frames = trace.read_bytes().count(b"\n")
        for arguments in (["decode"], ["decode", "--format", "csv"], ["decode", "--format", "jsonl"], ["stats"],
                          ["convert", "--to", "asc"]):
            memory = []

            def rate(arguments=arguments, memory=memory):
                process = Process(self.given.plant_sim, "trace", *arguments, trace, stdout=subprocess.DEVNULL)
                memory.append(process.memory)
                return frames / process.cpu / 1e6
            self.add(f"trace {' '.join(arguments)}", median(rate), "million frames/s", f"{max(memory):.1f} MiB")
        dbc = self.given.work / "scara.dbc"
        Process(self.given.plant_sim, "dbc", "--out", dbc)
        part = self.given.work / "part.log"
        part.write_bytes(b"".join(trace.open("rb").readlines()[:20000]))

        def theirs():
            with part.open("rb") as file:
                process = Process(sys.executable, "-m", "cantools", "decode", dbc, stdin=file, stdout=subprocess.DEVNULL)
            return 20000 / process.cpu / 1e6
        self.add("cantools decode, the first 20,000 frames", median(theirs), "million frames/s")

    def start(self):
        """What somebody waits for."""
        self.add("plant-sim --help, wall", median(lambda: Process(self.given.plant_sim, "--help").wall) * 1000, "ms")
        self.add("gate, one cycle, from start to its summary, wall", median(lambda: self.run()[0].wall) * 1000, "ms")

    def first_run(self):
        """What `cargo run --release` compiles in a new clone."""
        process = Process("cargo", "build", "--release", "--locked", "--quiet", "--target-dir", self.given.work / "first")
        self.add("cargo build --release of a new clone, wall", process.wall, "s", f"{process.cpu:.0f} s of the processor")

    def growth(self):
        """Cost against cycles: linear in time, none in memory."""
        before = None
        for cycles in (1, 10, 100, 1000):
            process, simulated = self.run("--no-trace", cycles=cycles)
            beside = f"{process.memory:.1f} MiB"
            if before:
                beside += f", {process.cpu / before:.1f} times as long as for a tenth"
            before = process.cpu
            self.add(f"gate, {cycles} cycles ({simulated:.0f} s), nothing written", process.cpu, "s", beside)


def machine():
    """The processor's name."""
    names = re.findall(r"model name\s*: (.*)", pathlib.Path("/proc/cpuinfo").read_text())
    return f"{names[0] if names else platform.machine()}, {os.cpu_count()} cores"


def table(rows):
    """The rows as Markdown."""
    lines = ["| what | figure | unit | beside |", "|---|---:|---|---|"]
    lines += [f"| {row['name']} | {row['value']:.3g} | {row['unit']} | {row['beside']} |" for row in rows]
    # Three digits without powers of ten.
    return "\n".join(re.sub(r"([\d.]+e\+\d+)", lambda m: f"{float(m[1]):.0f}", line) for line in lines)


def main():
    parser = argparse.ArgumentParser(prog="tests/bench", description="Speed on this machine, beside that of others.")
    for path in ("work", "plant-sim", "step", "wasm", "image", "cost-image"):
        parser.add_argument(f"--{path}", type=pathlib.Path, required=True, help=argparse.SUPPRESS)
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")
    parser.add_argument("--update", action="store_true", help="write the table to docs/performance.md")
    arguments = parser.parse_args()
    Process.peak = arguments.work / "peak"
    bench = Bench(arguments)
    for part in (bench.plant, bench.lock_step, bench.cases, bench.emulated, bench.cost, bench.web, bench.traces, bench.start,
                 bench.first_run, bench.growth):
        part()
    if arguments.json:
        print(json.dumps({"machine": machine(), "rows": bench.rows}, indent=2))
    else:
        print(table(bench.rows))
    if arguments.update:
        text = DOCUMENT.read_text()
        today = datetime.date.today().isoformat()
        version = Process(arguments.plant_sim, "--version").out.decode().split("\n")[0]
        block = f"<!-- measured -->\n{machine()}; {version}; {today}.\n\n{table(bench.rows)}\n<!-- end of measured -->"
        DOCUMENT.write_text(re.sub(r"<!-- measured -->.*<!-- end of measured -->", lambda _: block, text, flags=re.S))


main()
