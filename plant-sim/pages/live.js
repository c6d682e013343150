// The live page: a run, or a bus, while it goes on.

/** Seconds that the charts show. */
const SHOWN = 10;
/** Times between two pictures, ms: of the arm, of the charts, and of both where motion is to be reduced. */
const PACE = { arm: 40, charts: 200, reduced: 500 };
/** Seconds without a frame after which a bus counts as silent. */
const SILENT = 1;
/** Sentences that are kept in sight. */
const WORDS = 200;

/** The arm within all that it can reach, and where a move would lead it. */
const Reaching = (View, flat, box) =>
    class extends View {
        /** Where the next move leads to, m, or null. */
        target = null;

        cover() {
            return box(this.runs[0].robot);
        }

        /** Makes room for a place that is outside. */
        reach(place) {
            const [x, y] = flat(place);
            if (this.box && (x < this.box.left || x > this.box.right || y < this.box.bottom || y > this.box.top)) {
                this.box = boxOf([[this.box.left, this.box.bottom], [this.box.right, this.box.top], [x, y]]);
                this.view.draw();
            }
        }

        paint(context, run, looks) {
            if (run.length > 0) {
                super.paint(context, run, looks);
            }
            if (this.target) {
                const [x, y] = looks.to(flat(this.target));
                stroke(context, [[x - 7, y], [x + 7, y]], 2, colour("alarm"));
                stroke(context, [[x, y - 7], [x, y + 7]], 2, colour("alarm"));
            }
        }
    };

/** Most of what the arm reaches, in front of it more than behind: the box grows when the arm or a target leaves it. */
const front = ({ a1, a2 }, share) => (a1 + a2) * share;
const LiveTop = Reaching(TopView, ([x, y]) => [x, y], (robot) => [[front(robot, -0.3), front(robot, -0.75)], [front(robot, 1), front(robot, 0.75)]]);
const LiveSide = Reaching(SideView, ([x, , z]) => [x, z], (robot) => [[front(robot, -0.3), LOOKS.floor - 0.1], [front(robot, 1), robot.d1 + robot.d2 - robot.d4 - robot.lower[2] + LOOKS.shaftLength]]);

class Live extends Plots {
    constructor() {
        super();
        this.charts = new Charts(() => this.hold(true));
        this.held = false;
        this.drawn = { arm: 0, charts: 0 };
        this.heard = performance.now();
        this.connection = element("p", { class: "connection", role: "status" }, "Connecting to the program.");
        this.state = element("div", { class: "numbers" });
        this.fault = element("p", { class: "bad fault" });
        this.answer = element("p", { class: "answer", role: "status" });
        this.urgent = element("div", { class: "bar urgently" });
        this.words = element("ol", { class: "words" });
        this.frames = element("tbody");
        this.count = element("p", { class: "hint always" });
        this.holding = element("button", { type: "button", "aria-pressed": "false", click: () => this.hold(!this.held) }, "Hold the picture");
        this.panel = element("div", { class: "panel" });
        this.scenes = [new LiveTop(), new LiveSide()];
        this.mark = element("span", { class: "key key-alarm" }, "target of the next move");
        this.title = element("h1", {}, "Live");
        this.compose();
        new Stream({
            connected: (on) => this.connected(on),
            setup: (setup) => this.begin(setup),
            glimpse: ({ moments }) => this.take(moments),
            table: (table) => this.tabulate(table),
            word: (word) => this.tell(word),
        });
        this.panel.addEventListener("input", () => this.aim());
        addEventListener("keydown", (event) => {
            const [stop] = this.urgent.children;
            if (event.key === "Escape" && stop && !stop.disabled) {
                stop.click();
            }
        });
        const turn = () => {
            this.draw();
            requestAnimationFrame(turn);
        };
        requestAnimationFrame(turn);
        setInterval(() => this.connected(this.isConnected), 500);
    }

    compose() {
        const [top, side] = this.scenes;
        const figure = (scene, caption) => element("figure", { class: "scene" }, element("figcaption", {}, element("b", {}, caption)), scene.view.canvas);
        const key = element("p", { class: "hint always" }, element("span", { class: "key key-reference" }, "reference"), element("span", { class: "key key-actual" }, "actual"), this.mark);
        const log = element("div", { class: "log", tabindex: 0, role: "log", "aria-label": "What happens" }, this.words);
        const heads = ["Identifier", "Message", "per second", "lost", "bad", "newest"].map((name) => element("th", { scope: "col" }, name));
        const table = element("table", { class: "frames" }, element("thead", {}, element("tr", {}, ...heads)), this.frames);
        const results = element(
            "div", { class: "results" },
            this.section("Motion", element("div", { class: "row two" }, figure(top, "From above"), figure(side, "From the side")), key),
            this.section("What happens", log),
            this.section("States", this.charts.add(this.states())),
            this.section("Tool", this.charts.add(this.tool())),
            this.section("Axes", ...AXES.map((axis, number) => this.axis(axis, number))),
            this.section("Bus and loop", element("div", { class: "row two" }, ...this.bus().map((chart) => this.charts.add(chart)))),
            this.section("Frames", this.count, element("div", { class: "scroll", tabindex: 0, role: "region", "aria-label": "Frames by identifier" }, table)),
        );
        const bar = element("section", { class: "verdict live", "aria-label": "State" }, element("div", { class: "head" }, element("div", {}, this.title, this.connection), this.state, this.urgent), element("div", { class: "said" }, this.fault, this.answer));
        document.querySelector("main").replaceChildren(bar, element("div", { class: "bench live" }, this.panel, results));
    }

    /** The program says what it shows and offers; it may be another run than before. */
    begin(setup) {
        this.run = new LiveRun(setup);
        this.runs = [this.run];
        document.title = `${setup.title} – live`;
        this.title.textContent = setup.title;
        this.words.replaceChildren();
        this.charts.end = undefined;
        this.controls = new Panel(setup.offers, (why) => this.answered(why));
        const looking = setup.offers.length === 0
            ? "This bus is only watched. Without --bus the program runs a bench of its own, which does what is asked for here."
            : this.token ? null : "You are looking. To ask for something, open the URL that the program has printed: it has the token.";
        this.urgent.replaceChildren(...this.controls.urgent);
        this.panel.replaceChildren(looking ? element("p", {}, looking) : "", ...this.controls.groups, element("div", { class: "bar" }, this.holding), element("p", { class: "hint" }, setup.offers.length ? "Escape stops the arm." : ""));
        this.controls.enable(this.token);
        this.aim();
        this.scenes.forEach((scene) => scene.show(this.runs));
    }

    get token() {
        return location.hash.length > 1;
    }

    /** Shows where a move would lead. */
    aim() {
        const values = this.controls.values;
        const target = ["x", "y", "z"].every((key) => values.has(key)) ? ["x", "y", "z"].map((key) => values.get(key)() / 1000) : null;
        this.mark.hidden = target === null;
        this.scenes.forEach((scene) => {
            scene.target = target;
            scene.view.draw();
            if (target) {
                scene.reach(target);
            }
        });
    }

    connected(on) {
        const before = this.isConnected;
        this.isConnected = on;
        const silent = (performance.now() - this.heard) / 1000;
        const words = on === undefined ? "Connecting to the program." : !on ? "The program does not answer. Start it again: this page comes back by itself." : silent > SILENT ? `No feedback of the drives for ${silent.toFixed(0)} s.` : this.held ? "The picture is held." : "Live.";
        if (this.connection.textContent !== words) {
            this.connection.textContent = words;
            this.connection.className = `connection ${on && silent <= SILENT ? "good" : "bad"}`;
        }
        if (on !== before && this.controls) {
            this.controls.enable(on && this.token);
        }
    }

    take(moments) {
        if (this.run && moments.length > 0) {
            this.heard = performance.now();
            this.run.add(moments);
        }
    }

    hold(on) {
        this.held = on;
        this.holding.textContent = on ? "Go on" : "Hold the picture";
        this.holding.setAttribute("aria-pressed", on);
        this.connected(this.isConnected);
    }

    /** Draws what is due. */
    draw() {
        if (this.held || !this.run || this.run.length === 0 || this.run.end === this.drawn.end) {
            return;
        }
        const now = performance.now();
        const [arm, charts] = motionAllowed() ? [PACE.arm, PACE.charts] : [PACE.reduced, PACE.reduced];
        if (now - this.drawn.arm >= arm) {
            this.drawn.arm = now;
            const { elbow, tool } = forward(this.run.robot, this.run.at());
            this.scenes.forEach((scene) => {
                scene.view.draw();
                scene.reach([...elbow, tool[2]]);
                scene.reach(tool);
            });
        }
        if (now - this.drawn.charts >= charts) {
            Object.assign(this.drawn, { charts: now, end: this.run.end });
            this.charts.t = this.run.end;
            this.charts.show(this.runs);
            this.charts.zoom(this.run.end - SHOWN, this.run.end);
            this.charts.all.forEach((chart) => chart.read(chart.plot.cursor.idx ?? this.run.length - 1));
        }
    }

    /** State and frames. */
    tabulate({ frames, missed, rows, state, scripted }) {
        const load = this.run?.moments.at(-1)?.[1][NUMBERS.indexOf("bus_load")] ?? null;
        const tiles = [
            ["state", state?.mode ?? "unknown", state ? STATE_COLOURS[state.mode] ?? "fault" : null],
            ["law", state?.law ?? "–"],
            ["moves left", state?.queue ?? "–"],
            ["bus load", load === null ? "–" : `${(100 * load).toFixed(0)} %`],
            ["who leads", this.controls?.groups.length ? (scripted ? "the scenario" : "the page") : "others"],
        ];
        this.state.replaceChildren(...tiles.map(([name, value, looks]) => {
            const text = element("b", { class: looks ? "chip" : null }, value);
            if (looks) {
                text.style.background = colour(looks);
            }
            return element("div", {}, text, element("span", {}, name));
        }));
        this.fault.textContent = state?.fault ?? "";
        this.count.textContent = `${frames} frames so far${missed ? `, ${missed} more could not be shown` : ""}.`;
        const cells = ({ id, name, rate_hz, lost, bad, text }) => [name, digits(rate_hz), lost, bad, text].reduce((row, cell) => {
            row.append(element("td", {}, String(cell)));
            return row;
        }, element("tr", {}, element("th", { scope: "row" }, id)));
        if (!this.held) {
            this.frames.replaceChildren(...rows.map(cells));
        }
    }

    tell({ t, text, kind }) {
        this.words.prepend(element("li", { class: kind }, element("span", { class: "time" }, `${t.toFixed(3)} s`), ` ${text}`));
        while (this.words.children.length > WORDS) {
            this.words.lastChild.remove();
        }
        if (kind !== "bus") {
            this.answered(text, kind);
        }
    }

    /** The last answer, in sight wherever the page is scrolled to. */
    answered(text, kind = "bad") {
        if (text !== null) {
            this.answer.textContent = text;
            this.answer.className = `answer ${kind}`;
        }
    }
}

new Live();
