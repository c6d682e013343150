// The arm seen from above and from the side, and the path of its tool with the deviation magnified.

function boxOf(points) {
    const box = { left: Infinity, right: -Infinity, bottom: Infinity, top: -Infinity };
    for (const [x, y] of points) {
        box.left = Math.min(box.left, x);
        box.right = Math.max(box.right, x);
        box.bottom = Math.min(box.bottom, y);
        box.top = Math.max(box.top, y);
    }
    return box;
}

/** From metres to pixels of a canvas: one scale both ways, the box in the middle. */
function fit(box, width, height, margin) {
    const [across, up] = [Math.max(box.right - box.left, 1e-3), Math.max(box.top - box.bottom, 1e-3)];
    const scale = Math.min((width - 2 * margin) / across, (height - 2 * margin) / up);
    const [x, y] = [(box.left + box.right) / 2, (box.bottom + box.top) / 2];
    return { scale, to: (point) => [width / 2 + (point[0] - x) * scale, height / 2 - (point[1] - y) * scale] };
}

function stroke(context, points, width, style) {
    context.beginPath();
    points.forEach(([x, y]) => context.lineTo(x, y));
    Object.assign(context, { lineWidth: width, strokeStyle: style, lineCap: "round", lineJoin: "round" });
    context.stroke();
}

function disc(context, [x, y], radius, fill) {
    context.beginPath();
    context.arc(x, y, radius, 0, 2 * Math.PI);
    Object.assign(context, { fillStyle: fill, lineWidth: 1.5, strokeStyle: colour("ink") });
    context.fill();
    context.stroke();
}

/** A round length, in the lower right corner. */
function ruler(context, width, height, scale) {
    const lengths = [0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1];
    const metres = lengths.find((length) => length * scale > 40) ?? 1;
    const [left, right, low] = [width - 10 - metres * scale, width - 10, height - 10];
    stroke(context, [[left, low - 4], [left, low], [right, low], [right, low - 4]], 1, colour("ink"));
    Object.assign(context, { fillStyle: colour("ink"), font: "12px system-ui, sans-serif", textAlign: "right" });
    context.fillText(`${metres * 1000} mm`, right, low - 6);
}

/** Sizes for the eye alone, m. */
const LOOKS = { link: 0.07, above: 0.055, base: 0.09, floor: -0.35, shaft: 0.03, shaftLength: 0.5, pointer: 0.06 };

/** A picture of runs at a time. Those that extend it say what they cover and how they draw one run. */
class Scene {
    constructor(label, margin) {
        this.runs = [];
        this.t = 0;
        this.view = new Canvas(label, (context, width, height) => {
            if (this.runs.length === 0) {
                return;
            }
            this.box ??= boxOf(this.cover());
            const { scale, to } = fit(this.box, width, height, margin);
            // The first one last: it covers the others.
            for (const number of [...this.runs.keys()].reverse()) {
                const looks = { own: colour(RUN_COLOURS[number]), body: colour(number === 0 ? "body" : "ghost"), scale, to };
                this.paint(context, this.runs[number], looks);
            }
            ruler(context, width, height, scale);
        });
    }

    show(runs) {
        this.runs = runs;
        this.box = null;
        this.view.draw();
    }

    move(t) {
        this.t = t;
        this.view.draw();
    }

    /** Every sixteenth pose of every run: elbow, tool and yaw. */
    poses() {
        return this.runs.flatMap((run) => {
            const numbers = Array.from({ length: Math.ceil(run.length / 16) }, (_, index) => 16 * index);
            return numbers.map((number) => forward(run.robot, run.pose(number).actual));
        });
    }

    paths(context, run, { own, to }, flat) {
        if (run === this.runs[0]) {
            stroke(context, run.path.map(({ reference }) => to(flat(reference))), 2.5, colour("reference"));
        }
        stroke(context, run.path.map(({ actual }) => to(flat(actual))), 1.2, own);
    }
}

/** x to the right, y up. */
class TopView extends Scene {
    constructor() {
        super("The arm from above, with the path of its tool", 36);
    }

    cover() {
        return [[-LOOKS.base, -LOOKS.base], [LOOKS.base, LOOKS.base], ...this.poses().flatMap(({ elbow, tool }) => [elbow, tool])];
    }

    paint(context, run, looks) {
        const { own, body, scale, to } = looks;
        const { elbow, tool, yaw } = forward(run.robot, run.at(this.t));
        stroke(context, [to([0, 0]), to(elbow)], LOOKS.link * scale * 1.1, body);
        stroke(context, [to(elbow), to(tool)], LOOKS.link * scale * 0.85, body);
        this.paths(context, run, looks, (place) => place);
        for (const joint of [[0, 0], elbow]) {
            disc(context, to(joint), LOOKS.link * scale * 0.3, colour("paper"));
        }
        const point = [tool[0] + LOOKS.pointer * Math.cos(yaw), tool[1] + LOOKS.pointer * Math.sin(yaw)];
        stroke(context, [to(tool), to(point)], 3, own);
        disc(context, to(tool), Math.max(LOOKS.shaft * scale * 0.5, 4), own);
    }
}

/** x to the right, z up. */
class SideView extends Scene {
    constructor() {
        super("The arm from the side, with the path of its tool", 24);
    }

    cover() {
        const arm = this.poses().flatMap(({ elbow, tool: [x, , z] }) => [[elbow[0], 0], [x, z], [x, z + LOOKS.shaftLength]]);
        return [[-LOOKS.base, LOOKS.floor], [LOOKS.base, 0.1], ...arm];
    }

    paint(context, run, looks) {
        const { own, body, scale, to } = looks;
        const { elbow, tool: [x, , z] } = forward(run.robot, run.at(this.t));
        const lower = run.robot.d1;
        const upper = lower + run.robot.d2 + LOOKS.above;
        stroke(context, [to([0, LOOKS.floor]), to([0, lower - LOOKS.above])], LOOKS.base * scale, body);
        stroke(context, [to([x, z]), to([x, z + LOOKS.shaftLength])], LOOKS.shaft * scale, own);
        stroke(context, [to([0, lower]), to([elbow[0], lower])], LOOKS.link * scale * 0.8, body);
        stroke(context, [to([elbow[0], upper]), to([x, upper])], LOOKS.link * scale, body);
        for (const joint of [[0, lower], [elbow[0], upper]]) {
            disc(context, to(joint), LOOKS.link * scale * 0.25, colour("paper"));
        }
        this.paths(context, run, looks, ([px, , pz]) => [px, pz]);
        disc(context, to([x, z]), 4, own);
    }
}

/** The path of the tool alone, seen across its longest way: what the arm deviates from it is drawn `factor` times as large. */
class PathView extends Scene {
    constructor() {
        super("The path of the tool, reference and actual", 30);
        this.factor = 1;
    }

    show(runs) {
        const places = runs[0].path.map(({ reference }) => reference);
        const box = boxOf(places);
        const [x, y] = [(box.left + box.right) / 2, (box.bottom + box.top) / 2];
        // The diagonal that the path follows: x and y grow together, or one falls while the other grows.
        const together = places.reduce((sum, place) => sum + (place[0] - x) * (place[1] - y), 0);
        const way = Math.atan2((together < 0 ? -1 : 1) * (box.top - box.bottom), box.right - box.left);
        this.flat = ([px, py, pz]) => [(px - x) * Math.cos(way) + (py - y) * Math.sin(way), pz];
        super.show(runs);
    }

    cover() {
        return this.runs[0].path.map(({ reference }) => this.flat(reference));
    }

    paint(context, run, { own, to }) {
        const deviated = ({ reference, actual }) => {
            const [one, other] = [this.flat(reference), this.flat(actual)];
            return to(one.map((value, axis) => value + this.factor * (other[axis] - value)));
        };
        if (run === this.runs.at(-1)) {
            stroke(context, this.cover().map(to), 2.5, colour("reference"));
        }
        stroke(context, run.path.map(deviated), 1.2, own);
        const index = Math.round(this.t / (run.drawing.step_s * run.drawing.samples_per_pose));
        disc(context, deviated(run.path[Math.min(index, run.length - 1)]), 5, own);
    }
}
