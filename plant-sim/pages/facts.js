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
        ["Peak speed over limit", share(results.speed_utilisation)],
        ["Bus", `${(100 * results.bus_load).toFixed(1)} % load, ${results.frames} frames, ${results.frames_lost} lost, ${results.overruns} commands late`],
        ["Simulated time", `${digits(results.sim_time_s)} s`],
        ["SHA-256 of trace.log", results.trace_sha256],
        ["Program", results.version ? `plant-sim ${results.version} (${results.commit})` : "this page"],
    ];
}

/** A run's name in a line, and whether it got to its end. */
function title(run, number, all) {
    const { results } = run;
    const key = all.length > 1 ? element("span", { class: `key key-${RUN_COLOURS[number]}` }, "AB"[number]) : null;
    const verdict = results.completed ? element("span", { class: "good" }, "completed") : element("span", { class: "bad" }, `not completed: ${results.error}`);
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
    const heads = runs.map((_, number) => element("th", { scope: "col" }, element("span", { class: `key key-${RUN_COLOURS[number]}` }, "AB"[number])));
    const head = runs.length > 1 ? element("thead", {}, element("tr", {}, element("td"), ...heads)) : null;
    return element("div", { class: "scroll", tabindex: 0, role: "region", "aria-label": "Facts and results" }, element("table", {}, head, element("tbody", {}, ...rows)));
}
