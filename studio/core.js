// The page's side of the worker: requests and answers, files that it has to have again when it is started anew.
"use strict";

// The module in base64 of a DEFLATE stream, compiled while it is unpacked.
async function compiled(text) {
  const packed = await fetch(`data:application/octet-stream;base64,${text.trim()}`);
  const bytes = packed.body.pipeThrough(new DecompressionStream("deflate"));
  return WebAssembly.compileStreaming(new Response(bytes, { headers: { "Content-Type": "application/wasm" } }));
}

class Core {
  constructor() {
    this.files = new Map();
    this.waiting = new Map();
    this.next = 1;
    this.onprogress = () => {};
    this.source = URL.createObjectURL(new Blob([document.getElementById("worker").textContent], { type: "text/javascript" }));
  }

  async start() {
    // The core is the last thing on the page.
    if (document.readyState === "loading") await new Promise((done) => addEventListener("DOMContentLoaded", done, { once: true }));
    this.module ??= await compiled(document.getElementById("core").textContent);
    this.worker = new Worker(this.source);
    this.worker.onmessage = ({ data }) => {
      if ("progress" in data) return this.onprogress(data.progress);
      const { done, refuse } = this.waiting.get(data.id);
      this.waiting.delete(data.id);
      this.since = performance.now();
      if (!("broken" in data)) return done(data);
      // A mistake of ours leaves the core in no state to go on from.
      refuse(new Error(data.broken ? `internal error in the core: ${data.broken}`
        : "the work needs more memory than a page can have; use a larger grid spacing, or the command `trabecula mesh`"));
      this.restart().catch(() => {});
    };
    await this.send({ module: this.module });
    for (const [name, bytes] of this.files) await this.send({ request: { do: "file", name }, bytes });
  }

  send(message) {
    const id = this.next++;
    if (!this.waiting.size) this.since = performance.now();
    return new Promise((done, refuse) => {
      this.waiting.set(id, { done, refuse });
      this.worker.postMessage({ ...message, id });
    });
  }

  // The answer {head, body, ms}; a request that is cut off by a restart is refused with the name "stopped".
  async ask(request, bytes) {
    await this.ready;
    return this.send({ request, bytes });
  }

  // Milliseconds for which the worker has been at one request.
  get busy() {
    return this.waiting.size ? performance.now() - this.since : 0;
  }

  async file(name, bytes) {
    this.files.set(name, bytes);
    await this.ask({ do: "file", name }, bytes);
  }

  restart() {
    this.worker?.terminate();
    for (const { refuse } of this.waiting.values()) refuse(Object.assign(new Error("stopped"), { name: "stopped" }));
    this.waiting.clear();
    this.ready = this.start();
    return this.ready;
  }
}
