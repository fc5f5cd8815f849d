// The worker: holds the core, answers one request after another.
"use strict";
let core = null;

// What the core does not call may be named among its imports; each of these says so if it is.
function imports(module) {
  const lent = {
    progress: (done, total) => postMessage({ progress: total ? done / total : 0 }),
    failed: (at, length) => { imports.words = new TextDecoder().decode(new Uint8Array(core.memory.buffer, at, length)); },
  };
  const all = { host: lent };
  for (const { module: of, name } of WebAssembly.Module.imports(module)) {
    all[of] ??= {};
    all[of][name] ??= () => { throw new Error(`${name} is not available`); };
  }
  return all;
}

function ask(request, bytes) {
  const line = new TextEncoder().encode(`${JSON.stringify(request)}\n`);
  const at = core.reserve(line.length + bytes.length);
  const input = new Uint8Array(core.memory.buffer, at, line.length + bytes.length);
  input.set(line);
  input.set(bytes, line.length);
  const size = core.ask();
  const output = new Uint8Array(core.memory.buffer, core.answer(), size);
  const end = output.indexOf(10);
  const head = JSON.parse(new TextDecoder().decode(output.subarray(0, end)));
  return { head, body: output.slice(end + 1).buffer };
}

onmessage = async ({ data }) => {
  try {
    if (data.module) {
      const made = await WebAssembly.instantiate(data.module, imports(data.module));
      core = made.exports;
      return postMessage({ id: data.id, head: {} });
    }
    const start = performance.now();
    const { head, body } = ask(data.request, data.bytes || new Uint8Array());
    postMessage({ id: data.id, head, body, ms: performance.now() - start }, [body]);
  } catch (error) {
    // Where memory is at its end there are no words.
    const words = imports.words || (error instanceof WebAssembly.RuntimeError ? "" : error.message);
    postMessage({ id: data.id, broken: words || "" });
  }
};
