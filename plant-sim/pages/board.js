// All that is drawn of one run, or of two: motion, states, tool, axes, bus.

/** Radius within which the tool counts as settled, mm. */
const SETTLED = 0.01;

/** What a state of the controller looks like. */
const STATE_COLOURS = {
    "boot": "idle", "self-test": "idle", "pre-operational": "idle", "ready": "idle",
    "enabling": "getting-ready", "disabling": "getting-ready", "enabled": "holding", "moving": "moving",
};

class Board {
    constructor() {
        this.scenes = [new TopView(), new SideView(), new PathView()];
        this.player = new Player((t) => {
            this.scenes.forEach((scene) => scene.move(t));
            this.charts.move(t);
        });
        this.charts = new Charts((t) => this.player.seek(t));
        this.cycles = element("select", { "aria-label": "What the charts show", change: () => this.cycle() });
        this.events = element("div", { class: "events" });
        this.parts = [
            this.section("Motion", this.motion()),
            this.section("States, faults and requirements", this.charts.add(this.states()), this.events),
            this.section("Tool", this.charts.add(this.tool())),
            this.section("Axes", ...AXES.map((axis, number) => this.axis(axis, number))),
            this.section("Bus and loop", element("div", { class: "row two" }, ...this.bus().map((chart) => this.charts.add(chart)))),
        ];
        this.dock = element("section", { class: "dock", "aria-label": "Time and zoom" }, this.player.bar, this.zoomBar());
    }

    section(title, ...content) {
        return element("section", { "aria-label": title }, element("h2", {}, title), ...content);
    }

    /** Draws these runs, the first one in front. */
    show(runs) {
        this.runs = runs;
        const [run] = runs;
        const names = run.drawing.cycles.map((_, index) => element("option", { value: index }, `Cycle ${index + 1}`));
        this.cycles.replaceChildren(element("option", { value: "" }, "Whole run"), ...names);
        this.scenes.forEach((scene) => scene.show(runs));
        this.magnify();
        this.charts.show(runs);
        this.player.show(this.charts.end);
        this.list();
    }

    motion() {
        const [top, side, path] = this.scenes;
        const factors = [1, 10, 100, 1000].map((factor) => element("option", { value: factor }, `× ${factor}`));
        this.factor = element("select", { "aria-label": "Magnification of the deviation", change: () => this.magnify(+this.factor.value) }, ...factors);
        const figure = (scene, ...caption) =>
            element("figure", { class: "scene" }, element("figcaption", {}, ...caption), scene.view.canvas);
        const key = element("span", { class: "readout" }, element("span", { class: "key key-reference" }, "reference"), element("span", { class: "key key-actual" }, "deviation"));
        return element("div", { class: "row three" }, figure(top, element("b", {}, "From above")), figure(side, element("b", {}, "From the side")), figure(path, element("b", {}, "Tool path"), " ", key, this.factor));
    }

    /** Draws the deviation of the path this many times as large; by itself so that it can be seen and fills less than a tenth. */
    magnify(chosen = null) {
        const path = this.scenes[2];
        if (chosen === null) {
            const size = Math.max(...Object.values(boxOf(path.cover())).map(Math.abs), 1e-3);
            const greatest = this.runs.flatMap((run) => run.path).reduce((most, { reference, actual }) => Math.max(most, Math.hypot(...reference.map((value, axis) => value - actual[axis]))), 1e-9);
            chosen = [1000, 100, 10].find((factor) => factor * greatest < 0.3 * size) ?? 1;
        }
        this.factor.value = chosen;
        path.factor = chosen;
        path.view.draw();
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
        const place = (t) => Math.min(Math.max(plot.valToPos(t, "x", true), left), left + width);
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
        run.drawing.cycles.forEach((t) => context.fillRect(place(t), top, ratio, height / 4));
        context.fillStyle = colour("alarm");
        run.faults.forEach(({ time_s: t }) => context.fillRect(place(t) - ratio, top, 3 * ratio, height));
        for (const { met, time_s: t } of run.results.requirements) {
            if (t !== null) {
                this.wedge(context, place(t), top + height, 5 * ratio, colour(met ? "good" : "bad"));
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
            new Chart(this.charts, { title: "Loop time", unit: "µs", series: [latency], limits: ({ drawing }) => [{ at: drawing.step_s * 1e6, name: "alarm" }] }),
        ];
    }

    zoomBar() {
        const button = (text, name, act) => element("button", { type: "button", "aria-label": name, title: name, click: act }, text);
        const view = (factor, share) => () => this.charts.view(factor, share);
        return element(
            "div", { class: "bar" }, this.player.speed, this.cycles,
            button("+", "Zoom in", view(0.5, 0)), button("−", "Zoom out", view(2, 0)),
            button("←", "Earlier", view(1, -0.5)), button("→", "Later", view(1, 0.5)),
            element("span", { class: "hint" }, "Draw over a span of a chart to zoom, click for a moment, double-click for the whole run."),
        );
    }

    /** Shows the chosen cycle. */
    cycle() {
        const { cycles } = this.runs[0].drawing;
        const number = this.cycles.value;
        number === "" ? this.charts.zoom(0, this.charts.end) : this.charts.zoom(cycles[+number], cycles[+number + 1] ?? this.charts.end);
    }

    /** Shows a moment and what is around it. */
    moment(t) {
        this.charts.zoom(t - 0.25, t + 0.25);
        this.player.seek(t);
    }

    list() {
        const [{ faults, results }] = this.runs;
        const fault = ({ time_s: t, text }) => element("li", {}, momentLink(t), ` ${text}`);
        const table = requirements(results.requirements);
        this.events.replaceChildren(...(faults.length ? [element("ul", {}, ...faults.map(fault))] : [element("p", {}, "No fault.")]), ...table);
    }
}
