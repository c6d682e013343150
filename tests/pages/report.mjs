// The page about a run, in a browser:
//
//   node tests/pages/report.mjs FOLDER-OF-A-RUN FAILED-RUN RUN-WITH-MISSED-REQUIREMENTS COMPARISON.html PICTURES
//
// Pictures of every screen go into the last folder.
import { readFileSync } from "node:fs";
import { SCREENS, accessible, check, pixels, places, rgb, sound, unlike, withBrowser } from "./browser.mjs";

const [run, failed, missed, comparison, pictures] = process.argv.slice(2);
const CHARTS = [
    "State of the controller", "Tool error", "Bus load", "Loop time",
    ...["Shoulder", "Elbow", "Lift", "Wrist"].flatMap((axis) => [`${axis} position`, `${axis} error`, `${axis} ${axis === "Lift" ? "force" : "torque"}`]),
].map((title) => `${title} over time`);

/** Rows of truth.csv by the names of its columns. */
function truth() {
    const [head, ...rows] = readFileSync(`${run}/truth.csv`, "utf8").trimEnd().split("\n").map((row) => row.split(","));
    return rows.map((row) => Object.fromEntries(row.map((value, column) => [head[column], Number(value)])));
}

/** The middle of the pixels of a colour, and how many there are. */
function middle(picture, colour) {
    const found = [...places(picture, colour)];
    const mean = (part) => found.reduce((sum, place) => sum + part(place), 0) / found.length;
    return { count: found.length, x: mean((place) => place % picture.width), y: mean((place) => Math.floor(place / picture.width)) };
}

// The slider takes whole milliseconds in their shortest form alone; a time of the table has a digit of rounding.
const seek = (page, t) => page.getByLabel("Time", { exact: true }).fill(String(Number(t.toFixed(3))));

/** The arm is where the truth has it: the middle of what is drawn of it moves as the middle of the links does. */
async function armFollowsTheTruth(page) {
    const name = "The arm from above, with the path of its tool";
    const body = await rgb(page, "body");
    const rows = truth();
    const reach = rows.map(({ q1 }) => q1);
    const [one, other] = [Math.min(...reach), Math.max(...reach)].map((q1) => rows[reach.indexOf(q1)]);
    const links = ({ q1, x, y }) => {
        // Both links are about as long and as broad: half of the way to the elbow, and half of the way from there to the tool.
        const elbow = [0.56 * Math.cos(q1), 0.56 * Math.sin(q1)];
        return [(2 * elbow[0] + x) / 4, (2 * elbow[1] + y) / 4];
    };
    const seen = [];
    for (const row of [one, other]) {
        await seek(page, row.t);
        seen.push(middle(await pixels(page, name), body));
    }
    check(seen.every(({ count }) => count > 2000), `the arm has ${seen.map(({ count }) => count)} pixels`);
    const [before, after] = [links(one), links(other)];
    const expected = Math.atan2(after[1] - before[1], after[0] - before[0]);
    const found = Math.atan2(seen[0].y - seen[1].y, seen[1].x - seen[0].x);
    const apart = Math.abs(Math.atan2(Math.sin(found - expected), Math.cos(found - expected)));
    check(apart < 0.35, `the arm moves ${found} rad on the page and ${expected} rad in truth.csv`);
}

/** The tool error of the page's readout is the distance in truth.csv, at a place of the chart that is pointed at. */
async function chartsShareCursorAndZoom(page) {
    const place = page.getByRole("img", { name: "Shoulder position over time" });
    const other = page.getByRole("img", { name: "Lift error over time" });
    const readout = (chart) => chart.locator("xpath=..").locator(".readout").innerText();
    const before = await readout(other);
    await place.locator(".u-over").hover();
    check((await readout(other)) !== before, "the cursor of one chart is not that of another");
    const picture = await pixels(page, "Lift error over time");
    const box = await place.locator(".u-over").boundingBox();
    await page.mouse.move(box.x + box.width * 0.3, box.y + 40);
    await page.mouse.down();
    await page.mouse.move(box.x + box.width * 0.5, box.y + 40, { steps: 4 });
    await page.mouse.up();
    const zoomed = await pixels(page, "Lift error over time");
    check(unlike(picture, zoomed) > 100, "zooming into one chart does not zoom another");
    await page.getByLabel("What the charts show").selectOption("");
    await page.getByLabel("What the charts show").selectOption({ label: "Cycle 2" });
    check(unlike(zoomed, await pixels(page, "Lift error over time")) > 100, "choosing a cycle changes nothing");
    await page.getByLabel("What the charts show").selectOption({ label: "Whole run" });
}

async function buttonsAct(page) {
    const time = () => page.getByLabel("Time", { exact: true }).inputValue();
    await seek(page, 0.2);
    const before = await time();
    await page.getByRole("button", { name: "Play" }).press("Enter");
    await page.waitForFunction((was) => document.querySelector("input[aria-label=Time]").value !== was, before);
    await page.getByRole("button", { name: "Pause" }).press("Space");
    const chart = "Tool error over time";
    for (const name of ["Zoom in", "Later", "Earlier", "Zoom out"]) {
        const was = await pixels(page, chart);
        await page.getByRole("button", { name, exact: true }).press("Enter");
        check(unlike(was, await pixels(page, chart)) > 20, `${name} changes nothing`);
    }
    const path = await pixels(page, "The path of the tool, reference and actual");
    await page.getByLabel("Magnification of the deviation").selectOption({ label: "× 1" });
    check(unlike(path, await pixels(page, "The path of the tool, reference and actual")) > 20, "the deviation is not magnified");
}

/** Every requirement has its verdict, a mark among the states, and a link to the moment at which it was nearest to its limit. */
async function requirementsLeadToTheirMoments(page, folder, table = "Requirements") {
    const { requirements } = JSON.parse(readFileSync(`${folder}/summary.json`, "utf8"));
    const rows = page.getByRole("region", { name: table, exact: true }).locator("tbody tr");
    check((await rows.count()) === requirements.length, `${await rows.count()} requirements`);
    for (const [index, { id, met, time_s: t }] of requirements.entries()) {
        const row = rows.nth(index);
        const text = await row.innerText();
        check(text.startsWith(id) && text.includes(met ? "met" : "missed"), `requirement ${id}: ${text}`);
        // From elsewhere, or a link to a moment next to the one that is shown would seem to have been followed before it was.
        await seek(page, t > 0.1 ? 0.05 : 0.2);
        await row.getByRole("link").press("Enter");
        await page.waitForFunction((at) => Math.abs(document.querySelector("input[aria-label=Time]").value - at) < 0.002, t);
    }
    // The last one once more, from elsewhere: the address of the page stays as it is.
    const last = requirements.at(-1).time_s;
    await seek(page, 0.05);
    await rows.last().getByRole("link").press("Enter");
    await page.waitForFunction((at) => Math.abs(document.querySelector("input[aria-label=Time]").value - at) < 0.002, last);
    await page.getByLabel("What the charts show").selectOption({ label: "Whole run" });
    for (const name of new Set(requirements.map(({ met }) => (met ? "good" : "bad")))) {
        const paint = await rgb(page, name);
        const { count } = middle(await pixels(page, "State of the controller over time"), paint);
        check(count > 10, `${count} pixels of a wedge in the colour ${name}`);
    }
}

async function everythingIsDrawn(page) {
    for (const name of CHARTS) {
        const picture = await pixels(page, name);
        const empty = { ...picture, data: picture.data.map(() => 0) };
        check(unlike(picture, empty) > 200, `${name}: nothing is drawn`);
    }
}

await withBrowser(async (open) => {
    for (const screen of SCREENS) {
        for (const [name, file] of [["report", `${run}/report.html`], ["failed", `${failed}/report.html`], ["missed", `${missed}/report.html`], ["comparison", comparison]]) {
            const page = await open(file, "", screen);
            await seek(page, 0.6);
            await page.screenshot({ path: `${pictures}/${name}-${screen.name}.png` });
            // The bar at the lower edge of the screen goes to the end of the page, or it would hide what it lies on.
            await page.evaluate(() => (document.querySelector(".dock").style.position = "static"));
            await page.screenshot({ path: `${pictures}/${name}-${screen.name}-whole.png`, fullPage: true });
            await sound(page);
            await accessible(page);
        }
    }
    const page = await open(`${run}/report.html`);
    await everythingIsDrawn(page);
    await armFollowsTheTruth(page);
    await chartsShareCursorAndZoom(page);
    await buttonsAct(page);
    await requirementsLeadToTheirMoments(page, run);
    await requirementsLeadToTheirMoments(await open(`${missed}/report.html`), missed);
    const both = await open(comparison);
    await requirementsLeadToTheirMoments(both, run, "Requirements of A");
    await requirementsLeadToTheirMoments(both, missed, "Requirements of B");

    const moved = await open(`${run}/report.html`, "", SCREENS[0], "no-preference");
    await moved.waitForFunction(() => Number(document.querySelector("input[aria-label=Time]").value) > 0);

    // The link of a fault leads to its moment.
    const stopped = await open(`${failed}/report.html`);
    const link = stopped.getByRole("link").first();
    const t = Number((await link.getAttribute("href")).slice("#t=".length));
    await link.press("Enter");
    await stopped.waitForFunction((at) => Math.abs(document.querySelector("input[aria-label=Time]").value - at) < 0.01, t);
});
console.log("  every part is drawn, acts and is found by keyboard; axe finds nothing; nothing is asked of anybody");
