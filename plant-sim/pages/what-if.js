// The page that runs the whole bench: what is set here becomes a scenario, and every change runs it.

const LAWS = [
    "computed-torque:observer", "computed-torque:integral", "computed-torque:none",
    "computed-torque-task:observer", "computed-torque-task:integral", "computed-torque-task:none",
    "pid", "pd-gravity", "kinematic-joint", "kinematic-task",
];

/** Faults to choose from, each in the words of docs/faults.md, without the time. */
const FAULTS = [
    "none", "encoder:elbow:stuck", "encoder:shoulder:jump=0.01", "encoder:wrist:reversed", "motor:elbow:weak=0.5", "motor:lift:dead", "motor:shoulder:runaway",
    "command:loss=0.2", "command:delay=0.003", "feedback:corrupt", "drives:silent", "brake:stuck", "payload:dropped",
];

/** All that can be set: name in the link, label, range and step or choices, value at the start, unit. */
const SETTINGS = [
    { key: "law", label: "Control law", choices: LAWS, start: LAWS[0] },
    { key: "payload", label: "Payload", from: 0, to: 22, step: 0.5, start: 2, unit: "kg" },
    { key: "rate", label: "Control rate", choices: ["250", "500", "1000", "2000", "3000"], start: "1000", unit: "Hz" },
    { key: "bandwidth", label: "Bandwidth", from: 20, to: 250, step: 5, start: 150, unit: "rad/s" },
    { key: "damping", label: "Damping", from: 0.3, to: 2, step: 0.05, start: 1, unit: "" },
    { key: "observer", label: "Observer or integral", from: 5, to: 250, step: 5, start: 100, unit: "rad/s" },
    { key: "friction", label: "Friction, actual", from: 0, to: 3, step: 0.1, start: 1, unit: "× nominal" },
    { key: "mass", label: "Payload, actual", from: 0.5, to: 1.5, step: 0.05, start: 1, unit: "× nominal" },
    { key: "x", label: "Gate, x of its middle", from: 300, to: 950, step: 10, start: 600, unit: "mm" },
    { key: "y", label: "Gate, y of its middle", from: -500, to: 500, step: 10, start: 0, unit: "mm" },
    { key: "width", label: "Gate, width", from: 50, to: 500, step: 10, start: 300, unit: "mm" },
    { key: "height", label: "Gate, height", from: 5, to: 200, step: 5, start: 25, unit: "mm" },
    { key: "fault", label: "Fault", choices: FAULTS, start: "none" },
    { key: "at", label: "Fault, when", from: 0.3, to: 1, step: 0.02, start: 0.4, unit: "s" },
];

/** z of the flange at the ends of the gate, m. */
const FLOOR = -0.2713;
/** Greatest gain, rad per sample: beyond it no phase is left for the delays of sampling and bus. */
const MOST_GAIN = 0.25;

/** A corner frequency as far as the rate allows it. */
function corner(value, { rate }) {
    return Math.min(value, MOST_GAIN * rate);
}

/** The scenario file of these settings: one cycle through the gate and back. */
function scenario(set) {
    const metres = (millimetres) => +(millimetres / 1000).toFixed(6);
    // From one end to the other at 45 degrees to the axes.
    const half = (set.width / 2) * Math.SQRT1_2;
    const pose = (sign) => `[${metres(set.x + sign * half)}, ${metres(set.y - sign * half)}, ${FLOOR}, 0.0]`;
    const top = +(FLOOR + set.height / 1000).toFixed(6);
    const jump = (sign) => `[[cycle]]\njump = { to = ${pose(sign)}, top = ${top}, clearance = ${metres(Math.min(5, set.height / 2))} }`;
    const held = (share) => +(share * set.payload).toFixed(6);
    const payload = set.payload > 0
        ? `\n[payload]\nmass = ${set.payload}\ncom_flange_frame = [0.0, 0.0, 0.05]\ninertia_com_diag = [${held(0.004)}, ${held(0.004)}, ${held(0.005)}]\n`
        : "";
    return `name = "what-if"
cycles = 1
rate_hz = ${set.rate}
law = "${set.law}"
start = ${pose(-1)}
${set.fault === "none" ? "" : `faults = ["${set.fault}@${set.at}s"]\n`}${payload}
[gains]
bandwidth = ${corner(set.bandwidth, set)}
damping = ${set.damping}
observer = ${corner(set.observer, set)}

[mismatch]
friction = ${set.friction}
payload = ${set.mass}

${jump(1)}
${jump(-1)}
[[cycle]]
dwell = 0.25
`;
}

/** The settings that the link names; what it does not name is as at the start. */
function fromLink() {
    const named = new URLSearchParams(location.hash.slice(1));
    const value = ({ key, choices, from, to, start }) => {
        const text = named.get(key);
        if (text === null) {
            return start;
        }
        return choices ? (choices.includes(text) ? text : start) : Math.min(Math.max(Number(text) || 0, from), to);
    };
    return Object.fromEntries(SETTINGS.map((setting) => [setting.key, value(setting)]));
}

class WhatIf {
    constructor() {
        this.set = fromLink();
        this.board = new Board();
        this.kept = null;
        this.verdict = element("div", { class: "verdict", role: "status" }, "The simulation is loading.");
        this.command = element("pre", { tabindex: 0, role: "region", "aria-label": "Command" });
        this.hash = element("code", { id: "trace" });
        this.facts = element("div");
        this.controls = SETTINGS.map((setting) => this.control(setting));
        const panel = element("section", { class: "panel", "aria-label": "Settings" }, element("h2", {}, "What if"), ...this.controls.map(({ place }) => place), this.buttons());
        const same = this.board.section(
            "The same run on the command line", element("p", {}, "These lines write the same trace.log, byte for byte; its SHA-256 is ", this.hash, "."), this.command, this.facts,
        );
        const results = element("div", { class: "results" }, this.verdict, ...this.board.parts, same, this.board.dock);
        document.querySelector("main").replaceChildren(element("h1", {}, "The bench in a page"), element("div", { class: "bench" }, panel, results));
        this.simulation = new Simulation(document.getElementById("module").textContent, (answer) => this.show(answer));
        addEventListener("hashchange", () => this.follow());
        this.ask();
    }

    /** The link leads to a moment of the run, or to other settings. */
    follow() {
        const t = momentOfLink();
        if (t === null) {
            this.take(fromLink());
        } else {
            this.board.moment(t);
            this.link();
        }
    }

    /** The link of the page names the settings. */
    link() {
        const named = SETTINGS.filter(({ key, start }) => this.set[key] !== start).map(({ key }) => [key, this.set[key]]);
        history.replaceState(null, "", `#${new URLSearchParams(named)}`);
    }

    control(setting) {
        const { key, label, choices, from, to, step, unit } = setting;
        const change = () => this.take({ ...this.set, [key]: choices ? input.value : +input.value });
        const input = choices
            ? element("select", { id: key, change }, ...choices.map((choice) => element("option", { value: choice }, unit ? `${choice} ${unit}` : choice)))
            : element("input", { id: key, type: "range", min: from, max: to, step, input: change });
        const shown = element("output", { for: key });
        const say = () => {
            input.value = this.set[key];
            const used = unit === "rad/s" ? corner(this.set[key], this.set) : this.set[key];
            shown.textContent = choices ? "" : `${used === this.set[key] ? "" : "at this rate at most "}${used} ${unit}`;
        };
        say();
        return { place: element("div", { class: "control" }, element("label", { for: key }, label), shown, input), say };
    }

    buttons() {
        this.keep = element("button", { type: "button", click: () => this.hold(this.kept ? null : this.run) }, "Keep to compare");
        const reset = element("button", { type: "button", click: () => this.take(Object.fromEntries(SETTINGS.map(({ key, start }) => [key, start]))) }, "Start again");
        return element("div", { class: "bar" }, this.keep, reset);
    }

    /** These settings from now on. */
    take(set) {
        this.set = set;
        this.controls.forEach(({ say }) => say());
        this.link();
        this.ask();
    }

    ask() {
        this.text = scenario(this.set);
        this.simulation.ask({ scenario: this.text });
    }

    /** Keeps a run beside those to come, or none. */
    hold(run) {
        this.kept = run;
        this.keep.textContent = run ? "Stop comparing" : "Keep to compare";
        this.draw();
    }

    show({ run, error, took }) {
        if (error) {
            this.verdict.replaceChildren(element("p", { class: "bad" }, error));
            return;
        }
        const first = !this.run;
        this.run = new Run(run);
        this.took = took;
        this.draw();
        if (first && motionAllowed()) {
            this.board.player.play(true);
        }
    }

    draw() {
        const runs = this.kept && this.kept !== this.run ? [this.run, this.kept] : [this.run];
        const { results } = this.run;
        const fast = (results.sim_time_s / this.took).toFixed(0);
        const speed = element("p", { class: "hint", id: "speed" }, `${results.sim_time_s.toFixed(2)} s simulated in ${(1000 * this.took).toFixed(0)} ms, ${fast} × real time`);
        this.verdict.replaceChildren(...runs.map(title), numbers(runs), speed);
        this.board.show(runs);
        this.facts.replaceChildren(table(runs));
        this.hash.textContent = results.trace_sha256;
        this.command.textContent = `cat >what-if.toml <<'END'\n${this.text}END\nplant-sim run --scenario what-if.toml`;
    }
}

/** The few numbers that matter most. */
function numbers(runs) {
    const of = ({ results }) => [
        ["cycle", results.cycle_time_s ? `${digits(results.cycle_time_s.mean)} s` : "–"],
        ["settled after", results.settle_time_s ? `${(1000 * results.settle_time_s.mean).toFixed(1)} ms` : "–"],
        ["peak error", `${digits(results.tracking_error_mm.max)} mm`],
        ["peak torque", `${(100 * Math.max(...results.torque_utilisation)).toFixed(0)} %`],
    ];
    const [run, other] = runs.map(of);
    const tile = ([name, value], index) => element("div", {}, element("b", {}, value), other ? ` was ${other[index][1]}` : "", element("span", {}, name));
    return element("div", { class: "numbers" }, ...run.map(tile));
}

new WhatIf();
