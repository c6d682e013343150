// The last seconds of a run that goes on, as the charts and the arm draw it.

/** Seconds that are kept. */
const KEPT = 20;
/** Names of the numbers of a moment, after its time. */
const NUMBERS = ["q1", "q2", "q3", "q4", "error1", "error2", "error3", "error4", "effort1", "effort2", "effort3", "effort4", "bus_load", "latency", "mode"];

class LiveRun extends Run {
    /** Nothing yet of what the server has described. */
    constructor({ robot, modes, step_s }) {
        super({ results: { faults: [], requirements: [] }, drawing: { robot, modes, step_s, samples: 0, samples_per_pose: 1, poses: "", curves: {}, cycles: [] } });
        this.moments = [];
        this.end = 0;
    }

    /** Moments of the stream: time and numbers. */
    add(moments) {
        for (const moment of moments) {
            // A bus that begins anew, or a clock that was set back.
            if (moment[0] < this.end) {
                this.moments = [];
            }
            this.moments.push(moment);
            this.end = moment[0];
        }
        const first = this.moments.findIndex(([t]) => t > this.end - KEPT);
        this.moments.splice(0, first);
        this.times = null;
        this.places = null;
        this.spans = null;
    }

    get time() {
        this.times ??= this.moments.map(([t]) => t);
        return this.times;
    }

    curve(name, scale = 1) {
        if (name === "tool_error") {
            return this.path.map(({ reference, actual }) => scale * Math.hypot(...reference.map((value, axis) => value - actual[axis])));
        }
        const place = NUMBERS.indexOf(name);
        return this.moments.map(([, numbers]) => (numbers[place] === null ? null : scale * numbers[place]));
    }

    get length() {
        return this.moments.length;
    }

    pose(index) {
        const [, numbers] = this.moments[index];
        const actual = numbers.slice(0, 4);
        return { actual, reference: actual.map((value, axis) => value + numbers[4 + axis]) };
    }

    /** Joint positions of the newest moment, whatever the time: a page that lives has no other. */
    at() {
        return this.moments.at(-1)[1].slice(0, 4);
    }
}

/** The stream of the server. It comes back by itself, and says so. */
class Stream {
    /** @param on what to call with what the server sends, by its kind, and with `connected` */
    constructor(on) {
        this.source = new EventSource("/stream");
        this.source.onopen = () => on.connected(true);
        this.source.onerror = () => {
            on.connected(false);
            // A server that has refused once is not asked again by the browser.
            if (this.source.readyState === EventSource.CLOSED) {
                setTimeout(() => new Stream(on), 1000);
            }
        };
        for (const kind of ["setup", "glimpse", "table", "word"]) {
            this.source.addEventListener(kind, ({ data }) => on[kind](JSON.parse(data)));
        }
    }
}

/** Asks the server for something; returns why not, or nothing. */
async function ask(what) {
    try {
        const headers = { "Content-Type": "application/json", Authorization: `Bearer ${location.hash.slice(1)}` };
        const response = await fetch("/do", { method: "POST", headers, body: JSON.stringify(what) });
        return response.ok ? null : (await response.json()).error;
    } catch {
        return "The program does not answer: it has ended, or is out of reach.";
    }
}
