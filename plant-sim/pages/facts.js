// What is said of runs in words and numbers.

/** Name and value of all that is said of a run in one line. */
function facts({ results }) {
    const { models, mismatch, gains } = results;
    const share = (values) => AXES.map(({ name }, axis) => `${name.toLowerCase()} ${(100 * values[axis]).toFixed(0)} %`).join(", ");
    return [
        ["Scenario", results.scenario],
        ["Nominal robot (the controller's model)", `${models.controller.name}, ${models.controller.origin}`],
        ["Actual robot (the plant)", `${models.robot.name}, ${models.robot.origin}`],
        ["Friction and payload, actual over nominal", `${mismatch.friction}, ${mismatch.payload}`],
        ["Law", results.law],
        ["Gains", `bandwidth ${digits(gains.bandwidth)} rad/s, damping ${digits(gains.damping)}, observer ${digits(gains.observer)} rad/s`],
        ["Rate", `${results.rate_hz} Hz`],
        ["Payload", `${results.payload_kg} kg`],
        ["Cycles", `${results.cycles} of ${results.cycles_asked}`],
        ["Cycle time, mean", `${digits(results.cycle_time_s?.mean)} s`],
        ["Settling to 0.01 mm and 0.1 mrad, mean", results.settle_time_s ? `${digits(1000 * results.settle_time_s.mean)} ms` : "not in every cycle"],
        ["Tracking error, RMS and peak", `${digits(results.tracking_error_mm.rms)} mm, ${digits(results.tracking_error_mm.max)} mm`],
        ["Peak torque over limit", share(results.torque_utilisation)],
        ["RMS torque over continuous rating", share(results.thermal_utilisation)],
        ["Warmest motor, over what it may have for ever", `${results.heat.warmest} ${(100 * results.heat.greatest).toFixed(0)} %${results.heat.slowed_from_s === null ? "" : `, moves slowed down from ${digits(results.heat.slowed_from_s)} s on`}`],
        ["Peak speed over limit", share(results.speed_utilisation)],
        ["Bus", `${(100 * results.bus_load).toFixed(1)} % load, ${results.frames} frames, ${results.frames_lost} lost, ${results.overruns} commands late${results.bus_errors ? `, ${results.bus_errors} errors` : ""}`],
        ["Simulated time", `${digits(results.sim_time_s)} s`],
        ["SHA-256 of trace.log", results.trace_sha256],
        ["Program", results.version ? `plant-sim ${results.version} (${results.commit})` : "this page"],
    ];
}

/** How a run ended, in a few words. */
function outcome({ completed, stopped, ends, error, requirements: all }) {
    const missed = all.filter(({ met }) => !met).length;
    const judged = missed > 0 ? `, ${missed} of ${all.length} requirements missed` : all.length > 0 ? ", every requirement met" : "";
    if (ends === "stopped") {
        return (completed ? "completed, though it was to be stopped" : stopped ? "stopped, as it was to be" : `not stopped: ${error}`) + judged;
    }
    return (completed ? "completed" : `not completed: ${error}`) + judged;
}

/** A link to a moment of the run. */
function momentLink(t) {
    return element("a", { href: `#t=${t.toFixed(4)}` }, `${t.toFixed(3)} s`);
}

/** The moment that the link of the page leads to, if it does. */
function momentOfLink() {
    const [, t] = /^#t=([\d.]+)$/.exec(location.hash) ?? [];
    return t === undefined ? null : +t;
}

/** What is required, in a sentence: "tracking_error_mm of the elbow at most 0.1 in cycle 2". */
function limitOf({ quantity, axis, state, min, max, cycle, during }) {
    const of = axis ? ` of the ${axis}` : state ? ` of ${state}` : "";
    const limit = min === undefined ? `at most ${max}` : max === undefined ? `at least ${min}` : `${min} to ${max}`;
    const where = (cycle ? ` in cycle ${cycle}` : "") + (during ? ` from ${during[0]} to ${during[1]} s` : "");
    return `${quantity}${of} ${limit}${where}`;
}

/** The requirements of a run with their verdicts: a table of this name, or nothing where there are none. */
function requirements(all, name) {
    if (all.length === 0) {
        return [];
    }
    const row = (verdict) => {
        const { id, text, met, value, margin, time_s: t } = verdict;
        const word = element("span", { class: met ? "good" : "bad" }, met ? "met" : "missed");
        const when = t === null ? "never measured" : momentLink(t);
        const cells = [word, text, limitOf(verdict), digits(value), digits(margin), when];
        return element("tr", {}, element("th", { scope: "row" }, id), ...cells.map((cell) => element("td", {}, cell)));
    };
    const heads = ["Requirement", "Verdict", "Text", "Limit", "Value", "Margin", "Nearest at"];
    const head = element("thead", {}, element("tr", {}, ...heads.map((name) => element("th", { scope: "col" }, name))));
    const table = element("table", { class: "verdicts" }, head, element("tbody", {}, ...all.map(row)));
    return [element("div", { class: "scroll", tabindex: 0, role: "region", "aria-label": name }, table)];
}

/** The letter of a run, in its colour. */
function runKey(number) {
    return element("span", { class: `key key-${RUN_COLOURS[number]}` }, "AB"[number]);
}

/** A run's name in a line, and whether it got to its end. */
function title(run, number, all) {
    const { results } = run;
    const key = all.length > 1 ? runKey(number) : null;
    const verdict = element("span", { class: results.passed ? "good" : "bad" }, outcome(results));
    return element("p", { class: "title" }, key, `${all.length > 1 ? ` ${results.scenario}: ` : ""}${results.law}, ${results.payload_kg} kg, ${results.rate_hz} Hz, ${results.cycles} ${results.cycles === 1 ? "cycle" : "cycles"} – `, verdict);
}

/** The facts, a column for each run; those in which they differ stand out. */
function table(runs) {
    const columns = runs.map(facts);
    const rows = columns[0].map(([name], row) => {
        const values = columns.map((column) => column[row][1]);
        const unlike = values.some((value) => value !== values[0]);
        return element("tr", { class: unlike ? "unlike" : null }, element("th", { scope: "row" }, name), ...values.map((value) => element("td", {}, value)));
    });
    const heads = runs.map((_, number) => element("th", { scope: "col" }, runKey(number)));
    const head = runs.length > 1 ? element("thead", {}, element("tr", {}, element("td"), ...heads)) : null;
    return element("div", { class: "scroll", tabindex: 0, role: "region", "aria-label": "Facts and results" }, element("table", {}, head, element("tbody", {}, ...rows)));
}
