// The pictures of the README, each of a page that draws:
//
//   node tests/pages/pictures.mjs FOLDER NAME=PAGE...
//
// PAGE is a file, or the address of a page that a program of ours serves.
import { writeFileSync } from "node:fs";
import { accessible, check, pixels, places, rgb, sound, withBrowser } from "./browser.mjs";

const [folder, ...pages] = process.argv.slice(2);
const ARM = "The arm from above, with the path of its tool";

const seek = (page, t) => page.getByLabel("Time", { exact: true }).fill(String(t));

/** Runs it some times: the first run of a page has the browser compile it, and the page shows how long each takes. */
async function computed(page) {
    await page.waitForFunction(() => document.querySelector("#trace")?.textContent.length === 64);
    for (let run = 0; run < 6; run += 1) {
        // Nothing scrolls towards it so.
        await page.getByRole("button", { name: "Start again" }).evaluate((button) => button.click());
        await page.waitForTimeout(500);
    }
}

/** How each page is brought to a moment before the arm moves, and to the one of the picture; a page that lives gets there by itself. */
const MOMENTS = {
    report: [(page) => seek(page, 0), (page) => seek(page, 0.38)],
    view: [(page) => page.waitForFunction(() => document.querySelector(".head .chip")?.textContent === "moving"), (page) => page.waitForTimeout(200)],
    "what-if": [(page) => computed(page).then(() => seek(page, 0)), (page) => seek(page, 0.38)],
};

/** The arm is drawn, and it leaves a good part of the place where it was. */
async function armMoves(page, name) {
    const body = await rgb(page, "body");
    const [before, after] = MOMENTS[name];
    await before(page);
    const there = places(await pixels(page, ARM), body);
    check(there.size > 2000, `${name}: the arm has ${there.size} pixels`);
    let left = 0;
    for (let attempt = 0; attempt < 50 && left < there.size / 20; attempt += 1) {
        await after(page);
        const now = places(await pixels(page, ARM), body);
        check(now.size > 2000, `${name}: once it has moved, the arm has ${now.size} pixels`);
        left = [...there].filter((place) => !now.has(place)).length;
    }
    check(left >= there.size / 20, `${name}: the arm leaves ${left} of its ${there.size} pixels`);
}

await withBrowser(async (open) => {
    for (const [name, place] of pages.map((argument) => argument.split(/=(.*)/s))) {
        const page = await open(place);
        await armMoves(page, name);
        await sound(page);
        await accessible(page);
        // No frame around what was used last.
        await page.evaluate(() => document.activeElement.blur());
        const browser = await page.context().newCDPSession(page);
        const { data } = await browser.send("Page.captureScreenshot", { format: "webp", quality: 75 });
        writeFileSync(`${folder}/${name}.webp`, Buffer.from(data, "base64"));
    }
});
