// Time as the arm plays it: a button, a slider and a speed.

class Player {
    /** @param onTime is called with every time that is shown */
    constructor(onTime) {
        this.onTime = onTime;
        this.t = 0;
        this.end = 0;
        this.playing = false;
        this.button = element("button", { type: "button", click: () => this.play(!this.playing) }, "Play");
        this.slider = element("input", { type: "range", min: 0, max: 1, step: 0.001, value: 0, "aria-label": "Time", input: () => this.seek(+this.slider.value) });
        const speeds = [0.05, 0.1, 0.25, 0.5, 1, 2].map((speed) => element("option", { value: speed }, `× ${speed}`));
        this.speed = element("select", { "aria-label": "Speed, times real time" }, ...speeds);
        this.speed.value = "0.25";
        this.text = element("output", { class: "time" });
        this.bar = element("div", { class: "bar" }, this.button, this.slider, this.text);
    }

    /** A run of this length, s, is there. The time stays where it can. */
    show(end) {
        this.end = end;
        this.slider.max = end;
        this.shift(Math.min(this.t, end));
    }

    /** A person chose a time: it stays. */
    seek(t) {
        this.play(false);
        this.shift(t);
    }

    play(on) {
        this.playing = on;
        this.button.textContent = on ? "Pause" : "Play";
        if (on) {
            this.last = performance.now();
            requestAnimationFrame((now) => this.frame(now));
        }
    }

    frame(now) {
        if (!this.playing) {
            return;
        }
        // A page that was hidden goes on where it stopped.
        const passed = Math.min(now - this.last, 100) / 1000;
        this.last = now;
        const t = this.t + passed * +this.speed.value;
        this.shift(t > this.end ? 0 : t);
        requestAnimationFrame((later) => this.frame(later));
    }

    shift(t) {
        this.t = Math.min(Math.max(t, 0), this.end);
        this.slider.value = this.t;
        this.text.textContent = `${this.t.toFixed(3)} s`;
        this.slider.setAttribute("aria-valuetext", `${this.t.toFixed(3)} seconds`);
        this.onTime(this.t);
    }
}
