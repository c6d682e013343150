// The live page, in a browser, with the program that serves it:
//
//   node tests/pages/view.mjs PLANT-SIM PICTURES
//
// Pictures of every screen go into the last folder.
import { spawn } from "node:child_process";
import { once } from "node:events";
import { mkdtempSync, rmSync } from "node:fs";
import { createServer } from "node:net";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { createInterface } from "node:readline";
import { SCREENS, accessible, check, remember, sound, withBrowser } from "./browser.mjs";

const [program, pictures] = process.argv.slice(2);
const ARM = "The arm from above, with the path of its tool";
const SIDE = "The arm from the side, with the path of its tool";
const started = new Set();
const folder = mkdtempSync(join(tmpdir(), "live-"));

/** Starts the program; where its page is, and how to end it as Ctrl-C does. */
async function start(port = 0, ...args) {
    const child = spawn(program, ["view", "--no-open", "--port", String(port), ...args], { stdio: ["ignore", "pipe", "pipe"] });
    started.add(child);
    let said = "";
    child.stdout.on("data", (data) => (said += data));
    const ended = new Promise((resolve) => child.on("exit", (code) => resolve(code)));
    for await (const line of createInterface({ input: child.stderr })) {
        const [, url] = /the page is at (\S+)/.exec(line) ?? [];
        if (url) {
            const end = async () => {
                started.delete(child);
                child.kill("SIGINT");
                check((await ended) === 0, `the program ends with ${await ended}`);
                return said;
            };
            return { url, port: new URL(url).port, end };
        }
    }
    throw new Error("the program names no page");
}

/** A port that nobody listens on. */
async function freePort() {
    const server = createServer().listen(0, "127.0.0.1");
    await once(server, "listening");
    const { port } = server.address();
    server.close();
    return port;
}

/** Waits until the page says this of the controller's state. */
const state = (page, name) => page.waitForFunction((text) => document.querySelector(".head .chip")?.textContent === text, name);
const log = (page) => page.getByRole("log", { name: "What happens" });
/** Waits until this happens after what has happened so far, and returns how it is told. */
async function happens(page, text, act) {
    const before = await log(page).locator("li").count();
    await act();
    await page.waitForFunction(([words, count]) => {
        const all = [...document.querySelectorAll(".words li")];
        return all.slice(0, all.length - count).some((item) => item.textContent.includes(words));
    }, [text, before]);
}
const press = (page, name) => page.getByRole("button", { name, exact: true }).press("Enter");
const acceptedBy = (page, name, request) => happens(page, `${request}: accepted`, () => press(page, name));

/** The scenario has ended, and the axes stand under torque. */
async function standing(page) {
    await page.waitForFunction(() => document.querySelector(".words")?.textContent.includes("scenario: completed"), null, { timeout: 30_000 });
    await state(page, "enabled");
}

/** The page draws what it does where the arm is: other pixels before and after. */
async function moves(page, act) {
    const changed = await Promise.all([ARM, SIDE].map((name) => remember(page, name)));
    await act();
    await page.waitForFunction(() => document.querySelector(".head").textContent.includes("0moves left"));
    await state(page, "enabled");
    // Until it is drawn.
    await page.waitForTimeout(300);
    return Promise.all(changed.map((count) => count()));
}

async function everyButtonActs(page) {
    const [above] = await moves(page, async () => {
        await page.getByLabel("x", { exact: true }).fill("450");
        await page.getByLabel("y", { exact: true }).fill("300");
        await acceptedBy(page, "Jump", "jump");
        await state(page, "moving");
    });
    check(above > 2000, `a jump changes ${above} pixels of the arm from above`);
    const [, aside] = await moves(page, async () => {
        await page.getByLabel("z", { exact: true }).fill("-200");
        await acceptedBy(page, "Line", "move-line");
    });
    check(aside > 300, `a line upwards changes ${aside} pixels of the arm from the side`);
    const [round] = await moves(page, async () => {
        await page.getByLabel("x on the way", { exact: true }).fill("500");
        await page.getByLabel("y on the way", { exact: true }).fill("200");
        await page.getByLabel("z on the way", { exact: true }).fill("-200");
        await page.getByLabel("y", { exact: true }).fill("100");
        await page.getByLabel("Tool speed (0: any)", { exact: true }).fill("800");
        await acceptedBy(page, "Arc", "move-arc");
    });
    check(round > 500, `an arc changes ${round} pixels of the arm from above`);
    await page.getByLabel("Tool speed (0: any)", { exact: true }).fill("0");
    await page.getByLabel("Step", { exact: true }).fill("15");
    for (const axis of ["shoulder", "elbow", "lift", "wrist"]) {
        const changed = await moves(page, async () => {
            await acceptedBy(page, `${axis} +`, "move-joint");
            await acceptedBy(page, `${axis} −`, "move-joint");
            await acceptedBy(page, `${axis} +`, "move-joint");
        });
        check(Math.max(...changed) > 50, `a jog of the ${axis} changes ${changed} pixels`);
    }
    // By hand: as long as the button is pressed, and not in automatic operation.
    await happens(page, "jog: moves are held in manual operation alone", () => press(page, "shoulder ▶"));
    await acceptedBy(page, "manual operation", "set-operation");
    for (const [name, at] of [["shoulder ◀", 0], ["lift ▶", 1]]) {
        const changed = await moves(page, async () => {
            await page.getByRole("button", { name, exact: true }).hover();
            await happens(page, "move-joint: accepted", () => page.mouse.down());
            await page.waitForTimeout(700);
            await happens(page, "stop: accepted", () => page.mouse.up());
        });
        check(changed[at] > 50, `${name} held changes ${changed} pixels`);
    }
    await acceptedBy(page, "automatic operation", "set-operation");
    await page.getByLabel("Payload", { exact: true }).fill("5");
    await acceptedBy(page, "Carry", "set-payload");
    await page.getByLabel("Control law").selectOption("pd-gravity");
    await acceptedBy(page, "Use law", "select-law");
    await page.waitForFunction(() => document.querySelector(".head").textContent.includes("pd-gravity"));
    await page.getByLabel("Control law").selectOption("computed-torque:observer");
    await acceptedBy(page, "Use law", "select-law");

    // What cannot be is refused in words, in the sight of the person.
    await page.getByLabel("x", { exact: true }).fill("1050");
    await happens(page, "move-line refused: ", () => press(page, "Line"));
    check((await page.locator(".answer").innerText()).includes("refused"), "the answer is not in sight");
    await page.getByLabel("x", { exact: true }).fill("450");

    await acceptedBy(page, "Disable", "disable");
    await state(page, "ready");
    await acceptedBy(page, "Enable", "enable");
    await state(page, "enabled");

    await happens(page, "scenario: begun", () => press(page, "Run the scenario"));
    await state(page, "moving");
    await acceptedBy(page, "Stop", "stop");
    await state(page, "enabled");
    await happens(page, "scenario: begun", () => press(page, "Run the scenario"));
    await state(page, "moving");
    await happens(page, "stop: accepted", () => page.keyboard.press("Escape"));
    await state(page, "enabled");

    await happens(page, "emergency stop on the bus", () => press(page, "E-stop"));
    await state(page, "estop");
    await acceptedBy(page, "Acknowledge", "fault-reset");
    await state(page, "ready");

    await acceptedBy(page, "Enable", "enable");
    await state(page, "enabled");
    await page.getByLabel("Place", { exact: true }).selectOption("encoder:elbow");
    await page.getByLabel("Fault", { exact: true }).selectOption("encoder:elbow:jump");
    await page.getByLabel("Value", { exact: true }).fill("0.5");
    await page.getByLabel("Lasts (0: as long as that, or it stays)").fill("0.2");
    await happens(page, "fault planted: encoder:elbow:jump=0.5@", () => press(page, "Plant the fault"));
    await state(page, "fault");
    check((await page.locator(".verdict .fault").innerText()).length > 10, "the fault is not named");
}

async function picturesHold(page) {
    await press(page, "Hold the picture");
    const changed = await remember(page, "Shoulder position over time");
    await page.waitForTimeout(800);
    check((await changed()) === 0, "a held picture moves");
    await press(page, "Go on");
    await page.waitForTimeout(800);
    check((await changed()) > 20, "the picture does not go on");
}

try {
    await withBrowser(async (open) => {
        const bench = await start();
        for (const screen of SCREENS) {
            const page = await open(bench.url, "", screen, "no-preference");
            await standing(page);
            await page.waitForTimeout(500);
            await page.screenshot({ path: `${pictures}/live-${screen.name}.png` });
            await page.evaluate(() => document.querySelectorAll(".verdict, .panel, .urgently").forEach((part) => Object.assign(part.style, { position: "static", maxHeight: "none" })));
            await page.screenshot({ path: `${pictures}/live-${screen.name}-whole.png`, fullPage: true });
            await sound(page);
            await accessible(page);
            await page.context().close();
        }
        const page = await open(bench.url, "", SCREENS[0], "no-preference");
        await standing(page);
        await everyButtonActs(page);
        await picturesHold(page);
        await page.screenshot({ path: `${pictures}/live-fault.png` });
        await accessible(page);

        // Whoever has no token looks, and that is all.
        const looking = await open(bench.url.split("#")[0]);
        await state(looking, "fault");
        check(await looking.getByRole("button", { name: "E-stop" }).isDisabled(), "without the token a button acts");
        check((await looking.locator(".panel").innerText()).includes("open the URL"), "nobody says how to take part");
        await accessible(looking);
        await Promise.all([page, looking].map((one) => one.context().close()));
        await bench.end();

        // The program goes, and comes back: the page says so, and shows it.
        const first = await start(0, "--scenario", "pick-place", "--cycles", "1");
        const back = await open(first.url, "", SCREENS[0], "reduce", /ERR_CONNECTION_REFUSED|ERR_INCOMPLETE_CHUNKED_ENCODING|ERR_CONNECTION_RESET|401/);
        await standing(back);
        await first.end();
        await back.getByText("The program does not answer").waitFor();
        check(await back.getByRole("button", { name: "Stop", exact: true }).isDisabled(), "a button acts without a program");
        await back.screenshot({ path: `${pictures}/live-gone.png` });
        const second = await start(first.port, "--scenario", "pick-place", "--cycles", "1");
        await back.getByText("Live.", { exact: true }).waitFor();
        await standing(back);
        // The token was that of the first.
        await press(back, "Disable");
        await back.getByText("the token is that of another run").waitFor();
        await back.goto(second.url);
        await back.reload();
        await standing(back);
        await acceptedBy(back, "Disable", "disable");
        const said = await second.end();
        check(/asked for: \d+ done, 0 refused/.test(said), said);

        // The bus of another run is shown, and not asked for anything.
        const bus = `slcan:tcp:127.0.0.1:${await freePort()}`;
        const other = spawn(program, ["run", "--scenario", "long-run", "--listen", bus, "--quiet", "--no-trace", "--no-report", "--out", folder], { stdio: ["ignore", "ignore", "pipe"] });
        started.add(other);
        await once(other.stderr, "data");
        const watching = await start(0, "--bus", bus);
        const watched = await open(watching.url, "", SCREENS[0], "no-preference");
        await state(watched, "moving");
        const moved = await remember(watched, ARM);
        // At several instants: after a whole cycle the arm is where it was.
        let most = 0;
        for (let instant = 0; instant < 10; instant += 1) {
            await watched.waitForTimeout(170);
            most = Math.max(most, await moved());
        }
        check(most > 500, "the arm of a watched bus does not move");
        check((await watched.getByRole("button").allInnerTexts()).join() === "Hold the picture", "a watched bus is asked for something");
        await watched.getByRole("rowheader", { name: "1C0" }).waitFor();
        await watched.screenshot({ path: `${pictures}/live-watched.png` });
        await sound(watched);
        await accessible(watched);
        await watched.context().close();
        check(/frames of slcan:tcp:/.test(await watching.end()), "nothing is said of the watched bus");
    });
} finally {
    started.forEach((child) => child.kill("SIGKILL"));
    rmSync(folder, { recursive: true });
}
console.log("  live: every button acts over the bus, strangers look at most, and the page comes back after the program; axe finds nothing");
