// Curves over time. All charts of a page share cursor, zoom and the time that is shown.

/** A pointer that moved less than this many pixels did not move. */
const NUDGE = 5;

/** What every chart of a page has in common. */
class Charts {
    /** @param onTime is called with the time that a person chose in a chart. */
    constructor(onTime) {
        this.all = [];
        this.onTime = onTime;
        this.t = 0;
        this.range = { min: 0, max: 1 };
        onScheme(() => this.all.forEach((chart) => chart.plot?.redraw()));
    }

    add(chart) {
        this.all.push(chart);
        return chart.figure;
    }

    /** Draws these runs; the zoom stays where it fits them. */
    show(runs) {
        const end = Math.max(...runs.map((run) => run.end));
        const whole = this.end === undefined || (this.range.min === 0 && this.range.max === this.end);
        this.end = end;
        this.all.forEach((chart) => chart.show(runs));
        whole ? this.zoom(0, end) : this.zoom(this.range.min, this.range.max);
    }

    /** Shows the times from `min` to `max`, as far as there are any. */
    zoom(min, max) {
        const width = Math.min(Math.max(max - min, 0.005), this.end);
        const from = Math.min(Math.max(min, 0), this.end - width);
        this.range = { min: from, max: from + width };
        this.all.forEach((chart) => chart.plot.setScale("x", this.range));
        this.move(this.t);
    }

    /** Zooms by a factor and moves by a share of what is shown. */
    view(factor, share) {
        const { min, max } = this.range;
        const [middle, half] = [(min + max) / 2 + share * (max - min), ((max - min) / 2) * factor];
        this.zoom(middle - half, middle + half);
    }

    /** Marks the time that is shown. */
    move(t) {
        this.t = t;
        this.all.forEach((chart) => chart.mark(t));
    }
}

/** One chart: curves of each run, lines at limits, and a caption with the values under the cursor. */
class Chart {
    /**
     * @param series of one run: label, values of a run, colour, dash, whether only the first run has it
     * @param limits of a run: heights and colours of the lines that are drawn and kept in sight; a band reaches down to zero
     */
    constructor(charts, { title, unit, series, limits = () => [], height = 165, paint = null }) {
        Object.assign(this, { charts, title, unit, series, limits, height, paint });
        this.readout = element("span", { class: "readout" });
        this.place = element("div", { class: "chart", role: "img", "aria-label": `${title} over time` });
        const caption = element("figcaption", {}, element("b", {}, title), unit ? ` ${unit} ` : " ", this.readout);
        this.figure = element("figure", {}, caption, this.place);
        this.line = element("div", { class: "now" });
        new ResizeObserver(() => this.plot?.setSize({ width: this.place.clientWidth, height: this.height })).observe(this.place);
    }

    show(runs) {
        this.runs = runs;
        this.curves = runs.flatMap((run, number) =>
            this.series
                .filter((series) => number === 0 || !series.first)
                .map((series) => ({
                    ...series,
                    run,
                    label: runs.length > 1 ? `${series.label} ${"AB"[number]}` : series.label,
                    colour: number === 0 ? series.colour : RUN_COLOURS[number],
                })),
        );
        const tables = this.curves.map(({ run, values }) => [run.time, values(run)]);
        const data = runs.length > 1 ? uPlot.join(tables) : [runs[0].time, ...tables.map((table) => table[1])];
        if (this.plot?.series.length === data.length) {
            this.plot.setData(data, false);
        } else {
            this.plot?.destroy();
            this.plot = new uPlot(this.options(), data, this.place);
            this.plot.over.append(this.line);
        }
        this.read(null);
    }

    options() {
        const axis = { stroke: () => colour("ink"), grid: { stroke: () => colour("grid"), width: 1 }, ticks: { show: false }, font: "11px system-ui, sans-serif" };
        return {
            width: Math.max(this.place.clientWidth, 50),
            height: this.height,
            legend: { show: false },
            cursor: { y: false, sync: { key: "run" }, points: { show: false }, drag: { x: true, y: false, setScale: false } },
            scales: { x: { time: false, range: () => [this.charts.range.min, this.charts.range.max] }, y: { range: (_, low, high) => this.heights(low, high) } },
            axes: [
                { ...axis, size: 26, values: (_, ticks) => ticks.map((tick) => `${+tick.toFixed(4)} s`) },
                { ...axis, size: 56, space: 22, values: (_, ticks) => ticks.map((tick) => (this.paint ? "" : `${+tick.toPrecision(6)}`)) },
            ],
            series: [
                {},
                ...this.curves.map(({ label, colour: name, dash }) => ({
                    label,
                    stroke: () => colour(name),
                    width: 1.3,
                    dash,
                    spanGaps: this.runs.length > 1,
                    points: { show: false },
                    show: !this.paint,
                })),
            ],
            hooks: {
                drawAxes: [(plot) => (this.paint ? this.paint(plot, this.runs) : this.lines(plot))],
                setCursor: [(plot) => this.read(plot.cursor.idx)],
                setSelect: [(plot) => this.select(plot)],
                ready: [(plot) => this.listen(plot)],
            },
        };
    }

    /** The range of heights: what the curves reach, and the limits. */
    heights(low, high) {
        const values = [low, high, ...this.runs.flatMap((run) => this.limits(run).map(({ at }) => at))].filter((value) => value !== null);
        const [least, greatest] = [Math.min(...values), Math.max(...values)];
        const size = Math.max(Math.abs(greatest), Math.abs(least));
        // What hardly changes beside its size is shown as such: its ticks would all say the same.
        const room = Math.max((greatest - least) * 0.06, greatest - least < size * 1e-4 ? size * 5e-4 : 0) || size * 0.1 || 1e-6;
        return [least - room, greatest + room];
    }

    lines(plot) {
        const { left, width } = plot.bbox;
        for (const { at, name, band } of this.limits(this.runs[0])) {
            const y = plot.valToPos(at, "y", true);
            if (band) {
                Object.assign(plot.ctx, { fillStyle: colour(name), globalAlpha: 0.15 });
                plot.ctx.fillRect(left, y, width, plot.valToPos(0, "y", true) - y);
                plot.ctx.globalAlpha = 1;
            }
            Object.assign(plot.ctx, { strokeStyle: colour(name), lineWidth: devicePixelRatio });
            plot.ctx.setLineDash([6 * devicePixelRatio, 4 * devicePixelRatio]);
            plot.ctx.beginPath();
            plot.ctx.moveTo(left, y);
            plot.ctx.lineTo(left + width, y);
            plot.ctx.stroke();
            plot.ctx.setLineDash([]);
        }
    }

    /** A click chooses a time, two of them show the whole run. */
    listen(plot) {
        let pressed = 0;
        plot.over.addEventListener("mousedown", (event) => (pressed = event.clientX));
        plot.over.addEventListener("click", (event) => {
            if (Math.abs(event.clientX - pressed) < NUDGE) {
                this.charts.onTime(plot.posToVal(event.clientX - plot.over.getBoundingClientRect().left, "x"));
            }
        });
        plot.over.addEventListener("dblclick", () => this.charts.zoom(0, this.charts.end));
    }

    /** A person drew over a span of time: it is what is shown. */
    select(plot) {
        const { left, width } = plot.select;
        if (width >= NUDGE) {
            this.charts.zoom(plot.posToVal(left, "x"), plot.posToVal(left + width, "x"));
        }
        plot.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
    }

    /** Shows the values at a place of the data, or the names of the curves alone. */
    read(index) {
        const values = index === null || index === undefined ? null : this.curves.map((_, number) => this.plot.data[number + 1][index]);
        this.readout.replaceChildren(
            ...this.curves.map(({ label, colour: name, say = digits }, number) =>
                element("span", { class: `key key-${name}` }, values ? `${label} ${say(values[number])}` : label),
            ),
        );
    }

    mark(t) {
        const x = this.plot.valToPos(t, "x");
        const inside = x >= 0 && x <= this.plot.over.clientWidth;
        this.line.hidden = !inside;
        this.line.style.transform = `translateX(${x}px)`;
    }
}
