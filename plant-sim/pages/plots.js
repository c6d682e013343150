// The charts of a page, and what has to do with their runs.

/** Radius within which the tool counts as settled, mm. */
const SETTLED = 0.01;

/** What a state of the controller looks like. */
const STATE_COLOURS = {
    "boot": "idle", "self-test": "idle", "pre-operational": "idle", "ready": "idle",
    "enabling": "getting-ready", "disabling": "getting-ready", "enabled": "holding", "moving": "moving",
};

/** Those that extend it say which runs there are, and in which charts. */
class Plots {
    section(title, ...content) {
        return element("section", { "aria-label": title }, element("h2", {}, title), ...content);
    }

    states() {
        const paint = (plot, runs) => {
            const height = plot.bbox.height / runs.length;
            runs.forEach((run, number) => this.strip(plot, run, plot.bbox.top + number * height, height - 2));
        };
        const say = (code) => this.runs[0].modes.get(code) ?? "–";
        const series = [{ label: "state", colour: "actual", values: (run) => run.curve("mode"), say, first: true }];
        return new Chart(this.charts, { title: "State of the controller", unit: "", height: 76, paint, series });
    }

    /** The states of a run in their colours, its cycles, its faults, and where it came nearest to the limits of its requirements. */
    strip(plot, run, top, height) {
        const { left, width } = plot.bbox;
        const ratio = devicePixelRatio;
        const context = plot.ctx;
        const at = (t) => plot.valToPos(t, "x", true);
        const place = (t) => Math.min(Math.max(at(t), left), left + width);
        // What is outside of the times that are shown has no mark: it would lie on others at the edge.
        const shown = (t) => at(t) >= left && at(t) <= left + width;
        Object.assign(context, { font: `${11 * ratio}px system-ui, sans-serif`, textAlign: "left", textBaseline: "middle" });
        for (const { name, from, to } of run.states) {
            const [start, end] = [place(from), place(to)];
            context.fillStyle = colour(STATE_COLOURS[name] ?? "fault");
            context.fillRect(start, top, Math.max(end - start, 1), height);
            if (end - start > context.measureText(name).width + 8 * ratio) {
                context.fillStyle = colour("ink");
                context.fillText(name, start + 4 * ratio, top + height / 2);
            }
        }
        context.fillStyle = colour("ink");
        run.drawing.cycles.filter(shown).forEach((t) => context.fillRect(at(t), top, ratio, height / 4));
        context.fillStyle = colour("alarm");
        run.faults.filter(({ time_s: t }) => shown(t)).forEach(({ time_s: t }) => context.fillRect(at(t) - ratio, top, 3 * ratio, height));
        for (const { met, time_s: t } of run.results.requirements) {
            if (t !== null && shown(t)) {
                this.wedge(context, at(t), top + height, 5 * ratio, colour(met ? "good" : "bad"));
            }
        }
    }

    /** A wedge that points up, to a moment. */
    wedge(context, x, y, size, paint) {
        context.fillStyle = paint;
        context.beginPath();
        context.moveTo(x, y - 1.6 * size);
        context.lineTo(x + size, y);
        context.lineTo(x - size, y);
        context.fill();
    }

    tool() {
        const series = [{ label: "error", colour: "actual", values: (run) => run.curve("tool_error", 1000) }];
        return new Chart(this.charts, { title: "Tool error", unit: "mm", height: 190, series, limits: () => [{ at: SETTLED, name: "limit", band: true }] });
    }

    axis({ name, unit, scale, effort }, index) {
        const number = index + 1;
        const actual = (run) => run.curve(`q${number}`, scale);
        const reference = (run) => {
            const error = run.curve(`error${number}`, scale);
            return actual(run).map((value, place) => (value === null ? null : value + error[place]));
        };
        const charts = [
            { title: `${name} position`, unit, series: [{ label: "reference", colour: "reference", values: reference, first: true }, { label: "actual", colour: "actual", values: actual }] },
            { title: `${name} error`, unit, series: [{ label: "error", colour: "actual", values: (run) => run.curve(`error${number}`, scale) }] },
            {
                title: index === 2 ? `${name} force` : `${name} torque`,
                unit: effort,
                series: [{ label: "actual", colour: "actual", values: (run) => run.curve(`effort${number}`) }],
                limits: ({ robot }) => [
                    ...[1, -1].map((sign) => ({ at: sign * robot.effort[index], name: "alarm" })),
                    ...[1, -1].map((sign) => ({ at: sign * robot.effort_continuous[index], name: "limit" })),
                ],
            },
        ];
        return element("div", { class: "row three" }, ...charts.map((chart) => this.charts.add(new Chart(this.charts, chart))));
    }

    bus() {
        const load = { label: "in each sample", colour: "actual", values: (run) => run.curve("bus_load", 100) };
        const latency = { label: "sample to command", colour: "actual", values: (run) => run.curve("latency", 1e6) };
        return [
            new Chart(this.charts, { title: "Bus load", unit: "%", series: [load] }),
            new Chart(this.charts, { title: "Loop time", unit: "µs", series: [latency], limits: ({ drawing }) => (drawing.step_s ? [{ at: drawing.step_s * 1e6, name: "alarm" }] : []) }),
        ];
    }
}
