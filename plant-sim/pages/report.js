// report.html: one run, or two to compare.

/** A word as a shell takes it. */
function quoted(word) {
    return /^[\w./:=,@%+-]+$/.test(word) ? word : `'${word.replaceAll("'", "'\\''")}'`;
}

/** How to run it again, and the text of the scenario. */
function again({ results }, number, all) {
    const name = all.length > 1 ? `run ${"AB"[number]}` : "the run";
    const text = (content, label) => element("pre", { tabindex: 0, role: "region", "aria-label": label }, content);
    return [
        element("p", {}, `The command that repeats ${name}:`), text(results.command.map(quoted).join(" "), `Command of ${name}`),
        element("details", {}, element("summary", {}, `Scenario of ${name}`), text(results.scenario_text, `Scenario of ${name}`)),
    ];
}

function report() {
    const runs = JSON.parse(document.getElementById("runs").textContent).map((about) => new Run(about));
    const board = new Board();
    const ran = board.section("Run", table(runs), ...runs.flatMap(again));
    document.querySelector("main").replaceChildren(element("h1", {}, document.title), ...runs.map(title), ...board.parts, ran, board.dock);
    board.show(runs);

    // A moment has a link: #t=1.234 shows it.
    const follow = () => {
        const t = momentOfLink();
        if (t !== null) {
            board.moment(t);
        }
        return t !== null;
    };
    addEventListener("hashchange", follow);
    // A link to where the page already is changes nothing that the browser would tell.
    addEventListener("click", ({ target }) => target.closest?.("a")?.href === location.href && follow());
    if (!follow() && motionAllowed()) {
        board.player.play(true);
    }
}

report();
