// The page that runs the simulation, in a browser:
//
//   node tests/pages/what-if.mjs WHAT-IF.html PLANT-SIM PICTURES
//
// PLANT-SIM is the program that the page's lines are run with.
import { spawnSync } from "node:child_process";
import { createHash } from "node:crypto";
import { mkdtempSync, readFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";
import { SCREENS, accessible, check, pixels, sound, unlike, withBrowser } from "./browser.mjs";

const [file, program, pictures] = process.argv.slice(2);
const ARM = "The arm from above, with the path of its tool";

const trace = (page) => page.locator("#trace").innerText();

/** Does something that makes the page run again, and waits for what comes out. */
async function again(page, act) {
    const before = await trace(page);
    await act();
    await page.waitForFunction((was) => document.querySelector("#trace").textContent !== was, before);
}

async function loaded(page) {
    await page.waitForFunction(() => document.querySelector("#trace")?.textContent.length === 64);
}

/** The lines that the page shows, run by a shell, write a trace with the hash that the page shows. */
async function sameOnTheCommandLine(page) {
    const folder = mkdtempSync(join(tmpdir(), "what-if-"));
    const lines = await page.getByRole("region", { name: "Command", exact: true }).innerText();
    // A run that a fault ends returns 1.
    const { status, stderr } = spawnSync("bash", ["-ec", lines], { cwd: folder, env: { ...process.env, PATH: `${dirname(program)}:${process.env.PATH}` } });
    check(status === 0 || status === 1, `${stderr}`);
    const hash = createHash("sha256").update(readFileSync(join(folder, "out/trace.log"))).digest("hex");
    check(hash === (await trace(page)), `the page has trace ${await trace(page)}, plant-sim ${hash}, for\n${lines}`);
}

/** Another value than the one it has, by the keyboard. */
async function change(control) {
    const select = (await control.evaluate((element) => element.tagName)) === "SELECT";
    await control.focus();
    const next = select && (await control.evaluate((element) => element.selectedIndex + 1));
    await (select ? control.selectOption({ index: next }) : control.press("ArrowRight"));
}

await withBrowser(async (open) => {
    for (const screen of SCREENS) {
        const page = await open(file, "", screen);
        await loaded(page);
        await page.getByLabel("Time", { exact: true }).fill("0.4");
        await page.screenshot({ path: `${pictures}/what-if-${screen.name}.png` });
        await sound(page);
        await accessible(page);
    }

    const page = await open(file);
    await loaded(page);
    await sameOnTheCommandLine(page);
    const controls = page.getByRole("region", { name: "Settings" }).locator("input, select");
    const count = await controls.count();
    check(count === 14, `${count} settings`);
    for (let index = 0; index < count; index += 1) {
        const control = controls.nth(index);
        const name = await control.getAttribute("id");
        const drawn = await Promise.all(["Lift error over time", "Shoulder error over time", "Bus load over time"].map((chart) => pixels(page, chart)));
        await again(page, () => change(control));
        const now = await Promise.all(["Lift error over time", "Shoulder error over time", "Bus load over time"].map((chart) => pixels(page, chart)));
        check(drawn.some((picture, chart) => picture.width !== now[chart].width || unlike(picture, now[chart]) > 20), `${name} changes no chart`);
        check((await page.url()).includes(`${name}=`), `${name} is not in the link`);
    }
    await sameOnTheCommandLine(page);

    // The fault stops the arm: it is listed, and its link leads to its moment and changes no setting.
    const stopped = await trace(page);
    const fault = page.getByRole("region", { name: "States, faults and requirements" }).getByRole("link").first();
    const moment = Number((await fault.getAttribute("href")).slice("#t=".length));
    check(moment >= Number(await page.getByLabel("Fault, when").inputValue()), `the fault is seen at ${moment} s, before it is there`);
    const settings = page.url();
    await fault.press("Enter");
    await page.waitForFunction((at) => Math.abs(document.querySelector("input[aria-label=Time]").value - at) < 0.002, moment);
    check(page.url() === settings && (await trace(page)) === stopped, "the link to a moment changes the settings");

    // Whoever opens the link has the same run.
    const hash = new URL(page.url()).hash;
    const other = await open(file, hash);
    await loaded(other);
    check((await trace(other)) === (await trace(page)), `the link ${hash} leads to another run`);

    // Kept beside a new one, a run is drawn in the colour of the second.
    const alone = await pixels(page, ARM);
    await page.getByRole("button", { name: "Keep to compare" }).press("Enter");
    await again(page, () => page.getByLabel("Gate, x of its middle").fill("500"));
    check(unlike(alone, await pixels(page, ARM)) > 500, "the arm is where it was");
    await page.getByRole("button", { name: "Stop comparing" }).press("Enter");
    await again(page, () => page.getByRole("button", { name: "Start again" }).press("Enter"));
    check(new URL(page.url()).hash.length <= 1, "the link names settings that are as at the start");

    // What cannot be run says why, and the next change recovers.
    const far = await open(file, "#x=950&width=500");
    await far.waitForFunction(() => /outside|reach|refused/.test(document.querySelector(".verdict").textContent));

    const speed = await page.locator("#speed").innerText();
    console.log(`  what-if: ${count} settings act, link and command line give the same trace; ${speed}`);
});
