// All that is drawn of one run, or of two: motion, states, tool, axes, bus.

class Board extends Plots {
    constructor() {
        super();
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

    /** What was injected, the faults and the requirements of every run. */
    list() {
        const fault = ({ time_s: t, text }) => element("li", {}, momentLink(t), ` ${text}`);
        const listed = ({ faults, results }, number) => [
            ...(this.runs.length > 1 ? [element("h3", {}, runKey(number), ` ${results.scenario}`)] : []),
            ...injected(results.injected ?? []),
            faults.length ? element("ul", {}, ...faults.map(fault)) : element("p", {}, "No fault."),
            ...requirements(results.requirements, this.runs.length > 1 ? `Requirements of ${"AB"[number]}` : "Requirements"),
        ];
        this.events.replaceChildren(...this.runs.flatMap(listed));
    }
}

/** The faults of the scenario, and when they were in effect. */
function injected(faults) {
    const when = ({ times, from_s: from, until_s: until }) =>
        times ? [` ${times > 1 ? `${times} times, ` : ""}from `, momentLink(from), ` to ${until.toFixed(3)} s`] : [" never in effect"];
    return faults.length ? [element("ul", {}, ...faults.map((it) => element("li", {}, `Injected: ${it.fault},`, ...when(it))))] : [];
}
