// The simulation, in a thread of its own: the page stays alive while it computes.

/** What the thread does. It sees nothing of the page: its text is all that it gets. */
function simulator() {
    let exports = null;
    const take = (which) => new Uint8Array(exports.memory.buffer, exports.output(which), exports.output_len(which));
    const answer = (request) => {
        const bytes = new TextEncoder().encode(JSON.stringify(request));
        const place = exports.input(bytes.length);
        // After each call anew: memory that grows gets another buffer.
        new Uint8Array(exports.memory.buffer, place, bytes.length).set(bytes);
        const began = performance.now();
        const status = exports.run();
        const took = (performance.now() - began) / 1000;
        const text = (which) => new TextDecoder().decode(take(which));
        return status === 0 ? { run: { results: JSON.parse(text(2)), drawing: JSON.parse(text(4)) }, took } : { error: text(3) };
    };
    onmessage = ({ data }) => {
        if (data.module) {
            exports = new WebAssembly.Instance(new WebAssembly.Module(data.module)).exports;
        } else {
            postMessage(answer(data.request));
        }
    };
}

/** The bytes of a gzipped file in base64. */
async function unpacked(base64) {
    const packed = Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
    return new Uint8Array(await new Response(stream).arrayBuffer());
}

class Simulation {
    /** @param onAnswer is called with the answer to the newest request: what has run, or an error */
    constructor(base64, onAnswer) {
        const url = URL.createObjectURL(new Blob([`(${simulator})()`], { type: "text/javascript" }));
        this.worker = new Worker(url);
        this.worker.onerror = (event) => onAnswer({ error: `The simulation has ended: ${event.message}. Reload the page.` });
        this.worker.onmessage = ({ data }) => {
            this.busy = false;
            if (this.next) {
                this.ask(this.next);
            } else {
                onAnswer(data);
            }
        };
        // Until the module is there.
        this.busy = true;
        this.next = null;
        unpacked(base64).then(
            (module) => {
                this.worker.postMessage({ module });
                this.busy = false;
                if (this.next) {
                    this.ask(this.next);
                }
            },
            (error) => onAnswer({ error: `The simulation cannot be unpacked: ${error}. Open the page in a newer browser.` }),
        );
    }

    /** Runs a request; one that comes while another runs waits, and the newest alone is answered. */
    ask(request) {
        this.next = this.busy ? request : null;
        if (!this.busy) {
            this.busy = true;
            this.worker.postMessage({ request });
        }
    }
}
