// Runs the rows of a table of bits in the module of plant-sim/web and prints the resulting table:
//
//   node tests/web/run.mjs MODULE.wasm TABLE.csv
// Its speed goes to standard error.
import { createHash } from "node:crypto";
import { readFileSync } from "node:fs";

const [path, table] = process.argv.slice(2);
const module = new WebAssembly.Module(readFileSync(path));
const { memory, input, run, output, output_len } = new WebAssembly.Instance(module).exports;

const bytes = (which) => Buffer.from(memory.buffer, output(which), output_len(which));
const sha256 = (data) => createHash("sha256").update(data).digest("hex");

let simulated = 0;
let wall = 0;
const [header, ...rows] = readFileSync(table, "utf8").trimEnd().split("\n");
console.log(header);
for (const row of rows) {
    const [name, law, rate, cycles] = row.split(",");
    const scenario = readFileSync(new URL(`../../plant-sim/scenarios/${name}.toml`, import.meta.url), "utf8");
    const request = JSON.stringify({ scenario, law, rate_hz: Number(rate), cycles: Number(cycles) });
    const length = Buffer.byteLength(request);
    // First the place, then the buffer: memory that grows gets another one.
    const place = input(length);
    Buffer.from(memory.buffer, place, length).write(request);
    const began = performance.now();
    const status = run();
    wall += (performance.now() - began) / 1000;
    if (status !== 0) {
        console.error(`${name},${law},${rate},${cycles}: ${bytes(3)}`);
        process.exit(1);
    }
    simulated += JSON.parse(bytes(2)).sim_time_s;
    console.log([name, law, rate, cycles, sha256(bytes(0)), sha256(bytes(1))].join(","));
}
console.error(`${(simulated / wall).toFixed(0)} times real time in node ${process.version}`);
