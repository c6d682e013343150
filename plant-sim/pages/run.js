// A run as the pages draw it: decoded curves, and the arm at any time.

const AXES = [
    { name: "Shoulder", unit: "°", scale: 180 / Math.PI, effort: "N m" },
    { name: "Elbow", unit: "°", scale: 180 / Math.PI, effort: "N m" },
    { name: "Lift", unit: "mm", scale: 1000, effort: "N" },
    { name: "Wrist", unit: "°", scale: 180 / Math.PI, effort: "N m" },
];

/** Little-endian 32-bit floats in base64. */
function floats(base64) {
    const bytes = Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
    const view = new DataView(bytes.buffer);
    return Float32Array.from({ length: bytes.length / 4 }, (_, index) => view.getFloat32(4 * index, true));
}

/** Where the joints are for joint positions `q`: closed form, frame 0, m. */
function forward(robot, q) {
    const elbow = [robot.a1 * Math.cos(q[0]), robot.a1 * Math.sin(q[0])];
    const angle = q[0] + q[1];
    const tool = [elbow[0] + robot.a2 * Math.cos(angle), elbow[1] + robot.a2 * Math.sin(angle)];
    const z = robot.d1 + robot.d2 - q[2] - robot.d4;
    return { elbow, tool: [...tool, z], yaw: angle - q[3] };
}

class Run {
    /** What the program has written: results as summary.json has them, and a drawing. */
    constructor({ results, drawing }) {
        this.results = results;
        this.drawing = drawing;
        this.robot = this.drawing.robot;
        this.end = Math.max(this.drawing.samples - 1, 1) * this.drawing.step_s;
        this.poses = floats(this.drawing.poses);
        this.modes = new Map(this.drawing.modes);
        this.decoded = new Map();
        this.times = null;
    }

    /** Times of the values of the curves, s. */
    get time() {
        const { step_s, samples, samples_per_value } = this.drawing;
        const step = step_s * samples_per_value;
        // A value that stands for one sample is at it; one for several is in their middle.
        const first = ((samples_per_value - 1) / 2) * step_s;
        this.times ??= Array.from({ length: Math.ceil(samples / samples_per_value) }, (_, index) => first + index * step);
        return this.times;
    }

    /** The values of a curve times `scale`; null where there is none. */
    curve(name, scale = 1) {
        if (!this.decoded.has(name)) {
            this.decoded.set(name, floats(this.drawing.curves[name]));
        }
        const values = this.decoded.get(name);
        return this.time.map((_, index) => (Number.isNaN(values[index]) ? null : values[index] * scale));
    }

    /** Faults in their order; the same again is left out. */
    get faults() {
        return this.results.faults.filter(({ text }, index, all) => text !== all[index - 1]?.text).slice(0, 100);
    }

    /** Number of poses. */
    get length() {
        return this.poses.length / 8;
    }

    /** Joint positions of a pose by its number, the actual ones and those of the reference. */
    pose(index) {
        const row = this.poses.subarray(8 * index, 8 * index + 8);
        return { actual: row.subarray(0, 4), reference: row.subarray(4, 8) };
    }

    /** Actual joint positions at time `t`, between two poses by their share. */
    at(t) {
        const place = t / (this.drawing.step_s * this.drawing.samples_per_pose);
        const before = Math.min(Math.max(Math.floor(place), 0), this.length - 1);
        const after = Math.min(before + 1, this.length - 1);
        const share = Math.min(Math.max(place - before, 0), 1);
        const [one, other] = [this.pose(before).actual, this.pose(after).actual];
        return Array.from(one, (value, axis) => value + share * (other[axis] - value));
    }

    /** Places of the tool, actual and by the reference, one of each for every pose. */
    get path() {
        this.places ??= Array.from({ length: this.length }, (_, index) => {
            const { actual, reference } = this.pose(index);
            return { actual: forward(this.robot, actual).tool, reference: forward(this.robot, reference).tool };
        });
        return this.places;
    }

    /** Spans of time with one state: start, end and name. */
    get states() {
        if (!this.spans) {
            this.spans = [];
            const codes = this.curve("mode");
            codes.forEach((code, index) => {
                const last = this.spans.at(-1);
                if (last?.code === code) {
                    last.to = this.time[index + 1] ?? this.end;
                } else if (code !== null) {
                    const name = this.modes.get(code) ?? `state ${code}`;
                    this.spans.push({ code, name, from: this.time[index], to: this.time[index + 1] ?? this.end });
                }
            });
        }
        return this.spans;
    }
}
