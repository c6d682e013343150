// A headless Chromium for the pages: what they do is watched, and anything that a page must not do is a failure.
//
// PEERS names the folder in which npm has installed playwright-core and axe-core, CHROMIUM the browser.
import { createRequire } from "node:module";
import { readFileSync } from "node:fs";
import { pathToFileURL } from "node:url";

const peer = createRequire(`${process.env.PEERS}/`);
const { chromium } = peer("playwright-core");
const axe = readFileSync(peer.resolve("axe-core/axe.min.js"), "utf8");

/** The screens that every page is looked at on. */
export const SCREENS = [
    { name: "light-wide", colorScheme: "light", viewport: { width: 1280, height: 800 } },
    { name: "dark-wide", colorScheme: "dark", viewport: { width: 1280, height: 800 } },
    { name: "light-narrow", colorScheme: "light", viewport: { width: 390, height: 844 } },
    { name: "dark-narrow", colorScheme: "dark", viewport: { width: 390, height: 844 } },
];

export function check(holds, message) {
    if (!holds) {
        throw new Error(message);
    }
}

/** Starts the browser, hands `open` to `use`, and fails if a page has complained or asked anybody else for anything.
 *  `open` takes a file, or the URL of a server, which may be asked; complaints that match `forgiven` are none. */
export async function withBrowser(use) {
    const browser = await chromium.launch({ executablePath: process.env.CHROMIUM, args: ["--no-sandbox"] });
    const complaints = [];
    const open = async (file, hash = "", screen = SCREENS[0], motion = "reduce", forgiven = /^$/) => {
        const context = await browser.newContext({ colorScheme: screen.colorScheme, viewport: screen.viewport, reducedMotion: motion });
        const page = await context.newPage();
        const own = file.startsWith("http:") ? file : pathToFileURL(file).href;
        const isOwn = (url) => (own.startsWith("http:") ? new URL(url).origin === new URL(own).origin : url.split("#")[0] === own);
        page.on("console", (message) => {
            // The last one is about these tests, which read pixels.
            if (["error", "warning"].includes(message.type()) && !message.text().includes("willReadFrequently") && !forgiven.test(message.text())) {
                complaints.push(`${file}: ${message.text()}`);
            }
        });
        page.on("pageerror", (error) => complaints.push(`${file}: ${error.stack}`));
        page.on("request", (request) => {
            // A blob is a part of the page.
            if (!isOwn(request.url()) && !request.url().startsWith("blob:")) {
                complaints.push(`${file} asks for ${request.url()}`);
            }
        });
        await page.goto(own + hash);
        page.setDefaultTimeout(10_000);
        return page;
    };
    try {
        await use(open);
    } catch (error) {
        // What a page complains of is often why.
        complaints.unshift(error.stack);
    } finally {
        await browser.close();
    }
    check(complaints.length === 0, complaints.join("\n"));
}

/** Fails with every finding of axe. The page forbids foreign scripts, so axe comes as the browser's own. */
export async function accessible(page) {
    await page.evaluate(axe);
    const { violations } = await page.evaluate(() => globalThis.axe.run());
    const found = violations.map(({ id, nodes }) => `${id}: ${nodes.map((node) => node.html).join("\n    ")}`);
    check(found.length === 0, `axe finds:\n${found.join("\n")}`);
}

/** The picture in a canvas of the page, as the bytes of its pixels. */
export function pixels(page, label) {
    return page.evaluate((name) => {
        const canvas = document.querySelector(`canvas[aria-label="${name}"], [aria-label="${name}"] canvas`);
        const { data, width } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
        return { data: [...data], width };
    }, label);
}

/** Keeps the picture in a canvas in the page itself; what comes back tells how many of its pixels have changed since. */
export async function remember(page, label) {
    const compare = await page.evaluateHandle((name) => {
        const canvas = document.querySelector(`canvas[aria-label="${name}"], [aria-label="${name}"] canvas`);
        const picture = () => new Uint32Array(canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data.buffer);
        const before = picture();
        return () => picture().reduce((count, pixel, index) => count + (pixel === before[index] ? 0 : 1), 0);
    }, label);
    return () => compare.evaluate((changed) => changed());
}

/** How many pixels two pictures do not have in common. */
export function unlike(one, other) {
    let count = 0;
    for (let index = 0; index < one.data.length; index += 4) {
        count += [0, 1, 2, 3].some((part) => one.data[index + part] !== other.data[index + part]) ? 1 : 0;
    }
    return count;
}

/** The numbers of the pixels of a colour. */
export function places({ data }, [red, green, blue]) {
    const found = new Set();
    for (let index = 0; index < data.length; index += 4) {
        if (data[index] === red && data[index + 1] === green && data[index + 2] === blue) {
            found.add(index / 4);
        }
    }
    return found;
}

/** Red, green and blue of a colour of the style sheet. */
export function rgb(page, name) {
    return page.evaluate((colour) => {
        const hex = getComputedStyle(document.documentElement).getPropertyValue(`--${colour}`).trim();
        return [1, 3, 5].map((place) => parseInt(hex.slice(place, place + 2), 16));
    }, name);
}

/** Nothing is wider than the screen, and no number on the page is missing. */
export async function sound(page) {
    const wide = await page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);
    check(wide <= 0, `the page is ${wide} pixels wider than its screen`);
    const text = await page.evaluate(() => document.body.innerText);
    const missing = /undefined|NaN|\[object/.exec(text);
    check(!missing, `the page says "${missing}"`);
}
