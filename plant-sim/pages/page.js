// What every part of a page uses: elements, colours, numbers.

/** An element with attributes (functions are listeners) and children. */
function element(tag, attributes = {}, ...children) {
    const made = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) {
        if (typeof value === "function") {
            made.addEventListener(name, value);
        } else if (value !== null) {
            made.setAttribute(name, value);
        }
    }
    made.append(...children.filter((child) => child !== null));
    return made;
}

/** A colour of the style sheet, in the scheme of the moment. */
function colour(name) {
    return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
}

/** Calls `listener` when light turns to dark or back. */
function onScheme(listener) {
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", listener);
}

/** Whether things may move by themselves. */
function motionAllowed() {
    return !matchMedia("(prefers-reduced-motion: reduce)").matches;
}

/** A number with about four digits, without an exponent where it can be. */
function digits(value) {
    if (value === null || value === undefined) {
        return "–";
    }
    const size = Math.abs(value);
    if (size !== 0 && (size < 1e-4 || size >= 1e6)) {
        return value.toExponential(2);
    }
    const decimals = size >= 100 ? 1 : size >= 10 ? 2 : size >= 1 ? 3 : 4;
    return value.toFixed(decimals);
}

/** The colours of the runs that are on one page, by their number. */
const RUN_COLOURS = ["actual", "other"];

/** A canvas as wide as its place, sharp on every screen; `draw` gets the context and the size in CSS pixels. */
class Canvas {
    constructor(label, draw) {
        this.canvas = element("canvas", { role: "img", "aria-label": label });
        this.drawing = draw;
        new ResizeObserver(() => this.draw()).observe(this.canvas);
        onScheme(() => this.draw());
    }

    draw() {
        const { clientWidth: width, clientHeight: height } = this.canvas;
        if (width === 0 || height === 0) {
            return;
        }
        const ratio = devicePixelRatio || 1;
        const [across, down] = [Math.round(width * ratio), Math.round(height * ratio)];
        if (this.canvas.width !== across || this.canvas.height !== down) {
            [this.canvas.width, this.canvas.height] = [across, down];
        }
        const context = this.canvas.getContext("2d");
        context.setTransform(ratio, 0, 0, ratio, 0, 0);
        context.clearRect(0, 0, width, height);
        this.drawing(context, width, height);
    }
}
